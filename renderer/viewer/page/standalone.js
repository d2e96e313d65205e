// The page of a file that the viewer saved: its picture, and the model to be turned, without a server.
import { decoded } from "./base64.js";
import { Camera } from "./camera.js";
import { showCard } from "./card.js";
import { Controls, isForStage, isShortcut } from "./controls.js";
import { GlLayer } from "./gl.js";
import { drawing } from "./layers.js";
import { DEPTH, LIT } from "./model.js";
import { NO_BOXES, NO_RAYS, levelBoxes, pathLines, visitedLines } from "./overlay.js";

const find = (selector) => document.querySelector(selector);
const bytesOf = (id) => decoded(find(id).textContent);

class Standalone {
  constructor(known) {
    Object.assign(this, { known, boxes: NO_BOXES, rays: NO_RAYS, showNodes: true });
    this.stage = find("#stage");
    this.fields = { boxes: find("#boxes"), rays: find("#rays") };
    this.shows = Object.fromEntries([...document.querySelectorAll("[name=shows]")].map((field) => [field.value, field]));
    this.camera = new Camera(known.scene);
    this.camera.state = known.camera;
    this.say(known.note);
    try {
      this.loadLayer();
    } catch (error) {
      this.withoutGl(error.message);
    }
    this.bind();
    this.offer();
  }

  loadLayer() {
    this.layer = new GlLayer(find("#gl"), () => this.withoutGl("the browser took it away"));
    this.layer.begin(this.known.scene);
    this.layer.gain = this.known.gain;
    const mesh = bytesOf("#mesh");
    if (mesh.length) this.layer.load(mesh.buffer);
    this.boxes = levelBoxes(new Float32Array(bytesOf("#corners").buffer), this.known.boxes, this.layer.mostBoxes);
    if (this.known.pick) this.rays = { path: pathLines(this.known.pick), visited: visitedLines(this.known.pick) };
  }

  withoutGl(reason) {
    this.layer = null;
    find("#gl").hidden = true;
    this.say(`The model, boxes and rays need WebGL2: ${reason}.`);
    if (this.controls) this.offer(); // not before all else is there
  }

  say(text) {
    find("#note").textContent = text;
  }

  // What the file has, switched on; what it lacks, disabled.
  offer() {
    const has = { boxes: this.layer && this.boxes.count, rays: this.layer && this.known.pick };
    for (const [name, field] of Object.entries(this.fields)) {
      field.disabled = !has[name];
      field.checked = Boolean(has[name]);
    }
    this.shows.model.disabled = !this.layer?.loaded;
    for (const id of ["#reset", "#fit"]) find(id).disabled = !this.layer?.loaded;
    this.show("picture");
  }

  bind() {
    this.controls = new Controls(this.stage, find("#frame"), {
      camera: () => this.camera,
      moved: () => this.show("model"),
      clicked: () => {},
      focused: () => {},
    });
    find("#shows").addEventListener("change", ({ target }) => this.show(target.value));
    for (const field of Object.values(this.fields)) field.addEventListener("change", () => this.request());
    find("#reset").addEventListener("click", () => this.reset());
    find("#fit").addEventListener("click", () => this.fit());
    document.addEventListener("keydown", (event) => this.key(event));
    new ResizeObserver(() => this.layout()).observe(this.stage);
    document.body.dataset.ready = "true";
  }

  key(event) {
    const act = { 1: () => this.show("picture"), 2: () => this.show("model"), r: () => this.reset(), f: () => this.fit(),
      b: () => this.fields.boxes.click() }[event.key.toLowerCase()];
    if (!act || event.ctrlKey || event.metaKey || event.altKey) return;
    if (!isForStage(event, this.stage) && !isShortcut(event)) return;
    event.preventDefault();
    act();
  }

  // Show the picture or the model, if it can be shown.
  show(what) {
    const field = this.shows[what];
    if (!field.disabled) field.checked = true;
    this.request();
  }

  // The camera of the picture again, and the picture itself.
  reset() {
    this.camera.state = this.known.camera;
    this.show("picture");
  }

  fit() {
    const { w, h } = this.known.view;
    this.camera.fit(w / h);
    this.show("model");
  }

  // As large as there is room in the picture's shape, of which the model is seen too, so that nothing jumps.
  layout() {
    const { w, h } = this.known.view;
    const share = Math.min(this.stage.clientWidth / w, this.stage.clientHeight / h);
    const css = [w, h].map((side) => Math.max(Math.round(side * share), 1));
    const { style } = find("#frame");
    [style.width, style.height] = css.map((side) => `${side}px`);
    this.layer?.resize(...css);
    this.request();
  }

  request() {
    this.pending ??= requestAnimationFrame((now) => {
      this.pending = null;
      const seconds = Math.min((now - (this.before ?? now)) / 1000, 0.1);
      const moving = this.controls.advance(seconds);
      this.before = moving ? now : null;
      this.draw();
      if (moving) this.request();
    });
  }

  draw() {
    const { known } = this;
    const { w, h } = known.view;
    const picture = this.shows.picture.checked;
    find("#picture").classList.toggle("away", !picture);
    this.stage.dataset.shows = picture ? "picture" : "model";
    const faces = `${known.scene.faces.toLocaleString("en")} faces`;
    find("#hud").textContent = picture ? `${known.mode} · ${w} × ${h}` : `WebGL · ${faces}`;
    this.showCard();
    if (!this.layer) return;
    const { fovy, height } = this.camera;
    const view = picture ? known.view : { m: this.camera.matrix(), fovy, height, w, h };
    const boxes = this.fields.boxes.checked ? this.boxes : NO_BOXES;
    const rays = this.fields.rays.checked ? this.rays : NO_RAYS;
    const seen = { path: rays.path, visited: this.showNodes ? rays.visited : NO_RAYS.visited };
    this.layer.draw(view, drawing(picture ? DEPTH : LIT, boxes, seen));
  }

  // The card of the picked ray, as long as the ray is shown.
  showCard() {
    const card = find("#card");
    const { rays } = this.fields;
    if (!rays.checked) card.hidden = true;
    else if (card.hidden)
      showCard(card, this.known.pick, {
        object: this.known.object === null ? null : { label: this.known.object, buttons: [] },
        scene: this.known.scene,
        close: () => rays.click(),
        toggle: (shown) => {
          this.showNodes = shown;
          this.request();
        },
        chosen: (index) => {
          this.rays = { ...this.rays, path: pathLines(this.known.pick, index) };
          this.request();
        },
        shown: this.showNodes,
      });
  }
}

// Reachable from the console, for the curious and for tests.
window.standalone = new Standalone(JSON.parse(find("#known").textContent));
