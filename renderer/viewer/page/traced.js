// The newest view on its way to the renderer, and the pictures that come back: which of them stands on the stage.
import { FACE_COLORS, PROOF } from "./connection.js";
import { improves, isOf, sameCamera } from "./standing.js";

export const TRACED = ["brute", "octree", "proof"];
// Whose pictures take seconds, and are begun when the camera rests.
export const SLOW = ["brute", "proof"];
// A traced picture of another camera is shown this long, then the model of WebGL moves instead: a quarter of a second.
export const STALE = 250;
// Brute force starts once the camera rests: a picture of seconds is not worth starting in each frame.
export const REST = 150;

// Milliseconds after which a coarse picture is said to be one.
const SLOWLY = 1000;

export class Traced {
  constructor(viewer) {
    Object.assign(this, { viewer, seq: 0, sent: new Map(), shown: null, dirty: true, movedAt: 0, staleSince: null });
  }

  // Another camera, or another picture of it, is wanted.
  moved() {
    const now = performance.now();
    if (this.placed) this.staleSince = null;
    else this.staleSince ??= now;
    this.dirty = true;
    this.movedAt = now;
    this.expect(false);
  }

  // Another kind of picture is wanted at once.
  begin() {
    this.dirty = true;
    this.movedAt = 0;
  }

  // Nothing of the scene before is shown any more, nor taken when it comes.
  forget() {
    Object.assign(this, { shown: null, staleSince: null });
    this.sent.clear();
  }

  // What was sent last is not wanted, nor is a change that was waiting for the camera to rest.
  cancel() {
    this.dirty = false;
    this.expect(false);
    this.sent.delete(this.seq);
  }

  send() {
    const { viewer } = this;
    const view = { ...this.view, at: performance.now() };
    const { at, ...message } = view;
    this.seq++;
    if (viewer.mode !== "gl") this.sent.set(this.seq, view); // to which nothing is sent
    this.dirty = false;
    const sent = viewer.connection.send({ type: "view", seq: this.seq, ...message });
    if (sent === false) this.sent.delete(this.seq);
    else if (SLOW.includes(viewer.mode)) viewer.progress.show(0);
  }

  // The view as it is now, with all that its picture depends on.
  get view() {
    const { viewer } = this;
    return { ...viewer.view(), mode: viewer.mode, settings: viewer.panel.settings };
  }

  // Whether the answer to the newest view is still to come, or more of it.
  get waiting() {
    return this.sent.has(this.seq);
  }

  // Whether the traced picture was taken by the current camera.
  get placed() {
    return this.shown !== null && TRACED.includes(this.viewer.mode) && sameCamera(this.shown.view, this.viewer.view());
  }

  // Whether it is that of the current settings, too.
  get valid() {
    return this.placed && isOf(this.shown.view, this.view);
  }

  // Whether it may stand: one of other settings only until theirs comes, which it does not after a cancel.
  get current() {
    return this.placed && (this.dirty || this.waiting || this.valid);
  }

  // Whether it may stand for the current camera all the same, because the next is about to come or nothing else is there.
  get recent() {
    const { mode, layer } = this.viewer;
    if (this.shown === null || !TRACED.includes(mode)) return false;
    if (!layer?.loaded) return true;
    return mode === "octree" && this.staleSince !== null && performance.now() - this.staleSince < STALE;
  }

  // Whether it is the last that comes for the newest view.
  get finished() {
    return this.current && this.shown.last && this.shown.seq === this.seq && !this.dirty;
  }

  // Whether the traced picture of the newest view is still to come, or more of it.
  get coming() {
    return TRACED.includes(this.viewer.mode) && !this.finished && (this.dirty || this.waiting);
  }

  // The settings of the picture that is seen, which may have grown to more samples than are set.
  get settings() {
    const { settings } = this.viewer.panel;
    return this.finished ? { ...settings, samples: this.shown.samples } : settings;
  }

  async received(picture) {
    const { viewer } = this;
    const { seq, step, last, kind } = picture;
    // The picture of a camera at rest grows finer after its last.
    const view = this.sent.get(seq) ?? (this.shown?.seq === seq ? this.shown.view : undefined);
    let wanted = view?.mode === viewer.mode;
    if (wanted && kind === FACE_COLORS) this.color(picture);
    else if (wanted) {
      wanted = improves(picture, view, { shown: this.shown, now: viewer.view(), model: viewer.frames.model });
      if (wanted) await this.stand(picture, view);
    }
    viewer.connection.send({ type: "ack", seq, step });
    // Nothing older comes after it.
    for (const old of this.sent.keys()) if (old < seq || (old === seq && last)) this.sent.delete(old);
    if (!wanted) return;
    if (SLOW.includes(viewer.mode) && picture.last) viewer.progress.show(null);
    viewer.readings.ofPicture(picture, performance.now() - view.at, viewer.scene.faces, view);
    viewer.saving.finish();
  }

  color(picture) {
    const { frames, layer } = this.viewer;
    if (!layer?.loaded) return; // they are asked for again when it is
    layer.model.setFaceColors(picture.bytes);
    frames.draw();
    frames.note(picture, this.viewer.view());
  }

  // Let a traced picture stand on the stage.
  async stand(picture, view) {
    const { viewer } = this;
    const { scene, proof, frames, picking } = viewer;
    await viewer.picture.show(picture);
    if (viewer.scene !== scene) return viewer.picture.clear();
    const { seq, step, last, w, h } = picture;
    const samples = this.shown?.seq === seq ? this.shown.samples : view.settings.samples;
    this.shown = { view, w, h, seq, step, last, samples, legend: view.legend ?? null };
    this.staleSince = this.placed ? null : performance.now();
    viewer.busy.end("tracing");
    this.expect(!last);
    if (picture.kind === PROOF && this.valid) proof.tell(view.legend);
    frames.note(picture, { ...view, w, h });
    frames.draw();
    if (last && this.proofOf(picking.asked) !== null) picking.again();
  }

  // Say that a finer picture is on its way, if it takes its time; slow modes have a bar that says it.
  expect(more) {
    clearTimeout(this.expected);
    this.viewer.busy.end("finer");
    if (more && !SLOW.includes(this.viewer.mode)) this.expected = setTimeout(() => this.coming && this.viewer.busy.begin("finer", "Tracing a finer picture …"), SLOWLY);
  }

  // What the values of a view's picture mean, before it comes.
  explain({ seq, ...legend }) {
    if (this.sent.has(seq)) this.sent.get(seq).legend = { seq, ...legend };
  }

  refined({ seq, samples, ...rest }) {
    if (seq !== this.seq) return;
    if (this.shown?.seq === seq) this.shown.samples = samples;
    this.viewer.readings.refined({ seq, samples, ...rest });
    this.viewer.pointed.refresh();
  }

  // The number of the proof that says something of `view`, null where none does or there is no view.
  proofOf(view) {
    const said = view && this.viewer.proof.told && this.valid && sameCamera(this.shown.view, view);
    return said ? this.shown.seq : null;
  }
}
