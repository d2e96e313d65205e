// The scene that the page shows: taken over from the server, with its mesh and boxes, and the address of its view.
import { read, written } from "./address.js";
import { Camera } from "./camera.js";
import { fetchFrom } from "./connection.js";
import { heading } from "./element.js";
import { continues, kept, remember, remembered, stays } from "./memory.js";
import { fetchBoxes } from "./nodes.js";
import { HIDDEN } from "./objectcard.js";
import { NO_BOXES } from "./overlay.js";
import { isSide } from "./section.js";
import { TRACED } from "./traced.js";

// A mesh of more faces, some 70 MB, is fetched only once WebGL is to draw it.
const MANY_FACES = 1e6;

export class Scenes {
  constructor(viewer, name) {
    // The id of the scene that the server shows here, and the scene whose mesh is fetched.
    Object.assign(this, { viewer, name, announced: null, meshOf: null, asked: null, before: null, boxes: NO_BOXES });
  }

  // A page that is loaded again goes on from where it was; another address says where to begin.
  begin() {
    const { viewer } = this;
    addEventListener("pagehide", () => viewer.scene && remember({ ...this.kept, hash: location.hash }));
    // The address in the bar may be the page's own again by now.
    addEventListener("hashchange", ({ newURL }) => {
      if (!viewer.scene) return;
      viewer.past.arrive();
      this.goTo(read(new URL(newURL).hash));
    });
    const before = remembered();
    const [{ type }] = performance.getEntriesByType("navigation");
    if (type === "navigate" && location.hash && location.hash !== before?.hash) this.asked = read(location.hash);
    else this.before = before;
  }

  // The server shows the scene with that id here; one that the page has not is taken over, all at once.
  async show(id) {
    const { viewer } = this;
    this.announced = id;
    if (viewer.scene?.id !== id) {
      const scene = await (await fetchFrom("scene", { id })).json();
      if (this.announced !== id) return;
      this.take(scene);
    }
    viewer.busy.end("opening");
    viewer.traced.dirty = true;
    viewer.frames.request();
  }

  cannotShow(id, error) {
    if (this.announced !== id || error.status === 404) return; // another has come or will, or the connection has gone
    this.viewer.busy.end("opening");
    this.viewer.notices.say(`The scene cannot be shown: ${error.message}`);
  }

  take(scene) {
    const { viewer } = this;
    const { panel } = viewer;
    const before = this.kept ?? this.before;
    this.before = null;
    const asked = continues(before, scene) ? viewer.picking.asked : null; // whose card is asked for again
    viewer.scene = scene;
    viewer.camera = new Camera(scene);
    if (stays(before, scene)) viewer.camera.state = before.camera;
    viewer.proof.offer(scene.references);
    panel.load(scene);
    if (stays(before, scene) || continues(before, scene)) panel.chosen = before.chosen;
    viewer.objects.load(scene);
    viewer.section.load(scene);
    viewer.bookmarks.load(scene);
    viewer.dress();
    this.forget();
    viewer.readings.ofScene(scene);
    Object.assign(this.name, heading(scene.name));
    document.title = `${scene.name} · octree-render`;
    viewer.begin();
    viewer.layout();
    viewer.setMode(viewer.offers(before?.mode) ? before.mode : viewer.mode);
    if (this.asked) this.goTo(this.asked);
    if (asked) viewer.picking.ask(asked);
    if (TRACED.includes(viewer.mode)) viewer.busy.begin("tracing", "Tracing the first picture …");
    if (scene.faces <= MANY_FACES) this.loadMesh();
    this.tryBoxes();
    if (!this.asked) viewer.past.write(); // what is changed next is a step of its own
  }

  // Nothing of the scene before is shown any more, nor taken when it comes.
  forget() {
    const { viewer } = this;
    Object.assign(this, { boxes: NO_BOXES, meshOf: null });
    viewer.traced.forget();
    viewer.rays.close();
    viewer.measure.forget();
    viewer.picture.clear();
    viewer.proof.forget();
    viewer.legend.show(null);
    viewer.layer?.begin(viewer.dressed);
    viewer.saving.give();
    for (const name of ["mesh", "tracing", "finer"]) viewer.busy.end(name);
  }

  // What there is to come back to; null before there is a scene.
  get kept() {
    const { scene, camera, panel, mode } = this.viewer;
    return scene && { ...kept(scene, camera), chosen: panel.chosen, mode, hidden: this.hidden };
  }

