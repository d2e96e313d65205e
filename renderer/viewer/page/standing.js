// Which traced picture may stand on the stage: none older or coarser than one that was seen for the same view.

// The shapes of two films are the same but for sides that were rounded to whole pixels.
const sameShape = (a, b) => Math.abs(a.w * b.h - a.h * b.w) <= Math.max(a.w, a.h, b.w, b.h);

// Whether two views {m, fovy, height, w, h} are by the same camera, on films of one shape.
export const sameCamera = (a, b) =>
  a.fovy === b.fovy && a.height === b.height && sameShape(a, b) && a.m.every((x, i) => x === b.m[i]);

const FINENESS = { samples: 0, refine: 0 };
// Values of which the octree and brute force have different ones.
const BY_TREE = ["nodes", "triangles"];

const sameSettings = (a, b) => JSON.stringify({ ...a.settings, ...FINENESS }) === JSON.stringify({ ...b.settings, ...FINENESS });

// Whether pictures of both modes are the same. Brute force gives the octree's colours; a proof has two pictures.
const sameWay = (a, b) => a.mode === b.mode || (a.mode !== "proof" && b.mode !== "proof" && !BY_TREE.includes(a.settings.aov));

// Whether they differ at most in how finely they are traced.
const sameButFiner = (a, b) => sameCamera(a, b) && sameWay(a, b) && sameSettings(a, b);

// Whether the picture of view `a` is true of view `b`: the octree's colours are one of the two pictures of a proof.
export const isOf = (a, b) =>
  sameCamera(a, b) && sameSettings(a, b) && (sameWay(a, b) || (b.mode === "proof" && a.settings.aov === "color"));

// Whether a picture {w, h, rows, last} that came for `view` is to take the place of `shown`, {view, w} or null. `now` is
// the view of the camera as it is, and `model` whether WebGL's model stands in for the picture. A band of rows is as fine
// as the last picture, but takes the place of a part only.
export function improves({ w, h, rows, last }, view, { shown, now, model }) {
  if (rows < h) return shown !== null && sameCamera(shown.view, view);
  const current = shown !== null && sameCamera(shown.view, now);
  if (!sameCamera(view, now)) return !current && !model;
  return last || !current || !sameButFiner(shown.view, view) || w > shown.w;
}
