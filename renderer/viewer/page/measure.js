// Measuring: two clicked pixels, the line between the points that they see, and its length with the bound of its error.
import { closing, element } from "./element.js";
import { LineSet } from "./lines.js";
import { clipMatrix } from "./matrix.js";

const NONE = new LineSet(1);
const COLOR = [255, 255, 255, 255];
const STEPS = ["Click the first point.", "Click the second point.", "A third click begins anew."];

// One digit that is no less.
export function roundedUp(x) {
  const near = x.toExponential(0);
  if (Number(near) >= x) return near;
  const [digit, power] = near.split("e");
  return Number(`${Number(digit) + 1}e${power}`).toExponential(0);
}

export const told = ({ length, bound }) => `${length} ± ${roundedUp(bound)}`;

const vector = (v) => v.map((x, k) => `${"xyz"[k]} ${x}`).join("\n");

function rows(points, distance) {
  const axes = distance ? ["dx", "dy", "dz"].map((name, k) => [name, String(distance.vector[k])]) : [];
  const ends = points.map((point, i) => [["From", "To"][i], vector(point)]);
  return [...axes, ...ends].flatMap(([name, value]) => [element("dt", { textContent: name }), element("dd", { textContent: value })]);
}

function linesOf(points) {
  const lines = new LineSet();
  if (points.length === 2) lines.add(...points, COLOR, 3);
  for (const point of points) lines.add(point, point, COLOR, 9);
  return lines;
}

// Where a point lies on the film, from -1 to 1, and `w`, which is above 0 before the camera.
function onFilm(clip, [x, y, z]) {
  const [across, up, w] = [0, 1, 3].map((row) => clip[row] * x + clip[4 + row] * y + clip[8 + row] * z + clip[12 + row]);
  return { x: across / w, y: up / w, w };
}

export class Measure {
  // `viewer` is the page; `label` says the distance on the picture, where the middle of the line is.
  constructor(viewer, { button, card, label }) {
    Object.assign(this, { viewer, button, card, label, on: false, seq: 0 });
    button.addEventListener("click", () => this.toggle());
    this.forget();
  }

  toggle() {
    if (this.on) return this.end();
    this.viewer.rays.close();
    this.become(true);
  }

  end() {
    if (!this.on) return;
    if (this.card.contains(document.activeElement)) this.viewer.stage.focus();
    this.become(false);
  }

  become(on) {
    this.on = on;
    this.button.setAttribute("aria-pressed", String(on));
    this.viewer.stage.classList.toggle("measuring", on);
    this.forget();
  }

  // What was measured is not there any more, nor taken when it comes.
  forget() {
    this.seq++;
    this.pixels = [];
    this.found([], null);
  }

  // Take a clicked pixel, as `Rays.pixel` tells it; returns whether it is one to measure.
  take(pixel) {
    if (!this.on) return false;
    this.pixels = this.pixels.length < 2 ? [...this.pixels, pixel] : [pixel];
    this.viewer.connection.send({ type: "measure", seq: ++this.seq, pixels: this.pixels });
    return true;
  }

  // The renderer's answer: a point for each pixel, null for the sky.
  show({ seq, scene, points, distance }) {
    if (seq !== this.seq || scene !== this.viewer.scene.id) return;
    if (points.includes(null)) this.viewer.notices.say("There is no surface at this pixel.");
    this.pixels = this.pixels.filter((_, i) => points[i]);
    this.found(points.filter((point) => point), distance);
  }

  found(points, distance) {
    Object.assign(this, { points, lines: points.length ? linesOf(points) : NONE });
    this.label.textContent = distance ? told(distance) : "";
    if (!distance) this.label.hidden = true; // at once; where it stands, the next drawing says
    this.card.hidden = !this.on;
    if (this.on) this.fill(distance);
    this.viewer.frames.request();
  }

  fill(distance) {
    const { points, card } = this;
    const said = distance ? [element("p", { className: "distance", textContent: told(distance) })] : [];
    const each = distance ? " The bound holds for dx, dy and dz too." : "";
    card.replaceChildren(closing("End measuring", () => this.end()), element("h2", { textContent: "Distance" }), ...said,
      element("dl", {}, ...rows(points, distance)), element("p", { className: "note", textContent: STEPS[points.length] + each }));
  }

  // Put the label above the line as `view` sees it, where both ends are before the camera.
  place(view) {
    const { points, label, viewer } = this;
    const clip = points.length === 2 && clipMatrix(view, viewer.scene.bounds);
    const ends = points.map((point) => clip && onFilm(clip, point));
    label.hidden = !clip || ends.some(({ w }) => w <= 0);
    if (label.hidden) return;
    const [x, y] = [(ends[0].x + ends[1].x) / 2, Math.max(ends[0].y, ends[1].y)];
    label.hidden = Math.max(Math.abs(x), Math.abs(y)) > 1;
    label.style.left = `${50 + 50 * x}%`;
    label.style.top = `${50 - 50 * y}%`;
  }
}
