// The page: one camera, five modes, and the parts that show and change what is seen.
import { read } from "./address.js";
import { Axes } from "./axes.js";
import { Bookmarks } from "./bookmarks.js";
import { Busy } from "./busy.js";
import { Changes } from "./changes.js";
import { Connection } from "./connection.js";
import { Controls } from "./controls.js";
import { Drop } from "./drop.js";
import { film } from "./film.js";
import { Frames } from "./frames.js";
import { GlLayer } from "./gl.js";
import { Hint } from "./hint.js";
import { bindKeys, returnKeys } from "./keys.js";
import { Legend } from "./legend.js";
import { Measure } from "./measure.js";
import { Notices } from "./notices.js";
import { Objects } from "./objects.js";
import { Panel } from "./panel.js";
import { Past } from "./past.js";
import { Picking } from "./picking.js";
import { Picture } from "./picture.js";
import { Pointed } from "./pointed.js";
import { Progress } from "./progress.js";
import { Proof } from "./proof.js";
import { Readings } from "./readings.js";
import { copyText, saveText } from "./save.js";
import { Saving } from "./saving.js";
import { ScaleBar } from "./scalebar.js";
import { Scenes } from "./scenes.js";
import { Section } from "./section.js";
import { Sharing } from "./sharing.js";
import { SLOW, TRACED, Traced } from "./traced.js";

const TOO_LARGE = "What this page sends of the change is too large for the server; it is shown once it is smaller.";

// Radians below the horizon from which a floor is in the way.
const BELOW = 1.2;

const find = (selector) => document.querySelector(selector);

class Viewer {
  constructor() {
    Object.assign(this, { mode: "octree", scene: null, camera: null, size: null, stage: find("#stage") });
    this.traced = new Traced(this);
    this.frames = new Frames(this, find("#until"));
    this.scenes = new Scenes(this, find("#name"));
    this.picking = new Picking(this, find("#card"), find("#frame"));
    this.saving = new Saving(this);
    this.proof = new Proof({
      bar: find("#proof"), divider: find("#divider"), frame: find("#frame"), changed: () => this.picture?.paint(), asked: () => this.changed("pair"),
    });
    this.picture = new Picture(find("#picture"), this.proof);
    this.axes = new Axes(find("#axes"), (direction) => this.look(direction));
    this.scale = new ScaleBar(find("#scale"));
    this.legend = new Legend(find("#legend"));
    this.notices = new Notices(find("#notices"));
    this.progress = new Progress(find("#progress"));
    this.busy = new Busy(find("#busy"));
    this.measure = new Measure(this, { button: find("#measure"), card: find("#measured"), label: find("#distance") });
    this.pointed = new Pointed(this, find("#pointed"));
    this.readings = new Readings(find("#readings"), find("#hud"));
    this.panel = new Panel((name) => this.changed(name));
    this.objects = new Objects(find("#objects"), (names) => this.scenes.hideObjects(names));
    this.section = new Section(find("#section"), () => this.scenes.hide([...this.objects.hidden, ...this.section.chosen]));
    this.changes = new Changes(find("#changes"));
    this.hint = new Hint(find("#hint"));
    this.sharing = new Sharing(this, find("#share"));
    this.bookmarks = new Bookmarks(find("#views"), {
      seen: () => this.scenes.address, go: (address) => this.scenes.goTo(read(address)), say: (text) => this.notices.say(text),
    });
    this.past = new Past(() => this.scenes.address, find("#undo"), find("#redo"));
    try {
      this.layer = new GlLayer(find("#gl"), () => this.lostGl());
    } catch (error) {
      this.withoutGl(error.message);
    }
  }

  get rays() {
    return this.picking.rays;
  }

  start() {
    this.busy.begin("opening", "Opening the scene …");
    this.connection = new Connection({
      received: (picture) => this.sharing.received(picture) || this.traced.received(picture),
      told: (message) => this.told(message),
      changed: (open) => this.connected(open),
      refused: (too) => (too ? this.notices.say(TOO_LARGE, "large") : this.notices.clear("large")),
    });
    this.connection.open();
    this.scenes.begin();
  }

  // What works once there is a scene.
  begin() {
    if (this.controls) return;
    this.controls = new Controls(this.stage, find("#frame"), {
      camera: () => this.camera,
      moved: () => this.moved(),
      clicked: (x, y) => this.picking.at(x, y),
      focused: (x, y) => this.picking.focus(x, y),
    });
    bindKeys(this);
    returnKeys(this.stage);
    this.bindButtons();
    this.drop = new Drop(this, { button: find("#open-files"), input: find("#files"), target: find("#drop") });
    new ResizeObserver(() => this.layout()).observe(this.stage);
    document.body.dataset.ready = "true";
  }

  offers(mode) {
    return mode !== undefined && !find(`[name=mode][value=${mode}]`).disabled;
  }

  // Whether the server shows the scene that the page has.
  get attended() {
    return this.connection.ready && this.scene !== null && this.scenes.announced === this.scene.id;
  }

  // The scene with the user's materials and lights, as WebGL and cards show it.
  dress() {
    this.dressed = this.panel.edits.dressed;
    this.layer?.dress(this.dressed);
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
    this.frames.request();
  }

