// The page: one camera, four modes, and the newest view on its way to the renderer.
import { Camera } from "./camera.js";
import { Connection, FACE_COLORS, fetchFrom } from "./connection.js";
import { Controls } from "./controls.js";
import { film } from "./film.js";
import { GlLayer } from "./gl.js";
import { bindKeys } from "./keys.js";
import { DEPTH, FACES, LIT } from "./model.js";
import { Notices } from "./notices.js";
import { NO_BOXES, fetchBoxes } from "./overlay.js";
import { Panel } from "./panel.js";
import { Picture } from "./picture.js";
import { Progress } from "./progress.js";
import { Rays } from "./rays.js";
import { Readings } from "./readings.js";
import { savePicture, saveText } from "./save.js";

const TRACED = ["brute", "octree"];
// A traced picture of another camera is shown this long, then the model of WebGL moves instead: a quarter of a second.
const STALE = 250;
// Brute force starts once the camera rests: a picture of seconds is not worth starting in each frame.
const REST = 150;
// So long what was drawn last stays while its successor is on its way: drawing the model in between, only to draw again
// at once, would take where there is no graphics processor longer than all the rest.
const HOLD = 50;
// Hidden parts of lines shine through the model by these shares.
const HIDDEN = { boxes: 0.1, visited: 0.3, rays: 0.65 };
// Under boxes the model is darkened by this share, so that they glow.
const VEIL = 0.66;

const find = (selector) => document.querySelector(selector);

class Viewer {
  constructor() {
    Object.assign(this, { mode: "octree", seq: 0, sent: new Map(), shown: null, dirty: true, movedAt: 0, heldSince: null });
    this.boxes = NO_BOXES;
    this.stage = find("#stage");
    this.picture = new Picture(find("#picture"));
    this.notices = new Notices(find("#notices"));
    this.progress = new Progress(find("#progress"));
    this.rays = new Rays(find("#card"), find("#frame"), () => this.request());
    this.readings = new Readings(find("#readings"), find("#hud"));
    this.panel = new Panel((name) => this.changed(name));
    try {
      this.layer = new GlLayer(find("#gl"), () => this.lostGl());
    } catch (error) {
      this.withoutGl(error.message);
    }
  }

  async start() {
    await this.loadScene();
    this.controls = new Controls(this.stage, {
      camera: () => this.camera,
      moved: () => this.moved(),
      clicked: (x, y) => this.pickAt(x, y),
    });
    bindKeys(this);
    this.bindButtons();
    new ResizeObserver(() => this.layout()).observe(this.stage);
    this.layout();
    this.setMode(this.mode);
    this.connection = new Connection({
      received: (picture) => this.received(picture),
      told: (message) => this.told(message),
      changed: (open) => this.connected(open),
    });
    document.body.dataset.ready = "true";
  }

  async loadScene() {
    this.scene = await (await fetchFrom("scene")).json();
    this.camera = new Camera(this.scene);
    this.panel.load(this.scene);
    this.readings.ofScene(this.scene);
    this.shown = null;
    this.rays.close();
    find("#name").textContent = this.scene.name.replace(/\.toml$/, "").replaceAll("_", " ");
    document.title = `${this.scene.name} · octree-render`;
    if (this.layer) this.layer.load(await (await fetchFrom("mesh")).arrayBuffer(), this.scene);
    await this.loadBoxes();
    this.dirty = true;
  }

  async loadBoxes() {
    const { boxes, level } = this.panel.fields;
    this.boxes = NO_BOXES;
    if (boxes.checked && this.layer && !boxes.disabled) {
      const wanted = level.value;
      const fetched = await fetchBoxes(Number(wanted));
      if (wanted !== level.value || !boxes.checked) return;
      this.boxes = fetched;
      this.panel.showBoxes(fetched.count);
    }
    this.request();
  }

  withoutGl(reason) {
    this.layer = null;
    find("#gl").hidden = true;
    document.body.dataset.gl = "none";
    for (const mode of ["gl", "phong"]) {
      const input = find(`[name=mode][value=${mode}]`);
      input.disabled = true;
      input.parentElement.title = `Needs WebGL2: ${reason}`;
    }
    this.panel.offerBoxes(false);
    this.notices.say(`GL lighting, own Phong, boxes and ray paths need WebGL2: ${reason}. Ray tracing works.`);
  }

  // The browser took WebGL away, as it may when the graphics driver restarts.
  lostGl() {
    this.withoutGl("the browser took it away; reload the page to have it back");
    this.rays.close();
    if (!TRACED.includes(this.mode)) this.setMode("octree");
    this.request();
  }

