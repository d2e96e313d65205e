// What is around the scene, as the user changes it: ambient light, and a background or a sky in its place.
import { button, element } from "./element.js";
import { numberField, vectorField } from "./fields.js";
import { raised } from "./matrix.js";
import { skylights } from "./skylights.js";
import { COLOR, LIMITS, NUMBER, VECTOR, copy, fits, isColor, same } from "./values.js";

// The fields of a sky in the order of the server's, with their kind, their label, and what a new one has.
const SKY = {
  zenith: [COLOR, "Zenith", [0.35, 0.55, 0.9]], horizon: [COLOR, "Horizon", [0.85, 0.9, 0.95]], ground: [COLOR, "Ground"],
  lights: [NUMBER, "Lights of the sky", 32], sun: [VECTOR, "Direction of the sun's light"], sun_irradiance: [COLOR, "Light of the sun", [1, 1, 1]],
  sun_angle: [NUMBER, "Sun's radius, °", 8], sun_lights: [NUMBER, "Lights of the sun", 16],
};
const TINTS = ["zenith", "horizon", "ground"];
const OF_SUN = ["sun", "sun_irradiance", "sun_angle", "sun_lights"];
// The direction of a new sun's light with y up.
const DOWN = [-0.5, -1, -0.5];
// Of nothing no colour could be made again.
const STRENGTH = { least: 0.001 };
const BLACK = [0, 0, 0];

const fresh = () => Object.fromEntries(Object.entries(SKY).map(([name, [, , usual]]) => [name, usual]).filter(([, usual]) => usual !== undefined));
// A sky with another value of a field, undefined for none; in the order of SKY, by which skies are compared.
const altered = (sky, name, value) =>
  Object.fromEntries(Object.keys(SKY).map((key) => [key, key === name ? value : sky[key]]).filter(([, given]) => given !== undefined));

// The radiance of the brightest part of a sky.
const strength = (sky) => Math.max(...TINTS.flatMap((name) => sky[name] ?? []));

// A sky whose brightest part has that radiance, in the same colours.
function scaled(sky, to) {
  const from = strength(sky);
  const part = (x) => (from ? Number(((x * to) / from).toPrecision(4)) : to);
  if (from === to) return sky;
  return TINTS.filter((name) => sky[name]).reduce((made, name) => altered(made, name, sky[name].map(part)), sky);
}

export class Surroundings {
  // `changed()` is called after each change.
  constructor(section, changed) {
    this.changed = () => {
      this.undo.disabled = this.value === null;
      changed();
    };
    this.switches = {
      sky: this.switch("Sky", (on) => this.putSky(on ? this.left.sky : null)),
      ground: this.switch("Ground of its own", (on) => this.putPart("ground", on ? [...this.now.sky.horizon] : undefined)),
      sun: this.switch("Sun", (on) => this.putPart("sun", on ? this.left.sun : undefined)),
    };
    this.parts = Object.fromEntries(["ambient", "plain", "strength", "tints", "ground", "lights", "sun"].map((name) => [name, element("div")]));
    const undone = () => {
      this.now = copy(this.own);
      this.show();
      this.changed();
    };
    this.undo = button("As in the file", undone, { className: "undo" });
    const { ambient, plain, strength: strong, tints, ground, lights, sun } = this.parts, { switches } = this;
    this.ofSky = element("div", {}, strong, tints, switches.ground.row, ground, lights, switches.sun.row, sun);
    section.replaceChildren(ambient, switches.sky.row, plain, this.ofSky, this.undo);
    section.addEventListener("input", (event) => event.stopPropagation());
  }

  // Begin with what the scene's file has.
  load({ ambient, background, sky, up }) {
    this.up = up;
    this.own = { ambient, background, sky };
    this.now = copy(this.own);
    // What comes back when a switch is turned on again.
    this.left = { sky: sky ?? fresh(), sun: sky?.sun ?? raised(DOWN, up) };
    this.show();
  }

