// The panel: its form holds the settings, the rest shows what the scene is and how fast its pictures come.
import { Edits } from "./edits.js";
import { element } from "./element.js";
import { told as stops } from "./exposure.js";
import { Folds } from "./folds.js";
import { lowered, raised } from "./matrix.js";
import { levelColor } from "./overlay.js";
import { count } from "./readings.js";

// A pixel; the server allows no more.
const MAX_SAMPLES = 64;
const DEGREE = Math.PI / 180;
// What the user chooses of a scene's picture, beside its camera, materials and lights.
const CHOICES = ["size", "aov", "samples", "refine", "max_depth", "shadows", "reflection", "refraction", "pair", "exposure", "faces"];
// Those that are the page's and no scene's: they stay when a scene is loaded.
const STAYING = ["size", "aov", "refine", "pair", "faces"];

const usual = (list) => ([...list.options].find((option) => option.defaultSelected) ?? list.options[0]).value;

export class Panel {
  // `changed(name)` is called with the name of the field that the user moved.
  constructor(changed) {
    this.form = document.querySelector("#settings");
    this.fields = this.form.elements;
    this.folds = new Folds(document.querySelector("#panel"), document.querySelector("#toggle-panel"));
    const find = (id) => document.querySelector(id);
    this.edits = new Edits({ materials: find("#materials"), lights: find("#lights"), around: find("#around"), changed: () => {
      this.showLight();
      this.showValues();
      changed("edits");
    } });
    this.form.addEventListener("submit", (event) => event.preventDefault());
    const moved = ({ target }) => {
      if (target.name === "azimuth" || target.name === "elevation") return this.edits.turnSun(this.sliders);
      this.showValues();
      changed(target.name);
    };
    for (const part of [this.form, find("#bar")]) part.addEventListener("input", moved);
  }

  // Fill everything in from the server's /scene.
  load(scene) {
    this.scene = scene;
    const { fields } = this;
    fields.file.replaceChildren(...scene.files.map((f) => element("option", { value: f, textContent: f.replace(/\.toml$/, "") })));
    fields.file.value = scene.name;
    this.edits.load(scene);
    fields.max_depth.value = Math.min(scene.render.max_depth, fields.max_depth.max);
    this.offerSamples(scene.render.samples);
    fields.shadows.checked = scene.render.shadows;
    fields.reflection.checked = fields.refraction.checked = true;
    fields.exposure.value = 0;
    fields.level.max = Math.max(scene.octree.levels - 1, 0);
    // Some hundred boxes at most: enough to see, few enough to see through.
    fields.level.value = Math.min(3, fields.level.max);
    document.querySelector("#reload").disabled = !scene.files.length;
    this.offerBoxes(scene.octree.nodes > 0);
    this.showLight();
    this.showLevels(Math.max(scene.octree.levels, 1));
    this.showNeeds(scene.needs);
    this.own = { ...this.values, ...this.usual };
  }

  // The values that those of STAYING have at first.
  get usual() {
    return Object.fromEntries(STAYING.map((name) => [name, usual(this.fields[name])]));
  }

  // Begin anew with what `load` leaves as it is.
  restart() {
    for (const [name, value] of Object.entries(this.usual)) this.fields[name].value = value;
  }

  // The values of CHOICES as they are, as text.
  get values() {
    const text = (field) => String(field.type === "checkbox" ? field.checked : field.value);
    return Object.fromEntries(CHOICES.map((name) => [name, text(this.fields[name])]));
  }

  // What the user chose: the values that are not those of the scene or, at first, of the page; and edits as JSON.
  get chosen() {
    const { values } = this;
    const moved = CHOICES.filter((name) => values[name] !== this.own[name]);
    const edits = this.edits.value;
    return { ...Object.fromEntries(moved.map((name) => [name, values[name]])), ...(edits ? { edits: JSON.stringify(edits) } : {}) };
  }

  // Choose it again, as far as this scene and this page have it.
  set chosen(chosen) {
    try {
      if (chosen.edits) this.edits.value = JSON.parse(chosen.edits);
    } catch {
      // No edits, then.
    }
    for (const name of CHOICES) {
      const field = this.fields[name];
      if (chosen[name] === undefined) continue;
      if (field.type === "checkbox") field.checked = chosen[name] === "true";
      else if (field.type === "range" || [...field.options].some((option) => option.value === chosen[name])) field.value = chosen[name];
    }
    this.showLight();
    this.showValues();
  }

  // Boxes need nodes, and WebGL.
  offerBoxes(offered) {
    const { boxes, level } = this.fields;
    boxes.disabled = level.disabled = !offered || document.body.dataset.gl === "none";
    if (boxes.disabled) boxes.checked = false;
  }

  offerSamples(own) {
    const options = [...new Set([1, 4, 9, 16, Math.min(own, MAX_SAMPLES)])].sort((a, b) => a - b);
    this.fields.samples.replaceChildren(...options.map((n) => element("option", { textContent: n })));
    this.fields.samples.value = Math.min(own, MAX_SAMPLES);
  }

  // The sliders of the light where its direction is.
  showLight() {
    const { sun } = this.edits;
    document.querySelector("#light").disabled = !sun;
    if (!sun) return;
    const [x, y, z] = lowered(sun.direction, this.scene.up).map((v) => -v);
    this.fields.azimuth.value = Math.atan2(x, z) / DEGREE;
    this.fields.elevation.value = Math.atan2(y, Math.hypot(x, z)) / DEGREE;
  }

