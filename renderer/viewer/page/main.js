// The page: one camera, five modes, and the newest view on its way to the renderer.
import { read, written } from "./address.js";
import { Camera } from "./camera.js";
import { Connection, FACE_COLORS, PROOF, fetchFrom } from "./connection.js";
import { Controls } from "./controls.js";
import { film } from "./film.js";
import { heading } from "./element.js";
import { GlLayer } from "./gl.js";
import { Busy } from "./busy.js";
import { Changes } from "./changes.js";
import { bindKeys, returnKeys } from "./keys.js";
import { drawing } from "./layers.js";
import { continues, kept, remember, remembered, stays } from "./memory.js";
import { Hint } from "./hint.js";
import { Legend } from "./legend.js";
import { Measure } from "./measure.js";
import { DEPTH, FACES, LIT } from "./model.js";
import { Notices } from "./notices.js";
import { fetchBoxes } from "./nodes.js";
import { Objects } from "./objects.js";
import { NO_BOXES } from "./overlay.js";
import { Panel } from "./panel.js";
import { Past } from "./past.js";
import { Picture } from "./picture.js";
import { Pointed } from "./pointed.js";
import { Progress } from "./progress.js";
import { Proof } from "./proof.js";
import { Rays } from "./rays.js";
import { Readings } from "./readings.js";
import { copyText, savePicture, saveText } from "./save.js";
import { Sharing } from "./sharing.js";
import { improves, isOf, sameCamera } from "./standing.js";

const TRACED = ["brute", "octree", "proof"];
// Whose pictures take seconds, and are begun when the camera rests.
const SLOW = ["brute", "proof"];
// A traced picture of another camera is shown this long, then the model of WebGL moves instead: a quarter of a second.
const STALE = 250;
// A mesh of more faces, some 70 MB, is fetched only once WebGL is to draw it.
const MANY_FACES = 1e6;
// Brute force starts once the camera rests: a picture of seconds is not worth starting in each frame.
const REST = 150;
// So long what was drawn last stays while its successor is on its way: drawing the model in between, only to draw again
// at once, would take where there is no graphics processor longer than all the rest.
const HOLD = 50;
const TOO_LARGE = "What this page sends of the change is too large for the server; it is shown once it is smaller.";

const find = (selector) => document.querySelector(selector);

class Viewer {
  constructor() {
    Object.assign(this, { mode: "octree", seq: 0, sent: new Map(), shown: null, dirty: true, movedAt: 0, heldSince: null });
    // The id of the scene that the server shows here, the scene that the page has, and the one whose mesh it fetches.
    Object.assign(this, { announced: null, scene: null, meshOf: null });
    Object.assign(this, { staleSince: null, model: false, saving: false, focusing: null });
    this.boxes = NO_BOXES;
    this.stage = find("#stage");
    this.proof = new Proof({
      bar: find("#proof"), divider: find("#divider"), frame: find("#frame"), changed: () => this.picture?.paint(), asked: () => this.changed("pair"),
    });
    this.picture = new Picture(find("#picture"), this.proof);
    this.legend = new Legend(find("#legend"));
    this.notices = new Notices(find("#notices"));
    this.progress = new Progress(find("#progress"));
    this.busy = new Busy(find("#busy"));
    this.rays = new Rays(find("#card"), find("#frame"), () => this.request(), (pick) => this.seeAside(pick));
    this.measure = new Measure(this, { button: find("#measure"), card: find("#measured"), label: find("#distance") });
    this.pointed = new Pointed(this, find("#pointed"));
    this.readings = new Readings(find("#readings"), find("#hud"));
    this.panel = new Panel((name) => this.changed(name));
    this.objects = new Objects(find("#objects"), (hidden) => this.hide(hidden));
    this.changes = new Changes(find("#changes"));
    this.hint = new Hint(find("#hint"));
    this.sharing = new Sharing(this, find("#share"));
    this.past = new Past(() => this.address, find("#undo"), find("#redo"));
    try {
      this.layer = new GlLayer(find("#gl"), () => this.lostGl());
    } catch (error) {
      this.withoutGl(error.message);
    }
  }