  bindButtons() {
    const onClick = (id, act) => find(id).addEventListener("click", act);
    find("#modes").addEventListener("change", ({ target }) => this.setMode(target.value));
    onClick("#reset-view", () => this.reset());
    onClick("#fit", () => this.fit());
    onClick("#cancel", () => this.cancel());
    onClick("#save-picture", () => savePicture(this.visibleLayers(), this.scene.name));
    onClick("#save-camera", () => {
      const { m, fovy } = this.view();
      this.connection.send({ type: "camera", m, fovy, walk: this.controls.walking });
    });
    onClick("#toggle-panel", () => {
      const away = document.body.classList.toggle("wide");
      find("#toggle-panel").setAttribute("aria-expanded", String(!away));
    });
  }

  // What a change of a setting asks for.
  changed(name) {
    const { fields } = this.panel;
    if (name === "file") {
      this.notices.say(`Opening ${fields.file.value} …`, "opening");
      this.connection.send({ type: "scene", file: fields.file.value });
    } else if (name === "boxes" || name === "level") {
      if (name === "level") fields.boxes.checked = true;
      this.loadBoxes().catch((error) => this.notices.say(error.message));
    } else if (name === "walk") this.controls.walking = fields.walk.checked;
    else if (name === "size") this.layout();
    else this.moved();
  }

  setMode(mode) {
    const input = find(`[name=mode][value=${mode}]`);
    if (input.disabled) return this.notices.say(`${input.parentElement.textContent.slice(1)}: ${input.parentElement.title}`);
    if (this.mode === "brute" && mode !== "brute") this.progress.show(null);
    input.checked = true;
    this.mode = mode;
    this.panel.setMode(mode);
    find("#hud").textContent = "";
    this.dirty = true;
    this.movedAt = 0;
    this.request();
  }

  reset() {
    this.camera.reset();
    this.panel.resetLight();
    this.moved();
  }

  fit() {
    this.camera.fit(this.size.w / this.size.h);
    this.moved();
  }

  moved() {
    const now = performance.now();
    if (!this.dirty) this.staleSince = now;
    this.dirty = true;
    this.movedAt = now;
    this.request();
  }

  // Fit frame and layers into the stage, by the chosen resolution.
  layout() {
    const room = [Math.max(this.stage.clientWidth, 1), Math.max(this.stage.clientHeight, 1)];
    const { css, size } = film(room, this.panel.fields.size.value, this.scene.render.resolution);
    this.size = size;
    const { style } = find("#frame");
    [style.width, style.height] = css.map((side) => `${side}px`);
    this.layer?.resize(...css);
    this.moved();
  }

  view() {
    return { m: this.camera.matrix(), fovy: this.camera.fovy, ...this.size };
  }

  // Ask for a drawing in the next frame.
  request() {
    this.undrawn = true;
    this.wake();
  }

  // Ask for a frame, once there is something to draw.
  wake() {
    if (this.size) this.pending ??= requestAnimationFrame((now) => {
      this.pending = null;
      this.frame(now);
    });
  }

  frame(now) {
    // A page that slept goes on from where it was, not a leap further.
    const seconds = Math.min((now - (this.before ?? now)) / 1000, 0.1);
    const moving = this.controls.advance(seconds);
    this.before = moving ? now : null;
    const waiting = this.mode === "brute" && performance.now() - this.movedAt < REST;
    if (this.dirty && this.connection?.ready && !waiting) this.sendView();
    // An answer that came since this frame was asked for has drawn it all.
    if (this.held) setTimeout(() => this.heldSince !== null && this.wake(), HOLD);
    else if (this.undrawn) this.draw();
    if (moving || waiting) this.request();
  }

  // Whether to wait a moment for the answer to the newest view.
  get held() {
    return this.sent.has(this.seq) && this.heldSince !== null && performance.now() - this.heldSince < HOLD;
  }

  sendView() {
    const view = { ...this.view(), mode: this.mode, at: performance.now() };
    const { m, fovy, w, h } = view;
    this.seq++;
    if (this.mode !== "gl") this.sent.set(this.seq, view); // to which nothing is sent
    this.dirty = false;
    this.heldSince ??= view.at;
    this.connection.send({ type: "view", seq: this.seq, mode: this.mode, m, fovy, w, h, settings: this.panel.settings });
    if (this.mode === "brute") this.progress.show(0);
  }

  // Whether the traced picture was taken by the current camera.
  get current() {
    if (this.shown?.mode !== this.mode) return false;
    const now = this.view();
    const sameShape = this.shown.w * now.h === this.shown.h * now.w;
    return sameShape && this.shown.m.every((x, i) => x === now.m[i]);
  }

  // Whether it may stand for the current camera all the same, because the next is about to come.
  get recent() {
    if (this.shown?.mode !== this.mode) return false;
    const since = Math.max(this.shown.arrived, this.staleSince ?? 0);
    return !this.layer || (this.mode === "octree" && performance.now() - since < STALE);
  }