  // The direction in which light travels by the sliders.
  get sliders() {
    const [a, e] = [this.fields.azimuth.value * DEGREE, this.fields.elevation.value * DEGREE];
    return raised([-Math.cos(e) * Math.sin(a), -Math.sin(e), -Math.cos(e) * Math.cos(a)], this.scene.up);
  }

  // The settings of a view as the server reads them.
  get settings() {
    const { max_depth, samples, shadows, reflection, refraction, aov, refine, pair, exposure } = this.fields;
    // Raw pixels cost nothing on this machine; through a network a tenth of them is worth the loss.
    const local = ["localhost", "127.0.0.1", "[::1]"].includes(location.hostname);
    const edits = this.edits.value;
    return { ...(edits ? { edits } : {}), max_depth: Number(max_depth.value), samples: Number(samples.value), shadows: shadows.checked,
      reflection: reflection.checked, refraction: refraction.checked, aov: aov.value, refine: Number(refine.value), pair: pair.value, exposure: Number(exposure.value), pixels: local ? "rgba" : "jpeg" };
  }

  // The fields of the camera as it is.
  showCamera(camera) {
    const { projection, focal, focal_shown: told } = this.fields;
    projection.value = camera.orthographic ? "orthographic" : "perspective";
    focal.value = Math.log10(camera.focal);
    focal.disabled = camera.orthographic;
    const lens = `${camera.focal.toFixed(camera.focal < 100 ? 1 : 0)} mm`;
    told.value = camera.orthographic ? "–" : `${lens} · ${(camera.fovy / DEGREE).toFixed(1)}°`;
    this.folds.tell("camera", camera.orthographic ? "orthographic" : lens);
  }

  // What folded parts say of themselves.
  showFolded() {
    const { fields, folds, scene, edits } = this;
    if (!scene) return;
    const samples = Number(fields.samples.value);
    folds.tell("scene", scene.name.replace(/\.toml$/, ""));
    folds.tell("traced", `${samples} ${samples === 1 ? "sample" : "samples"}, ${fields.max_depth.value} bounces`);
    folds.tell("octree", fields.boxes.checked ? `level ${fields.level.value}` : `${scene.octree.levels} levels`);
    folds.tell("light", count(edits.now.lights.length));
    folds.tell("around", edits.around.told);
    const edited = Object.keys(edits.value?.materials ?? {}).length;
    folds.tell("materials", `${count(scene.materials.length)}${edited ? ", changed" : ""}`);
    const hidden = scene.objects.filter(({ shown }) => !shown).length;
    folds.tell("objects", hidden ? `${scene.objects.length - hidden} of ${scene.objects.length}` : count(scene.objects.length));
  }

  showValues() {
    const { fields } = this;
    this.showFolded();
    document.querySelector("#show-boxes").setAttribute("aria-pressed", String(fields.boxes.checked));
    document.querySelector("#show-boxes").disabled = fields.boxes.disabled;
    fields.max_depth_shown.value = fields.max_depth.value;
    fields.level_shown.value = fields.level.value;
    fields.exposure_shown.value = stops(fields.exposure.valueAsNumber);
    document.querySelectorAll("#levels i").forEach((bar, i) => bar.classList.toggle("chosen", i === Number(fields.level.value)));
    fields.azimuth_shown.value = `${Math.round(fields.azimuth.value)}°`;
    fields.elevation_shown.value = `${Math.round(fields.elevation.value)}°`;
    const { sun, sunlight } = this.edits;
    const moved = Boolean(sunlight) && String(sun.direction) !== String(sunlight);
    document.querySelector("#reset-light").disabled = !moved;
    const note = moved ? "Moved" : sunlight ? "As the scene has it" : "Added here";
    document.querySelector("#light-note").textContent = sun ? note : "This scene has no directional light";
  }

  showLevels(levels) {
    const bars = Array.from({ length: levels }, (_, level) => {
      const bar = element("i");
      bar.style.background = `rgb(${levelColor(level, levels).join(" ")})`;
      return bar;
    });
    document.querySelector("#levels").replaceChildren(...bars);
    this.showValues();
  }

  // How many boxes the chosen level has, and how many of them are shown.
  showBoxes({ count: shown, all }) {
    const some = shown < all ? `${count(shown)} of ` : "";
    this.fields.level_shown.value = `${this.fields.level.value} · ${some}${count(all)} ${all === 1 ? "node" : "nodes"}`;
  }

  showNeeds(needs) {
    const left = Object.entries(needs).filter(([, [value]]) => !value);
    const items = left.map(([name, [, reason]]) =>
      element("li", {}, element("b", { textContent: name.replaceAll("_", " ") }), ` ${reason}`));
    const all = element("li", { textContent: "Nothing: it needs everything that the renderer has." });
    document.querySelector("#needs ul").replaceChildren(...(items.length ? items : [all]));
  }

  // What does not apply to the mode is disabled, and says so.
  setMode(mode) {
    const traced = mode === "octree" || mode === "brute" || mode === "proof";
    document.querySelector("#traced").disabled = !traced;
    this.fields.samples.disabled = this.fields.refine.disabled = mode !== "octree"; // others have their own numbers
    this.fields.exposure.disabled = mode === "phong"; // whose colours come as they are
    this.fields.aov.disabled = !traced || mode === "proof"; // which compares colours
    this.fields.aov.hidden = mode === "gl";
    this.fields.faces.hidden = mode !== "gl";
    document.querySelector("#traced-note").hidden = traced;
  }
}
