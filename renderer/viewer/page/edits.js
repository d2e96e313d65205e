// Materials, lights and surroundings as the user changes them: their lists in the panel, and what differs from the file.
import { button, element, swatch } from "./element.js";
import { numberField, pickerColor, vectorField } from "./fields.js";
import { MAX_LIGHTS } from "./model.js";
import { Surroundings } from "./surroundings.js";
import { COLOR, LIMITS, NUMBER, VECTOR, copy, fits, same } from "./values.js";

// The fields of each type in the order in which they are shown, with their kind and what a new one has.
const MATERIALS = {
  phong: { diffuse: [COLOR, [0.8, 0.8, 0.8]], ambient: [COLOR, null], specular: [COLOR, [0, 0, 0]], shininess: [NUMBER, 32],
    reflectance: [COLOR, [0, 0, 0]], transmittance: [COLOR, [0, 0, 0]], ior: [NUMBER, 1.5] },
  mirror: { reflectance: [COLOR, [1, 1, 1]] },
  dielectric: { ior: [NUMBER, 1.5], reflectance: [COLOR, [1, 1, 1]], transmittance: [COLOR, [1, 1, 1]] },
};
const LIGHTS = {
  directional: { direction: [VECTOR, [-0.5, -1, -0.5]], irradiance: [COLOR, [0.5, 0.5, 0.5]] },
  point: { position: [VECTOR, null], intensity: [COLOR, null] },
};
const BLACK = [0, 0, 0];
// By which colour a material is known.
const CHIEF = { phong: "diffuse", mirror: "reflectance", dielectric: "transmittance" };

// Whether fields from an address are those of one of `types`, and of values that the server takes.
function isOneOf(types, fields) {
  if (!Object.hasOwn(types, fields?.type)) return false;
  const { type, ...given } = fields;
  return fits(given, types[type]);
}

const shines = (light) => light.type === "directional" && light.irradiance.some((x) => x > 0);

const lightFields = (light) => {
  const [place, color] = light.type === "directional" ? ["direction", "irradiance"] : ["position", "intensity"];
  return { type: light.type, [place]: light[place], [color]: light.color };
};

export class Edits {
  // `changed()` is called after each change.
  constructor({ materials, lights, around, changed }) {
    this.lists = { materials, lights };
    this.changed = () => {
      this.summarise();
      changed();
    };
    this.around = new Surroundings(around, () => {
      this.showLights(); // of which the preview draws fewer under a sky
      this.changed();
    });
    for (const list of [materials, lights]) list.addEventListener("input", (event) => event.stopPropagation());
  }

  // Begin with what the scene's file has.
  load(scene) {
    this.scene = scene;
    this.own = { materials: Object.fromEntries(scene.materials.map((m) => [m.name, m.fields])), lights: scene.lights.map(lightFields) };
    this.now = copy(this.own);
    this.left = new Map(); // of each material, by its name and a type, the fields that were left
    this.around.load(scene);
    this.show();
  }

  // The first directional light that shines, which sliders turn; undefined where there is none.
  get sun() {
    return this.now.lights.find(shines);
  }

  // Its direction in the file; undefined where that has none.
  get sunlight() {
    return this.own.lights[this.now.lights.indexOf(this.sun)]?.direction;
  }

  turnSun(direction) {
    this.sun.direction = [...direction];
    this.showLights();
    this.changed();
  }

  // What differs from the file, as the server reads it; null where nothing does.
  get value() {
    const materials = Object.entries(this.now.materials).filter(([name, fields]) => !same(fields, this.own.materials[name]));
    const lights = same(this.now.lights, this.own.lights) ? {} : { lights: this.now.lights };
    const around = this.around.value;
    return materials.length || lights.lights || around ? { materials: Object.fromEntries(materials), ...lights, ...around } : null;
  }

  // Take edits over, as far as this scene has what they are of.
  set value(given) {
    for (const [name, fields] of Object.entries(given?.materials ?? {}))
      if (Object.hasOwn(this.own.materials, name) && isOneOf(MATERIALS, fields)) this.now.materials[name] = copy(fields);
    if (Array.isArray(given?.lights) && given.lights.every((light) => isOneOf(LIGHTS, light))) this.now.lights = copy(given.lights);
    this.around.value = given ?? {};
    this.show();
  }

  // The names and fields of the materials in the order of the scene, by which faces have them; the keys of an object
  // that look like integers are in another one.
  get named() {
    return this.scene.materials.map(({ name }) => [name, this.now.materials[name]]);
  }

  // The entry of a material in the list.
  entryOf(name) {
    return [...this.lists.materials.children].find((entry) => entry.dataset.name === name);
  }

  // The scene with all this, as WebGL draws it.
  get dressed() {
    const materials = this.named.map(([name, fields], i) => ({ name, diffuse: BLACK, specular: BLACK,
      reflectance: BLACK, transmittance: BLACK, shininess: 0, ...fields, fields,
      emission: fields.type === "phong" ? this.scene.materials[i].emission : BLACK }));
    const lights = this.now.lights.map((fields) => ({ ...fields, color: fields.irradiance ?? fields.intensity }));
    return { ...this.scene, ...this.around.dressed, materials, lights: [...lights, ...this.around.skylights] };
  }