  start() {
    this.busy.begin("opening", "Opening the scene …");
    this.connection = new Connection({
      received: (picture) => this.sharing.received(picture) || this.received(picture),
      told: (message) => this.told(message),
      changed: (open) => this.connected(open),
      refused: (too) => (too ? this.notices.say(TOO_LARGE, "large") : this.notices.clear("large")),
    });
    this.connection.open();
    addEventListener("pagehide", () => this.scene && remember({ ...this.kept, hash: location.hash }));
    // The address in the bar may be the page's own again by now.
    addEventListener("hashchange", ({ newURL }) => {
      if (!this.scene) return;
      this.past.arrive();
      this.goTo(read(new URL(newURL).hash));
    });
    // A page that is loaded again goes on from where it was; another address says where to begin.
    const before = remembered();
    const [{ type }] = performance.getEntriesByType("navigation");
    if (type === "navigate" && location.hash && location.hash !== before?.hash) this.asked = read(location.hash);
    else this.before = before;
  }

  // What works once there is a scene.
  begin() {
    this.controls = new Controls(this.stage, find("#frame"), {
      camera: () => this.camera,
      moved: () => this.moved(),
      clicked: (x, y) => this.pickAt(x, y),
      focused: (x, y) => this.focus(x, y),
    });
    bindKeys(this);
    returnKeys(this.stage);
    this.bindButtons();
    new ResizeObserver(() => this.layout()).observe(this.stage);
    document.body.dataset.ready = "true";
  }

  // The server shows the scene with that id here; one that the page has not is taken over, all at once.
  async showScene(id) {
    this.announced = id;
    if (this.scene?.id !== id) {
      const scene = await (await fetchFrom("scene", { id })).json();
      if (this.announced !== id) return;
      this.take(scene);
    }
    this.busy.end("opening");
    this.dirty = true;
    this.request();
  }

  take(scene) {
    const before = this.kept ?? this.before;
    this.before = null;
    this.scene = scene;
    this.camera = new Camera(scene);
    if (stays(before, scene)) this.camera.state = before.camera;
    this.proof.offer(scene.references);
    this.panel.load(scene);
    if (stays(before, scene) || continues(before, scene)) this.panel.chosen = before.chosen;
    this.objects.load(scene);
    this.dress();
    this.forget();
    this.readings.ofScene(scene);
    Object.assign(find("#name"), heading(scene.name));
    document.title = `${scene.name} · octree-render`;
    if (!this.controls) this.begin();
    this.layout();
    this.setMode(this.offers(before?.mode) ? before.mode : this.mode);
    if (this.asked) this.goTo(this.asked);
    if (TRACED.includes(this.mode)) this.busy.begin("tracing", "Tracing the first picture …");
    if (scene.faces <= MANY_FACES) this.loadMesh();
    this.tryBoxes();
  }

  // What there is to come back to; null before there is a scene.
  get kept() {
    return this.scene && { ...kept(this.scene, this.camera), chosen: this.panel.chosen, mode: this.mode, hidden: this.objects.hidden };
  }

  // Show the view of an address: of a scene that is not shown, once it is.
  goTo(asked) {
    this.asked = null;
    const { file, mode, state, hidden, chosen } = asked;
    if (file && file !== this.scene.name && this.scene.files.includes(file)) {
      this.open(file);
      this.asked = asked;
      return;
    }
    if (hidden !== null && this.objects.differ(hidden)) {
      this.hide(hidden);
      this.asked = { ...asked, hidden: null }; // asked for once, whatever the answer is
      return;
    }
    this.panel.load(this.scene);
    this.panel.restart();
    this.panel.chosen = chosen;
    if (state) this.camera.state = state;
    this.changed("edits");
    this.layout();
    this.setMode(this.offers(mode) ? mode : this.mode);
  }

  offers(mode) {
    return mode !== undefined && !find(`[name=mode][value=${mode}]`).disabled;
  }

  // The address of the view.
  get address() {
    const { scene, mode, camera, panel, objects } = this;
    return written({ file: scene.name, mode, state: camera.state, chosen: panel.chosen, hidden: objects.hidden });
  }

  hide(hidden) {
    this.asked = null;
    this.busy.begin("opening", "Building the octree …");
    this.connection.send({ type: "hide", hidden });
  }

  // The scene with the user's materials and lights, as WebGL and cards show it.
  dress() {
    this.dressed = this.panel.edits.dressed;
    this.layer?.dress(this.dressed);
  }

  // Nothing of the scene before is shown any more, nor taken when it comes.
  forget() {
    Object.assign(this, { shown: null, boxes: NO_BOXES, staleSince: null, meshOf: null });
    this.sent.clear();
    this.rays.close();
    this.measure.forget();
    this.picture.clear();
    this.proof.forget();
    this.legend.show(null);
    this.layer?.begin(this.dressed);
    this.stopSaving();
    for (const name of ["mesh", "tracing"]) this.busy.end(name);
  }