  draw() {
    this.heldSince = null;
    this.undrawn = false;
    const traced = TRACED.includes(this.mode);
    const current = traced && this.current;
    const live = current || (traced && this.recent);
    this.picture.visible = live || (traced && !this.layer);
    this.stage.classList.toggle("waiting", traced && !live);
    if (this.layer) {
      const view = live ? this.shown : this.view();
      const shading = live ? DEPTH : this.mode === "phong" ? FACES : LIT;
      const veil = this.boxes.count ? VEIL : 0;
      this.layer.draw(view, { shading, veil, direction: this.panel.light, panes: this.boxes.panes, layers: [
        { name: "boxes", set: this.boxes.edges, hidden: HIDDEN.boxes, fades: true },
        { name: "visited", set: this.rays.visited, hidden: HIDDEN.visited, fades: true },
        { name: "rays", set: this.rays.path, hidden: HIDDEN.rays, fades: false },
      ] });
    }
    if (this.mode === "gl") this.note({ seq: this.seq, step: 0, last: true }, this.view());
    // A picture of an earlier camera stands for a while only, unless another drawing has replaced it by then.
    this.standing = live && !current && Boolean(this.layer);
    if (this.standing) setTimeout(() => this.standing && this.request(), STALE);
  }

  // Say on the stage which view is seen now.
  note({ seq, step, last }, { m, fovy, w, h }) {
    const known = { mode: this.mode, seq, step, last: Number(last), camera: JSON.stringify({ m, fovy, w, h }) };
    Object.assign(this.stage.dataset, known);
    if (this.mode === "gl") this.readings.ofGl({ w, h });
  }

  async received(picture) {
    const { seq, step, last, kind } = picture;
    const view = this.sent.get(seq);
    const wanted = view?.mode === this.mode;
    if (wanted && kind === FACE_COLORS) {
      this.layer?.model.setFaceColors(picture.bytes);
      this.draw();
      this.note(picture, this.view());
    } else if (wanted) {
      await this.picture.show(picture);
      this.shown = { ...view, w: picture.w, h: picture.h, seq, arrived: performance.now() };
      this.note(picture, this.shown);
      this.draw();
    }
    this.connection.send({ type: "ack", seq, step });
    // Nothing older comes after it.
    for (const old of this.sent.keys()) if (old < seq || (old === seq && last)) this.sent.delete(old);
    if (!wanted) return;
    if (this.mode === "brute") this.progress.show(null);
    this.readings.ofPicture(picture, performance.now() - view.at, this.scene.faces, view.legend);
  }

  told(message) {
    const acts = {
      // Not after a cancel, which this may have crossed on the way.
      progress: ({ seq, done }) => seq === this.seq && this.progress.shown && this.progress.show(done),
      pick: (pick) => this.rays.show(pick, this.scene),
      legend: (legend) => this.sent.has(legend.seq) && (this.sent.get(legend.seq).legend = legend),
      scene: () => this.otherScene(),
      camera: ({ name, text }) => saveText(name, text),
      error: ({ message: text }) => {
        this.notices.clear("opening");
        this.notices.say(text);
        this.panel.fields.file.value = this.scene.name; // the one that is still shown
      },
    };
    acts[message.type]?.(message);
  }

  async otherScene() {
    this.notices.clear("opening");
    try {
      await this.loadScene();
      this.layout();
      this.setMode(this.mode);
    } catch (error) {
      this.notices.say(`The scene cannot be shown: ${error.message}`);
    }
  }

  connected(open) {
    document.body.dataset.connected = String(open);
    if (open) {
      this.notices.clear("lost");
      this.dirty = true;
      this.request();
    } else {
      this.progress.show(null);
      this.notices.say("No connection to the renderer; trying again.", "lost");
    }
  }

  cancel() {
    if (!this.progress.shown) return;
    this.connection.send({ type: "cancel" });
    this.dirty = false; // nor is a change wanted that was waiting for the camera to rest
    this.progress.show(null);
    this.notices.say("Brute force cancelled; the next movement starts it again.");
  }

  pickAt(clientX, clientY) {
    const question = this.rays.question(this.view(), this.panel.settings, clientX, clientY);
    if (question) this.connection.send(question);
  }

  // The canvases that are seen, lowest first.
  visibleLayers() {
    const traced = TRACED.includes(this.mode) && (this.current || this.recent || !this.layer);
    return [...(traced ? [this.picture.canvas] : []), ...(this.layer ? [this.layer.canvas] : [])];
  }
}

// Reachable from the console, for the curious and for tests.
const viewer = (window.viewer = new Viewer());
viewer.start().catch((error) => viewer.notices.say(`The scene cannot be shown: ${error.message}`));
