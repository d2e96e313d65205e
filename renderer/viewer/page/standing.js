// Which traced picture may stand on the stage: none older or coarser than one that was seen for the same view.

// The shapes of two films are the same but for sides that were rounded to whole pixels.
const sameShape = (a, b) => Math.abs(a.w * b.h - a.h * b.w) <= Math.max(a.w, a.h, b.w, b.h);

// Whether two views {m, fovy, height, w, h} are by the same camera, on films of one shape.
export const sameCamera = (a, b) =>
  a.fovy === b.fovy && a.height === b.height && sameShape(a, b) && a.m.every((x, i) => x === b.m[i]);

const FINENESS = { samples: 0, refine: 0 };

// Whether they differ at most in how finely they are traced. Brute force gives the octree's picture; a proof has two.
const sameButFiner = (a, b) =>
  sameCamera(a, b) && (a.mode === "proof") === (b.mode === "proof") && JSON.stringify({ ...a.settings, ...FINENESS }) === JSON.stringify({ ...b.settings, ...FINENESS });

// Whether a picture {w, h, rows, last} that came for `view` is to take the place of `shown`, {view, w} or null. `now` is
// the view of the camera as it is, and `model` whether WebGL's model stands in for the picture. A band of rows is as fine
// as the last picture, but takes the place of a part only.
export function improves({ w, h, rows, last }, view, { shown, now, model }) {
  if (rows < h) return shown !== null && sameCamera(shown.view, view);
  const current = shown !== null && sameCamera(shown.view, now);
  if (!sameCamera(view, now)) return !current && !model;
  return last || !current || !sameButFiner(shown.view, view) || w > shown.w;
}