  async loadMesh() {
    const { scene } = this;
    if (!this.layer || this.meshOf === scene) return;
    this.meshOf = scene;
    this.busy.begin("mesh", "Loading the model for WebGL …");
    try {
      const mesh = await (await fetchFrom("mesh", { id: scene.id })).arrayBuffer();
      if (this.scene !== scene || !this.layer) return;
      this.layer.load(mesh);
      this.dirty ||= this.mode === "phong"; // whose colours had no faces before
      this.request();
    } catch (error) {
      if (this.scene !== scene) return;
      this.meshOf = null; // so that the next change of mode tries again
      if (error.status !== 404) this.notices.say(`The model cannot be shown: ${error.message}`);
    } finally {
      if (this.scene === scene) this.busy.end("mesh");
    }
  }

  async loadBoxes() {
    const { boxes, level } = this.panel.fields;
    const { scene } = this;
    this.boxes = NO_BOXES;
    if (boxes.checked && this.layer && !boxes.disabled) {
      this.loadMesh();
      const wanted = level.value;
      const fetched = await fetchBoxes(scene.id, Number(wanted), this.layer.mostBoxes);
      if (wanted !== level.value || !boxes.checked || this.scene !== scene) return;
      this.boxes = fetched;
      this.panel.showBoxes(fetched);
    }
    this.request();
  }

  tryBoxes() {
    const { scene } = this;
    this.loadBoxes().catch((error) => this.scene === scene && error.status !== 404 && this.notices.say(error.message));
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
    this.notices.say(`Preview, Flat Phong, boxes and ray paths need WebGL2: ${reason}. Ray tracing works.`);
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
    onClick("#reload", () => this.open(this.scene.name));
    onClick("#reset-light", () => this.panel.edits.turnSun(this.panel.edits.sunlight));
    onClick("#save-picture", () => this.save());
    onClick("#save-camera", () => {
      const { m, fovy, height } = this.view();
      this.connection.send({ type: "camera", m, fovy, height, walk: this.controls.walking, settings: this.seen });
    });
    onClick("#copy-command", () => this.connection.send({ type: "command", mode: this.mode, ...this.view(), settings: this.seen }));
    onClick("#save-scene", () => {
      const { m, fovy, height } = this.view();
      this.connection.send({ type: "save", m, fovy, height, settings: this.panel.settings });
    });
    onClick("#show-boxes", () => this.panel.fields.boxes.click());
  }

  // What a change of a setting asks for.
  changed(name) {
    const { fields } = this.panel;
    if (name === "file") this.open(fields.file.value);
    else if (name === "boxes" || name === "level") {
      if (name === "level") fields.boxes.checked = true;
      this.tryBoxes();
    } else if (name === "walk") this.controls.walking = fields.walk.checked;
    else if (name === "size") this.layout();
    else if (name === "projection" || name === "focal") {
      if (name === "focal") this.camera.focal = 10 ** fields.focal.value;
      else this.camera.orthographic = fields.projection.value === "orthographic";
      this.moved();
    } else {
      if (name === "edits") this.dress();
      this.moved();
      this.pickAgain();
    }
  }

  open(file) {
    this.asked = null;
    this.busy.begin("opening", `Opening ${file} …`);
    this.connection.send({ type: "scene", file });
  }

  setMode(mode) {
    const input = find(`[name=mode][value=${mode}]`);
    if (input.disabled) return this.notices.say(`${input.parentElement.textContent.slice(1)}: ${input.parentElement.title}`);
    if (SLOW.includes(this.mode) && mode !== this.mode) this.progress.show(null);
    find("#proof").hidden = mode !== "proof";
    if (mode !== "proof") this.proof.forget();
    if (!TRACED.includes(mode)) {
      this.stopSaving();
      this.busy.end("tracing");
      this.loadMesh();
    }
    input.checked = true;
    this.mode = mode;
    this.panel.setMode(mode);
    find("#hud").textContent = "";
    this.dirty = true;
    this.movedAt = 0;
    this.past.keep();
    this.request();
  }

  reset() {
    this.camera.reset();
    this.moved();
  }

  fit() {
    this.camera.fit(this.size.w / this.size.h);
    this.moved();
  }