  bindButtons() {
    const onClick = (id, act) => find(id).addEventListener("click", act);
    const { panel, scenes, connection, traced } = this;
    find("#modes").addEventListener("change", ({ target }) => this.setMode(target.value));
    onClick("#reset-view", () => this.reset());
    onClick("#fit", () => this.fit());
    find("#sides").addEventListener("click", ({ target: { dataset: { side } } }) => side && this.look(this.camera.sides[side]));
    onClick("#keep-view", () => this.bookmarks.add());
    onClick("#cancel", () => (this.progress.shown ? this.cancel() : this.setMode(this.mode)));
    onClick("#reload", () => scenes.open(this.scene.name));
    onClick("#reset-light", () => panel.edits.turnSun(panel.edits.sunlight));
    onClick("#save-picture", () => this.saving.save());
    onClick("#save-camera", () => {
      const { m, fovy, height } = this.view();
      connection.send({ type: "camera", m, fovy, height, walk: this.controls.walking, settings: traced.settings });
    });
    onClick("#copy-command", () => connection.send({ type: "command", mode: this.mode, ...this.view(), settings: traced.settings }));
    onClick("#save-scene", () => {
      const { m, fovy, height } = this.view();
      connection.send({ type: "save", m, fovy, height, settings: panel.settings });
    });
    onClick("#show-boxes", () => panel.fields.boxes.click());
  }

  // What a change of a setting asks for.
  changed(name) {
    const { fields } = this.panel;
    if (name === "file") this.scenes.open(fields.file.value);
    else if (name === "boxes" || name === "level") {
      if (name === "level") fields.boxes.checked = true;
      this.scenes.tryBoxes();
    } else if (name === "walk") this.controls.walking = fields.walk.checked;
    else if (name === "size") this.layout();
    else if (name === "projection" || name === "focal") {
      if (name === "focal") this.camera.focal = 10 ** fields.focal.value;
      else this.camera.orthographic = fields.projection.value === "orthographic";
      this.moved();
    } else {
      if (name === "edits") this.dress();
      this.moved();
      this.picking.again();
    }
  }

  setMode(mode) {
    const input = find(`[name=mode][value=${mode}]`);
    if (input.disabled) return this.notices.say(`${input.parentElement.textContent.slice(1)}: ${input.parentElement.title}`);
    if (mode !== this.mode || !SLOW.includes(mode)) this.progress.show(null);
    find("#proof").hidden = mode !== "proof";
    if (mode !== "proof") this.proof.forget();
    if (!TRACED.includes(mode)) {
      this.saving.stop();
      this.busy.end("tracing");
      this.scenes.loadMesh();
    }
    input.checked = true;
    this.mode = mode;
    this.panel.setMode(mode);
    find("#hud").textContent = "";
    this.traced.begin();
    this.past.keep();
    this.frames.request();
  }

  reset() {
    this.camera.reset();
    this.moved();
  }

  fit() {
    this.camera.fit(this.size.w / this.size.h, this.objects.fitted(this.scene.bounds));
    this.moved();
  }

  look(direction) {
    this.camera.lookFrom(direction);
    this.moved();
    const floor = this.scene.objects.some(({ name, shown }) => name === "floor" && shown);
    if (floor && this.camera.pitch < -BELOW) this.notices.say("The floor hides what stands on it; its switch under Objects hides the floor.");
  }

  moved() {
    this.traced.moved();
    if (this.proof.told && !this.traced.valid) this.proof.forget();
    this.panel.showCamera(this.camera);
    this.axes.show(this.camera);
    this.scale.show(this.camera, this.frameHeight);
    this.past.keep();
    this.frames.request();
  }

  // Fit frame and layers into the stage, by the chosen resolution.
  layout() {
    const room = [Math.max(this.stage.clientWidth, 1), Math.max(this.stage.clientHeight, 1)];
    const { css, size } = film(room, this.panel.fields.size.value, this.scene.render.resolution, devicePixelRatio);
    this.size = size;
    this.frameHeight = css[1];
    const { style } = find("#frame");
    [style.width, style.height] = css.map((side) => `${side}px`);
    this.layer?.resize(...css);
    this.moved();
  }

  view() {
    const { fovy, height } = this.camera;
    return { m: this.camera.matrix(), fovy, ...(height === null ? {} : { height }), ...this.size };
  }

  told(message) {
    const { traced, scenes, notices } = this;
    const acts = {
      // Not after a cancel, which this may have crossed on the way.
      progress: ({ seq, done }) => seq === traced.seq && this.progress.shown && this.progress.show(done),
      pick: (pick) => this.picking.picked(pick),
      measure: (told) => this.measure.show(told),
      probe: (told) => this.pointed.show(told),
      legend: (legend) => traced.explain(legend),
      proof: (proof) => traced.explain(proof),
      refined: (told) => traced.refined(told),
      scene: ({ id }) => {
        notices.clear("edited");
        scenes.show(id).catch((error) => scenes.cannotShow(id, error));
      },
      camera: ({ name, text }) => saveText(name, text),
      saved: (told) => this.changes.show(told),
      command: ({ text }) => copyText(text).then((copied) => notices.say(copied ? `Copied: ${text}` : text)),
      export: (told) => this.sharing.told(told),
      error: ({ message: text, stays }) => {
        for (const name of ["opening", "tracing"]) this.busy.end(name);
        if (stays) notices.clear("edited"); // what was wrong before
        notices.say(text, stays && "edited");
        scenes.refused();
      },
    };
    acts[message.type]?.(message);
  }

  connected(open) {
    document.body.dataset.connected = String(open);
    if (open) {
      this.notices.clear("lost");
      this.connection.send(this.scenes.hello);
    } else {
      this.scenes.announced = null;
      this.sharing.lost();
      this.busy.end("opening");
      this.progress.show(null);
      this.notices.say("No connection to the renderer; trying again.", "lost");
    }
  }

  cancel() {
    if (!this.progress.shown) return;
    this.connection.send({ type: "cancel" });
    this.traced.cancel();
    this.saving.stop();
    this.busy.end("tracing");
    this.progress.stop();
    this.frames.request();
  }
}

// Reachable from the console, for the curious and for tests.
const viewer = (window.viewer = new Viewer());
viewer.start();