  show() {
    const { materials } = this.lists;
    const open = new Set([...materials.querySelectorAll("details[open]")].map((entry) => entry.dataset.name));
    materials.replaceChildren(...this.named.map(([name]) => this.material(name, open.has(name))));
    this.showLights();
    this.summarise();
  }

  // The lights, those open that were and the one that is `added`.
  showLights(added) {
    const before = this.entries ?? new Map();
    const { lights } = this.now;
    this.entries = new Map(lights.map((fields, i) => [fields, this.light(fields, i, fields === added || before.get(fields)?.open)]));
    const add = (type) => button(`Add ${type} light`, () => this.addLight(type));
    const dark = lights.length - (MAX_LIGHTS - this.around.skylights.length);
    const note = element("p", { className: "note", hidden: dark <= 0, textContent: `Preview draws the first ${lights.length - dark} of these.` });
    this.lists.lights.replaceChildren(...this.entries.values(), note, element("div", { className: "buttons" }, add("directional"), add("point")));
  }

  // The dots of materials and lights in their colours, and which of the materials are changed.
  summarise() {
    const entries = this.lists.materials.querySelectorAll("details");
    this.named.forEach(([name, fields], i) => {
      const changed = !same(fields, this.own.materials[name]);
      entries[i].querySelector(".swatch").style.background = pickerColor(fields[CHIEF[fields.type]] ?? BLACK);
      entries[i].querySelector("summary output").textContent = changed ? `${fields.type}, changed` : fields.type;
      entries[i].querySelector(".undo").disabled = !changed;
    });
    this.lists.lights.querySelectorAll("details").forEach((entry, i) => {
      const { irradiance, intensity } = this.now.lights[i];
      entry.querySelector(".swatch").style.background = pickerColor(irradiance ?? intensity);
    });
  }

  entry(title, type, name, open, ...children) {
    const summary = element("summary", {}, swatch("#000"), element("span", { textContent: title }), element("output", { textContent: type }));
    const made = element("details", { className: "entry", open }, summary, ...children);
    made.dataset.name = name;
    return made;
  }

  // A control for each field of `types` that is there.
  controls(fields, types) {
    return Object.entries(types[fields.type]).filter(([name]) => fields[name] !== undefined).map(([name, [kind]]) => {
      const set = (value) => {
        fields[name] = value;
        this.changed();
      };
      if (kind === NUMBER) return numberField(name, fields[name], LIMITS[name], set);
      return vectorField(name, fields[name], { isColor: kind === COLOR, isDirection: name === "direction" }, set);
    });
  }

  material(name, open) {
    const fields = this.now.materials[name];
    const put = (next) => {
      this.now.materials[name] = next;
      this.show();
      this.changed();
    };
    const type = element("select", { ariaLabel: `Type of ${name}` });
    type.append(...Object.keys(MATERIALS).map((value) => element("option", { value, textContent: value, selected: value === fields.type })));
    type.addEventListener("change", () => {
      const key = (of) => JSON.stringify([name, of]);
      this.left.set(key(fields.type), fields);
      put(this.left.get(key(type.value)) ?? this.fresh(type.value));
    });
    const undo = button("As in the file", () => put(copy(this.own.materials[name])), { className: "undo" });
    return this.entry(name, fields.type, name, open, element("label", { className: "row" }, element("span", { textContent: "type" }), type),
      ...this.controls(fields, MATERIALS), undo);
  }

  // A new material of a type.
  fresh(type) {
    const fields = Object.entries(MATERIALS[type]).map(([name, [, usual]]) => [name, copy(usual)]);
    return { type, ...Object.fromEntries(fields.filter(([, value]) => value !== null)) };
  }

  light(fields, i, open = false) {
    const remove = button("Remove", () => this.putLights(this.now.lights.filter((light) => light !== fields)));
    return this.entry(`Light ${i + 1}`, fields.type, i, open, ...this.controls(fields, LIGHTS), remove);
  }

  // A point light begins above the scene, as bright in its middle as a directional one.
  addLight(type) {
    const [lower, upper] = this.scene.bounds;
    const size = Math.hypot(...upper.map((x, k) => x - lower[k]));
    const middle = upper.map((x, k) => (x + lower[k]) / 2);
    const point = { position: [middle[0], upper[1] + 0.5 * size, middle[2]], intensity: [1, 1, 1].map(() => 0.5 * size * size) };
    const { direction, irradiance } = LIGHTS.directional;
    const added = type === "point" ? point : { direction: [...direction[1]], irradiance: [...irradiance[1]] };
    const light = { type, ...added };
    this.putLights([...this.now.lights, light], light);
  }

  putLights(lights, added) {
    this.now.lights = lights;
    this.showLights(added);
    this.changed();
  }
}