  moved() {
    const now = performance.now();
    if (this.placed) this.staleSince = null;
    else this.staleSince ??= now;
    if (this.proof.told && !this.valid) this.proof.forget();
    this.dirty = true;
    this.movedAt = now;
    this.panel.showCamera(this.camera);
    this.past.keep();
    this.request();
  }

  // Fit frame and layers into the stage, by the chosen resolution.
  layout() {
    const room = [Math.max(this.stage.clientWidth, 1), Math.max(this.stage.clientHeight, 1)];
    const { css, size } = film(room, this.panel.fields.size.value, this.scene.render.resolution, devicePixelRatio);
    this.size = size;
    const { style } = find("#frame");
    [style.width, style.height] = css.map((side) => `${side}px`);
    this.layer?.resize(...css);
    this.moved();
  }

  view() {
    const { fovy, height } = this.camera;
    return { m: this.camera.matrix(), fovy, ...(height === null ? {} : { height }), ...this.size };
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
    const waiting = SLOW.includes(this.mode) && performance.now() - this.movedAt < REST;
    if (this.dirty && this.attended && !waiting) this.sendView();
    // An answer that came since this frame was asked for has drawn it all.
    if (this.held) setTimeout(() => this.heldSince !== null && this.wake(), HOLD);
    else if (this.undrawn) this.draw();
    if (moving || waiting) this.request();
  }

  // Whether to wait a moment for the answer to the newest view.
  get held() {
    return this.sent.has(this.seq) && this.heldSince !== null && performance.now() - this.heldSince < HOLD;
  }

  // Whether the server shows the scene that the page has.
  get attended() {
    return this.connection.ready && this.scene !== null && this.announced === this.scene.id;
  }

  sendView() {
    const view = { ...this.view(), mode: this.mode, at: performance.now(), settings: this.panel.settings };
    const { at, ...message } = view;
    this.seq++;
    if (this.mode !== "gl") this.sent.set(this.seq, view); // to which nothing is sent
    this.dirty = false;
    this.heldSince ??= at;
    const sent = this.connection.send({ type: "view", seq: this.seq, ...message });
    if (sent === false) this.sent.delete(this.seq);
    else if (SLOW.includes(this.mode)) this.progress.show(0);
  }

  // Whether the traced picture was taken by the current camera.
  get placed() {
    return this.shown !== null && TRACED.includes(this.mode) && sameCamera(this.shown.view, this.view());
  }

  // Whether it is that of the current settings, too.
  get valid() {
    return this.placed && isOf(this.shown.view, { ...this.view(), mode: this.mode, settings: this.panel.settings });
  }

  // Whether it may stand: one of other settings only until theirs comes, which it does not after a cancel.
  get current() {
    return this.placed && (this.dirty || this.sent.has(this.seq) || this.valid);
  }

  // Whether it may stand for the current camera all the same, because the next is about to come or nothing else is there.
  get recent() {
    if (this.shown === null || !TRACED.includes(this.mode)) return false;
    if (!this.layer?.loaded) return true;
    return this.mode === "octree" && this.staleSince !== null && performance.now() - this.staleSince < STALE;
  }

  // Whether it is the last that comes for the newest view.
  get finished() {
    return this.current && this.shown.last && this.shown.seq === this.seq && !this.dirty;
  }

  // How the model is drawn where no traced picture is seen.
  get shading() {
    return this.mode === "phong" ? FACES : LIT;
  }

  draw() {
    this.heldSince = null;
    this.undrawn = false;
    const traced = TRACED.includes(this.mode);
    const current = traced && this.current;
    const live = current || (traced && this.recent);
    this.picture.visible = live;
    this.legend.show(live ? this.shown.legend : null);
    find("#until").hidden = !live || this.shown.view.mode === this.mode;
    this.model = traced && !live && Boolean(this.layer?.loaded);
    this.stage.classList.toggle("waiting", traced && !live);
    if (this.layer) {
      const view = live ? { ...this.shown.view, w: this.shown.w, h: this.shown.h } : this.view();
      const shading = live ? DEPTH : this.shading;
      this.layer.draw(view, drawing(shading, this.boxes, this.rays, this.measure));
    }
    this.measure.place(live ? this.shown.view : this.view());
    this.pointed.refresh();
    if (this.mode === "gl" && this.layer?.loaded) this.note({ seq: this.seq, step: 0, last: true }, this.view());
    // A picture of an earlier camera stands for a while only, unless another drawing has replaced it by then.
    this.standing = live && !current && Boolean(this.layer?.loaded);
    if (this.standing) setTimeout(() => this.standing && this.request(), STALE);
  }