  // The names of objects that are hidden, and the sides of planes.
  get hidden() {
    return [...this.viewer.objects.hidden, ...this.viewer.section.hidden];
  }

  // What a connection that opens says of this page. The server may be another one by now, which shows its own scene.
  get hello() {
    const { name: file, server, hidden } = this.kept ?? this.before ?? { name: "", server: "", hidden: [] };
    return { type: "hello", file, server, hidden };
  }

  // The address of the view.
  get address() {
    const { scene, mode, camera, panel } = this.viewer;
    return written({ file: scene.name, mode, state: camera.state, chosen: panel.chosen, hidden: this.hidden });
  }

  // Show the view of an address: of a scene that is not shown, once it is.
  goTo(asked) {
    const { viewer } = this;
    const { scene, panel } = viewer;
    this.asked = null;
    const { file, mode, state, hidden, chosen } = asked;
    if (file && file !== scene.name && scene.files.includes(file)) {
      this.open(file);
      this.asked = asked;
      return;
    }
    if (hidden !== null && this.hides(hidden)) {
      this.hide(hidden);
      this.asked = { ...asked, hidden: null }; // asked for once, whatever the answer is
      return;
    }
    panel.load(scene);
    panel.restart();
    panel.chosen = chosen;
    if (state) viewer.camera.state = state;
    viewer.changed("edits");
    viewer.layout();
    viewer.setMode(viewer.offers(mode) ? mode : viewer.mode);
  }

  // Whether other objects or another side of a plane are hidden than `names`.
  hides(names) {
    const { objects, section } = this.viewer;
    return objects.differ(names.filter((name) => !isSide(name))) || section.differs(names.filter(isSide));
  }

  open(file) {
    this.asked = null;
    this.viewer.busy.begin("opening", `Opening ${file} …`);
    this.viewer.connection.send({ type: "scene", file });
  }

  hide(hidden) {
    this.asked = null;
    this.viewer.notices.withdraw(HIDDEN);
    this.viewer.busy.begin("opening", "Building the octree …");
    this.viewer.connection.send({ type: "hide", hidden });
  }

  // Hide these objects and no others; a section stays.
  hideObjects(names) {
    this.hide([...names, ...this.viewer.section.hidden]);
  }

  // What could not be shown is not asked for again with the next scene; of an address all else is.
  refused() {
    const { scene, panel, objects, section } = this.viewer;
    if (!scene) return;
    panel.fields.file.value = scene.name; // the one that is still shown
    objects.load(scene);
    section.load(scene);
    const { asked } = this;
    this.asked = null;
    if (asked?.hidden === null) this.goTo(asked);
  }

  async loadMesh() {
    const { viewer } = this;
    const { scene } = viewer;
    if (!viewer.layer || this.meshOf === scene) return;
    this.meshOf = scene;
    viewer.busy.begin("mesh", "Loading the model for WebGL …");
    try {
      const mesh = await (await fetchFrom("mesh", { id: scene.id })).arrayBuffer();
      if (viewer.scene !== scene || !viewer.layer) return;
      viewer.layer.load(mesh);
      viewer.traced.dirty ||= viewer.mode === "phong"; // whose colours had no faces before
      viewer.frames.request();
    } catch (error) {
      if (viewer.scene !== scene) return;
      this.meshOf = null; // so that the next change of mode tries again
      if (error.status !== 404) viewer.notices.say(`The model cannot be shown: ${error.message}`);
    } finally {
      if (viewer.scene === scene) viewer.busy.end("mesh");
    }
  }

  async loadBoxes() {
    const { viewer } = this;
    const { scene, layer } = viewer;
    const { boxes, level } = viewer.panel.fields;
    this.boxes = NO_BOXES;
    if (boxes.checked && layer && !boxes.disabled) {
      this.loadMesh();
      const wanted = level.value;
      const fetched = await fetchBoxes(scene.id, Number(wanted), layer.mostBoxes);
      if (wanted !== level.value || !boxes.checked || viewer.scene !== scene) return;
      this.boxes = fetched;
      viewer.panel.showBoxes(fetched);
    }
    viewer.frames.request();
  }

  tryBoxes() {
    const { scene, notices } = this.viewer;
    this.loadBoxes().catch((error) => this.viewer.scene === scene && error.status !== 404 && notices.say(error.message));
  }
}