  // What differs from the file, as the server reads it; null where nothing does.
  get value() {
    const { own, now } = this;
    const light = same(now.ambient, own.ambient) ? {} : { ambient: now.ambient };
    const kept = same(now.sky, own.sky) && (now.sky !== null || same(now.background, own.background));
    const seen = kept ? {} : now.sky ? { sky: now.sky } : { background: now.background };
    return kept && same(now.ambient, own.ambient) ? null : { ...light, ...seen };
  }

  // Take edits over.
  set value({ ambient, background, sky }) {
    if (isColor(ambient)) this.now.ambient = [...ambient];
    if (fits(sky, SKY)) this.now.sky = altered(copy(sky));
    else if (isColor(background)) Object.assign(this.now, { background: [...background], sky: null });
    this.show();
  }

  get skylights() {
    return this.now.sky ? skylights(this.now.sky, this.up) : [];
  }

  // What WebGL draws of it.
  get dressed() {
    const { ambient, background, sky } = this.now;
    return { ambient, background: sky ? sky.horizon : background };
  }

  // What is said of it where it is folded.
  get told() {
    if (this.value) return "changed";
    return this.now.sky ? "sky" : "colour";
  }

  switch(label, act) {
    const input = element("input", { type: "checkbox" });
    input.setAttribute("role", "switch");
    input.addEventListener("change", () => act(input.checked));
    return { input, row: element("label", { className: "switch" }, element("span", { textContent: label }), input) };
  }

  putSky(sky) {
    if (this.now.sky) this.left.sky = this.now.sky;
    this.now.sky = sky;
    this.show();
    this.changed();
  }

  // Give the sky a part that it may lack, or take it away.
  putPart(name, value) {
    if (name === "sun" && !value) this.left.sun = this.now.sky.sun;
    this.now.sky = altered(this.now.sky, name, value);
    this.show();
    this.changed();
  }

  show() {
    const { parts, switches, now } = this, { sky } = now;
    const whole = (name, label) => vectorField(label, now[name], { isColor: true }, (value) => {
      now[name] = value;
      this.changed();
    });
    parts.ambient.replaceChildren(whole("ambient", "Ambient light"));
    parts.plain.replaceChildren(...(sky ? [] : [whole("background", "Background")]));
    switches.sky.input.checked = Boolean(sky);
    this.ofSky.hidden = !sky;
    this.undo.disabled = this.value === null;
    if (!sky) return;
    this.showStrength();
    this.showTints();
    const note = element("p", { className: "note", textContent: "Each costs a shadow ray. With 0 the sky lights nothing." });
    parts.lights.replaceChildren(this.field("lights"), note);
    switches.ground.input.checked = Boolean(sky.ground);
    switches.sun.input.checked = Boolean(sky.sun);
    parts.sun.replaceChildren(...(sky.sun ? OF_SUN.map((name) => this.field(name)) : []));
  }

  showStrength() {
    this.base = this.now.sky; // from which the others are scaled, so that they do not drift while it is typed
    this.parts.strength.replaceChildren(numberField("Strength", strength(this.base), STRENGTH, (to) => {
      const tints = scaled(this.base, to);
      this.now.sky = TINTS.reduce((sky, name) => altered(sky, name, tints[name]), this.now.sky);
      this.showTints();
      this.changed();
    }));
  }

  showTints() {
    const { tints, ground } = this.parts;
    tints.replaceChildren(this.field("zenith"), this.field("horizon"));
    ground.replaceChildren(...(this.now.sky.ground ? [this.field("ground")] : []));
  }

  // The control of a field of the sky.
  field(name) {
    const [kind, label] = SKY[name];
    const set = (value) => {
      this.now.sky = altered(this.now.sky, name, value);
      if (TINTS.includes(name)) this.showStrength();
      this.changed();
    };
    const value = this.now.sky[name];
    return kind === NUMBER ? numberField(label, value, LIMITS[name], set)
      : vectorField(label, value, { isColor: kind === COLOR, isDirection: kind === VECTOR }, set);
  }
}