  // Say on the stage which view is seen now.
  note({ seq, step, last }, { m, fovy, height, w, h }) {
    const known = { mode: this.mode, seq, step, last: Number(last), camera: JSON.stringify({ m, fovy, height, w, h }) };
    Object.assign(this.stage.dataset, known);
    if (this.mode === "gl") this.readings.ofGl({ w, h });
  }

  async received(picture) {
    const { seq, step, last, kind } = picture;
    // The picture of a camera at rest grows finer after its last.
    const view = this.sent.get(seq) ?? (this.shown?.seq === seq ? this.shown.view : undefined);
    let wanted = view?.mode === this.mode;
    if (wanted && kind === FACE_COLORS) this.color(picture);
    else if (wanted) {
      wanted = improves(picture, view, { shown: this.shown, now: this.view(), model: this.model });
      if (wanted) await this.stand(picture, view);
    }
    this.connection.send({ type: "ack", seq, step });
    // Nothing older comes after it.
    for (const old of this.sent.keys()) if (old < seq || (old === seq && last)) this.sent.delete(old);
    if (!wanted) return;
    if (SLOW.includes(this.mode) && picture.last) this.progress.show(null);
    this.readings.ofPicture(picture, performance.now() - view.at, this.scene.faces, view);
    if (this.saving && this.finished) this.saveNow();
  }

  color(picture) {
    if (!this.layer?.loaded) return; // they are asked for again when it is
    this.layer.model.setFaceColors(picture.bytes);
    this.draw();
    this.note(picture, this.view());
  }

  // Let a traced picture stand on the stage.
  async stand(picture, view) {
    const { scene } = this;
    await this.picture.show(picture);
    if (this.scene !== scene) return this.picture.clear();
    const { seq, step, last, w, h } = picture;
    const samples = this.shown?.seq === seq ? this.shown.samples : view.settings.samples;
    this.shown = { view, w, h, seq, step, last, samples, legend: view.legend ?? null };
    this.staleSince = this.placed ? null : performance.now();
    this.busy.end("tracing");
    if (picture.kind === PROOF && this.valid) this.proof.tell(view.legend);
    this.note(picture, { ...view, w, h });
    this.draw();
    if (last && this.proofOf(this.rays.asked) !== null) this.pickAgain();
  }

  // The number of the proof that says something of `view`, null where none does or there is no view.
  proofOf(view) {
    return view && this.proof.told && this.valid && sameCamera(this.shown.view, view) ? this.shown.seq : null;
  }

  told(message) {
    const acts = {
      // Not after a cancel, which this may have crossed on the way.
      progress: ({ seq, done }) => seq === this.seq && this.progress.shown && this.progress.show(done),
      pick: (pick) => this.picked(pick),
      measure: (told) => this.measure.show(told),
      probe: (told) => this.pointed.show(told),
      legend: (legend) => this.sent.has(legend.seq) && (this.sent.get(legend.seq).legend = legend),
      proof: (proof) => this.sent.has(proof.seq) && (this.sent.get(proof.seq).legend = proof),
      refined: (told) => told.seq === this.seq && this.refined(told),
      scene: ({ id }) => {
        this.notices.clear("edited");
        this.showScene(id).catch((error) => this.cannotShow(id, error));
      },
      camera: ({ name, text }) => saveText(name, text),
      saved: (told) => this.changes.show(told),
      command: ({ text }) => copyText(text).then((copied) => this.notices.say(copied ? `Copied: ${text}` : text)),
      export: (told) => this.sharing.told(told),
      error: ({ message: text, stays }) => {
        for (const name of ["opening", "tracing"]) this.busy.end(name);
        if (stays) this.notices.clear("edited"); // what was wrong before
        this.notices.say(text, stays && "edited");
        if (!this.scene) return;
        this.panel.fields.file.value = this.scene.name; // the one that is still shown
        this.asked = null; // what could not be shown is not asked for again with the next scene
      },
    };
    acts[message.type]?.(message);
  }

  refined(told) {
    if (this.shown?.seq === told.seq) this.shown.samples = told.samples;
    this.readings.refined(told);
    this.pointed.refresh();
  }

  // The settings of the picture that is seen, which may have grown to more samples than are set.
  get seen() {
    const { settings } = this.panel;
    return this.finished ? { ...settings, samples: this.shown.samples } : settings;
  }

