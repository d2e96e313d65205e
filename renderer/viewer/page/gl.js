// The WebGL layer: the model and lines over it, or lines alone over a traced picture.
import { clipMatrix, dot, norm, scale, add, seenFrom, sub } from "./matrix.js";
import { DEPTH, LIGHTED, Model } from "./model.js";
import { Boxes } from "./boxes.js";
import { Lines } from "./lines.js";

// Beyond it a finer grid is not seen, and fragments cost their time.
const MAX_PIXEL_RATIO = 2;

// How graphics without a graphics processor call themselves.
const SOFTWARE = /swiftshader|llvmpipe|softpipe|software|basic render/i;
// The most boxes that are drawn at a time. Two cores draw one to three a millisecond, so that a picture takes them less
// than a second; a graphics processor is bounded by the memory of their lines and panes, 46 MB.
const BOXES = { software: 1000, hardware: 100000 };

// What the veil darkens towards, as sRGB.
const NIGHT = [0.03, 0.06, 0.13];

const srgb = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * Math.min(x, 1) ** (1 / 2.4) - 0.055);

export class GlLayer {
  // `lost()` is called when the browser takes the context away. Raises an error where it offers no WebGL2.
  constructor(canvas, lost) {
    this.canvas = canvas;
    // Kept, so that the picture can be saved and read back at any time.
    this.gl = canvas.getContext("webgl2", { preserveDrawingBuffer: true });
    if (!this.gl) throw new Error("this browser offers no WebGL2");
    canvas.addEventListener("webglcontextlost", lost, { once: true });
    this.model = new Model(this.gl);
    this.boxes = new Boxes(this.gl);
    this.lines = new Lines(this.gl);
    this.gain = 1; // of the colours of the lit model and its sky
    const info = this.gl.getExtension("WEBGL_debug_renderer_info");
    const name = this.gl.getParameter(info ? info.UNMASKED_RENDERER_WEBGL : this.gl.RENDERER);
    this.mostBoxes = SOFTWARE.test(name) ? BOXES.software : BOXES.hardware;
  }

  // Take another scene, of which nothing is drawn before its mesh is loaded.
  begin(scene) {
    this.scene = scene;
    this.model.clear();
  }

  // Show other materials and lights of the same scene.
  dress(scene) {
    this.scene = scene;
    this.model.dress(scene.materials);
  }

  load(mesh) {
    this.model.load(mesh, this.scene);
  }

  get loaded() {
    return this.model.loaded;
  }

  // `width` and `height` are those of the frame, in CSS pixels.
  resize(width, height) {
    const ratio = Math.min(window.devicePixelRatio || 1, MAX_PIXEL_RATIO);
    const [w, h] = [Math.round(width * ratio), Math.round(height * ratio)];
    if (this.canvas.width !== w) this.canvas.width = w;
    if (this.canvas.height !== h) this.canvas.height = h;
    this.lines.film = [width, height];
  }

  // Draw for `view`; with the shading DEPTH only lines are seen, and what lies under them darkened by the share `veil`.
  // `panes` are the boxes' faces, `layers` are {name, set, hidden, fades}.
  draw(view, { shading, veil, panes, layers }) {
    const { gl } = this;
    const seen = layers.filter(({ set }) => set.count);
    gl.viewport(0, 0, gl.drawingBufferWidth, gl.drawingBufferHeight);
    const dark = NIGHT.map((c) => c * veil);
    const gain = LIGHTED.includes(shading) ? this.gain : 1;
    const sky = this.scene.background.map((c, i) => srgb(c * gain) * (1 - veil) + dark[i]);
    gl.clearColor(...(shading === DEPTH ? [...dark, veil] : [...sky, 1]));
    gl.enable(gl.DEPTH_TEST);
    gl.depthFunc(gl.LESS);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
    if (shading === DEPTH && !seen.length) return;
    const clip = clipMatrix(view, this.scene.bounds);
    const eye = seenFrom(view, this.scene.bounds);
    this.model.draw(shading, clip, { eye, scene: this.scene, veil: [...dark, veil], gain });
    this.boxes.draw(panes, clip);
    for (const { name, set, hidden, fades } of seen) this.lines.draw(name, set, clip, this.fade(view, fades), hidden);
  }

  // From where to where lines fade: through the scene, or nowhere near it.
  fade(view, fades) {
    if (view.height) return [1, 1e6]; // where nothing is smaller for being far, every line has its full strength
    const [lower, upper] = this.scene.bounds;
    const radius = norm(sub(upper, lower)) / 2;
    const distance = dot(sub(view.m.slice(12, 15), scale(add(lower, upper), 0.5)), view.m.slice(8, 11));
    return [Math.max(distance - radius, 0.02 * radius), Math.max(distance + radius, radius) * (fades ? 1 : 1e6)];
  }
}
