// The list of numbers in the panel, and the short line over the picture.
import { element } from "./element.js";
import { FACE_COLORS, PROOF } from "./connection.js";

export const count = (n) => n.toLocaleString("en");
export const bytes = (n) => (n < 1e6 ? `${(n / 1e3).toFixed(0)} kB` : `${(n / 1e6).toFixed(1)} MB`);
const seconds = (s) => (s < 1 ? `${(1e3 * s).toFixed(0)} ms` : `${s.toFixed(2)} s`);
const milliseconds = (ms) => (ms < 10 ? `${ms.toFixed(1)} ms` : seconds(ms / 1e3));
// Rays a second, of which `millions` are given: 0.004 of them are 4 thousand.
const pace = (millions) =>
  millions < 0.1 ? `${(1e3 * millions).toFixed(millions < 0.01 ? 2 : 1)} k rays/s` : `${millions.toFixed(millions < 10 ? 2 : 1)} M rays/s`;
const scale = ({ aov, low, high }) =>
  ["cost", "nodes", "triangles"].includes(aov) ? `${count(low)} to ${count(high)} ${aov === "cost" ? "rays" : aov}` : `${low.toPrecision(4)} to ${high.toPrecision(4)}`;

export class Readings {
  constructor(list, line) {
    Object.assign(this, { list, line, values: {}, grown: null });
  }

  // Update some of the readings by name.
  read(values) {
    for (const [name, value] of Object.entries(values)) {
      if (!this.values[name]) {
        this.values[name] = element("dd");
        this.list.append(element("dt", { textContent: name }), this.values[name]);
      }
      this.values[name].textContent = value;
    }
  }

  // What the server's /scene says of the scene and its octree.
  ofScene({ faces, vertices, octree, threads }) {
    this.coarse();
    this.read({ faces: count(faces), vertices: count(vertices), nodes: count(octree.nodes), leaves: count(octree.leaves),
      levels: octree.levels, memory: bytes(octree.bytes), built: seconds(octree.build_seconds), threads });
  }

  // A picture that the page draws by itself, of {w, h}.
  ofGl({ w, h }) {
    this.coarse();
    this.line.textContent = `WebGL · ${w} × ${h}`;
    this.read({ picture: `${w} × ${h}`, pass: "–", time: "–", shown: "–", speed: "–", scale: "–" });
  }

  // A picture at rest that has grown finer: the number of its view, its samples a pixel, and what is left of its error
  // in 255ths, as estimated.
  refined({ seq, samples, error }) {
    this.grown = seq;
    const told = `${samples} samples a pixel, within about ${error.toFixed(error < 1 ? 2 : 1)} of 255`;
    this.line.textContent = told;
    this.read({ refined: told });
  }

  // What is seen now has not grown.
  coarse() {
    this.grown = null;
    if (this.values.refined) this.read({ refined: "–" });
  }

  // A picture or colours that arrived: {kind, seq, step, last, w, h, ms, rate}, `late` milliseconds after `view` was sent; its
  // `legend` has the values at the ends of a scale of colours, where the picture has one.
  ofPicture({ kind, seq, step, last, w, h, ms, rate }, late, faces, view) {
    if (seq !== this.grown) this.coarse();
    const { legend } = view;
    const [time, shown] = [milliseconds(ms), `after ${milliseconds(late)}`];
    const ends = legend ? scale(legend) : "–";
    if (kind === FACE_COLORS) {
      this.line.textContent = `flat Phong · ${count(faces)} colours in ${time}`;
      return this.read({ picture: `${count(faces)} colours`, pass: "–", time, shown, speed: "–", scale: ends });
    }
    const speed = kind === PROOF ? "–" : pace(rate);
    const size = last ? `${w} × ${h}` : `${w} × ${h} of ${view.w} × ${view.h}`;
    this.line.textContent = kind === PROOF ? `${size} twice · ${time}` : `${size} · ${time} · ${speed}`;
    this.read({ picture: `${w} × ${h}`, pass: last ? "final" : `${step + 1}`, time, shown, speed, scale: ends });
  }
}