  cannotShow(id, error) {
    if (this.announced !== id || error.status === 404) return; // another has come or will, or the connection has gone
    this.busy.end("opening");
    this.notices.say(`The scene cannot be shown: ${error.message}`);
  }

  connected(open) {
    document.body.dataset.connected = String(open);
    if (open) {
      this.notices.clear("lost");
      // The server may be another one by now, which shows its own scene.
      const { name: file, server, hidden } = this.kept ?? this.before ?? { name: "", server: "", hidden: [] };
      this.connection.send({ type: "hello", file, server, hidden });
    } else {
      this.announced = null;
      this.sharing.lost();
      this.busy.end("opening");
      this.progress.show(null);
      this.notices.say("No connection to the renderer; trying again.", "lost");
    }
  }

  cancel() {
    if (!this.progress.shown) return;
    this.connection.send({ type: "cancel" });
    this.dirty = false; // nor is a change wanted that was waiting for the camera to rest
    this.sent.delete(this.seq);
    this.stopSaving();
    this.busy.end("tracing");
    this.progress.show(null);
    this.request();
    this.notices.say("Cancelled; the next movement starts it again.");
  }

  pickAt(clientX, clientY) {
    const asked = this.rays.pixel(this.view(), clientX, clientY);
    // A card over the picture stands on the other side of it.
    const { left, width } = find("#frame").getBoundingClientRect();
    find("main").classList.toggle("aside-left", clientX > left + width / 2);
    if (asked && !this.measure.take(asked)) this.connection.send(this.rays.ask(asked, this.panel.settings, this.proofOf(asked)));
  }

  // Ask for the same pixel by the settings and the proof as they are now.
  pickAgain() {
    const { asked } = this.rays;
    if (asked) this.connection.send(this.rays.ask(asked, this.panel.settings, this.proofOf(asked)));
  }

  picked(pick) {
    if (pick.seq !== this.rays.seq) return;
    this.hint.learnt();
    this.rays.show(pick, this.dressed);
    if (this.focusing === pick.seq) this.focusOn(pick);
  }

  // See the first ray of a pick from its side.
  seeAside({ path: [{ start, end }] }) {
    this.camera.seeAside(start, end, this.free);
    this.moved();
  }

  // The part of the picture beside the card, as `Camera.seeAside` takes it.
  get free() {
    const [frame, card] = ["#frame", "#card"].map((name) => find(name).getBoundingClientRect());
    const [left, right] = [Math.max(card.left, frame.left), Math.min(card.right, frame.right)];
    const over = card.top < frame.bottom && card.bottom > frame.top ? Math.max(right - left, 0) : 0;
    const hidden = over && over + Math.min(left - frame.left, frame.right - right); // with the gap at its side
    const side = left - frame.left < frame.right - right ? 1 : -1;
    return { x: (side * hidden) / 2 / frame.height, width: (frame.width - hidden) / frame.height };
  }

  // Turn about what was clicked last, once it is known what that is.
  focus(clientX, clientY) {
    if (!this.rays.pixel(this.view(), clientX, clientY)) return; // beside the picture nothing was clicked
    if (this.rays.pick?.seq === this.rays.seq) this.focusOn(this.rays.pick);
    else this.focusing = this.rays.seq;
  }

  focusOn({ hit, point }) {
    this.focusing = null;
    if (!hit) return;
    this.camera.focus(point);
    this.moved();
  }

  // Whether the traced picture of the newest view is still to come, or more of it.
  get coming() {
    return TRACED.includes(this.mode) && !this.finished && (this.dirty || this.sent.has(this.seq));
  }

  // Save what is seen; a traced picture once it is finished, if it will be.
  save() {
    if (!this.coming) return this.saveNow();
    this.saving = true;
    this.notices.say("The picture is saved when it is finished.", "saving");
  }

  saveNow() {
    this.stopSaving();
    this.notices.say(`Saved: ${savePicture(this.visibleLayers(), this.scene.name)}`);
  }

  stopSaving() {
    this.saving = false;
    this.notices.clear("saving");
  }

  // The canvases that are seen, lowest first.
  visibleLayers() {
    const traced = this.current || this.recent || !this.layer;
    return [...(traced ? [this.picture.canvas] : []), ...(this.layer ? [this.layer.canvas] : [])];
  }
}

// Reachable from the console, for the curious and for tests.
const viewer = (window.viewer = new Viewer());
viewer.start();
