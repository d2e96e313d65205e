// The value of the pixel under the pointer, as the renderer tells it for the traced picture that is seen.

// Milliseconds between two questions.
const PAUSE = 50;
// Pictures whose pixels have a value each.
const MODES = ["octree", "brute"];

const three = (v) => v.map((x) => x.toFixed(3)).join(" ");
const digits = (x) => (Math.abs(x) < 1e6 ? x.toPrecision(5) : x.toExponential(4));
const SAID = {
  color: (rgb) => `Colour ${rgb.map((x) => x.toPrecision(3)).join(" ")}, linear`,
  depth: (t) => `Depth ${digits(t)}`,
  normal: (n) => `Normal ${three(n)}`,
  face: (face) => `Face ${face}`,
  cost: (rays) => `Cost ${rays} ${rays === 1 ? "ray" : "rays"}`,
  nodes: (nodes) => `${nodes} ${nodes === 1 ? "node" : "nodes"} visited`,
  triangles: (triangles) => `${triangles} ${triangles === 1 ? "triangle" : "triangles"} tested`,
};

export class Pointed {
  // `viewer` is the page, `line` says the value.
  constructor(viewer, line) {
    Object.assign(this, { viewer, line, at: null, seq: 0, said: null, asked: null, text: null, picture: null, waiting: null });
    for (const name of ["pointermove", "pointerdown"])
      viewer.stage.addEventListener(name, ({ clientX, clientY }) => this.move([clientX, clientY]));
    viewer.stage.addEventListener("pointerleave", () => this.move(null));
  }

  move(at) {
    this.at = at;
    this.refresh();
  }

  // The finished picture that is seen, as a question for one of its pixels; null where there is none.
  get seen() {
    const { traced: { shown, finished }, scene } = this.viewer;
    if (!finished || !MODES.includes(shown.view.mode)) return null;
    const { m, fovy, height, w, h, mode, settings } = shown.view;
    return { scene: scene.id, view: { m, fovy, height, w, h }, mode, settings: { ...settings, samples: shown.samples } };
  }

  // Ask anew where another pixel or another picture is under the pointer.
  refresh() {
    const seen = this.at && this.seen;
    const picture = JSON.stringify(seen);
    if (picture !== this.picture) this.clear(picture);
    const pixel = seen && this.viewer.rays.pixel(seen.view, ...this.at);
    const text = JSON.stringify(pixel);
    if (text === this.text) return;
    this.text = text;
    if (!pixel) return this.clear(picture);
    this.asked = { ...pixel, mode: seen.mode, settings: seen.settings };
    this.waiting ??= setTimeout(() => this.ask(), PAUSE);
  }

  ask() {
    this.waiting = null;
    if (this.asked) this.viewer.connection.send({ type: "probe", seq: ++this.seq, ...this.asked });
  }

  // No value of another picture stays, nor is one taken that is still to come.
  clear(picture) {
    Object.assign(this, { picture, asked: null, text: null });
    this.seq++;
    this.line.textContent = "";
  }

  show({ seq, scene, aov, value }) {
    this.refresh();
    if (seq !== this.seq || scene !== this.viewer.scene.id) return;
    this.said = seq;
    this.line.textContent = value === null ? "No surface" : SAID[aov](value);
  }
}
