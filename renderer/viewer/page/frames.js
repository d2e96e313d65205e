// What is drawn, in the page's next frame: the traced picture, or WebGL's model, and what lies over both.
import { gain } from "./exposure.js";
import { drawing } from "./layers.js";
import { DEPTH, FACES, FLAT, LIT, WIREFRAME } from "./model.js";
import { REST, SLOW, STALE, TRACED } from "./traced.js";

// So long what was drawn last stays while its successor is on its way: drawing the model in between, only to draw again
// at once, would take where there is no graphics processor longer than all the rest.
const HOLD = 50;

export class Frames {
  constructor(viewer, until) {
    Object.assign(this, { viewer, until, heldSince: null, undrawn: false, pending: null, model: false });
  }

  // Ask for a drawing in the next frame.
  request() {
    this.undrawn = true;
    this.wake();
  }

  // Ask for a frame, once there is something to draw.
  wake() {
    if (this.viewer.size) this.pending ??= requestAnimationFrame((now) => {
      this.pending = null;
      this.frame(now);
    });
  }

  frame(now) {
    const { traced, controls, mode } = this.viewer;
    // A page that slept goes on from where it was, not a leap further.
    const seconds = Math.min((now - (this.before ?? now)) / 1000, 0.1);
    const moving = controls.advance(seconds);
    this.before = moving ? now : null;
    const waiting = SLOW.includes(mode) && performance.now() - traced.movedAt < REST;
    if (traced.dirty && this.viewer.attended && !waiting) {
      this.heldSince ??= performance.now();
      traced.send();
    }
    // An answer that came since this frame was asked for has drawn it all.
    if (this.held) setTimeout(() => this.heldSince !== null && this.wake(), HOLD);
    else if (this.undrawn) this.draw();
    if (moving || waiting) this.request();
  }

  // Whether to wait a moment for the answer to the newest view.
  get held() {
    return this.viewer.traced.waiting && this.heldSince !== null && performance.now() - this.heldSince < HOLD;
  }

  // How the model is drawn where no traced picture is seen.
  get shading() {
    const { mode, panel } = this.viewer;
    if (mode === "gl") return { smooth: LIT, flat: FLAT, wireframe: WIREFRAME }[panel.fields.faces.value];
    return mode === "phong" ? FACES : LIT;
  }

  draw() {
    const { viewer } = this;
    const { layer, mode, traced: { current, recent, shown } } = viewer;
    this.heldSince = null;
    this.undrawn = false;
    const traced = TRACED.includes(mode);
    const live = traced && (current || recent);
    viewer.picture.visible = live;
    viewer.legend.show(live ? shown.legend : null);
    this.until.hidden = !live || shown.view.mode === mode;
    this.model = traced && !live && Boolean(layer?.loaded);
    viewer.stage.classList.toggle("waiting", traced && !live);
    if (layer) {
      const view = live ? { ...shown.view, w: shown.w, h: shown.h } : viewer.view();
      layer.gain = gain(viewer.panel.fields.exposure.valueAsNumber);
      layer.draw(view, drawing(live ? DEPTH : this.shading, viewer.scenes.boxes, viewer.rays, viewer.measure));
    }
    viewer.measure.place(live ? shown.view : viewer.view());
    viewer.pointed.refresh();
    if (mode === "gl" && layer?.loaded) this.note({ seq: viewer.traced.seq, step: 0, last: true }, viewer.view());
    // A picture of an earlier camera stands for a while only, unless another drawing has replaced it by then.
    this.standing = live && !current && Boolean(layer?.loaded);
    if (this.standing) setTimeout(() => this.standing && this.request(), STALE);
  }

  // Say on the stage which view is seen now.
  note({ seq, step, last }, { m, fovy, height, w, h }) {
    const { mode, stage, readings } = this.viewer;
    const camera = JSON.stringify({ m, fovy, height, w, h });
    Object.assign(stage.dataset, { mode, seq, step, last: Number(last), camera });
    if (mode === "gl") readings.ofGl({ w, h });
  }

  // The canvases that are seen, lowest first.
  get layers() {
    const { layer, picture, traced } = this.viewer;
    return [...(traced.current || traced.recent || !layer ? [picture.canvas] : []), ...(layer ? [layer.canvas] : [])];
  }
}
