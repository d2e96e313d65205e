// A plane across an axis, beyond which nothing is shown: the scene cut open.

const SIDE = /^([xyz]) *([<>]) *(.+)$/;
// Whether a hidden name means a side of a plane.
export const isSide = (name) => SIDE.test(name);
// Steps of the slider from one end of the scene to the other.
const STEPS = 1000;

export class Section {
  // `hide()` is called when another section is chosen.
  constructor(box, hide) {
    Object.assign(this, { box, hidden: [], sign: ">" });
    [this.axis, this.place, this.turn] = ["select", "input", "button"].map((tag) => box.querySelector(tag));
    this.output = box.querySelector("output");
    this.place.max = STEPS;
    box.addEventListener("input", (event) => event.stopPropagation());
    this.axis.addEventListener("change", () => {
      this.place.value = STEPS / 2;
      hide();
    });
    this.place.addEventListener("input", () => this.say(this.at));
    this.place.addEventListener("change", hide);
    this.turn.addEventListener("click", () => {
      this.sign = this.sign === ">" ? "<" : ">";
      hide();
    });
  }

  // What the server says of it: sides of planes that are hidden, and the bounds of the whole scene.
  load({ section: { hidden, bounds } }) {
    Object.assign(this, { hidden, bounds });
    const [, axis, sign, at] = SIDE.exec(hidden[0] ?? "") ?? [null, "", ">", "0"];
    this.axis.value = axis;
    this.sign = sign;
    for (const element of [this.place.parentElement, this.turn]) element.hidden = !axis;
    if (!axis) return;
    const [lower, upper] = this.ends;
    this.place.value = Math.round((STEPS * (Number(at) - lower)) / (upper - lower || 1));
    this.say(Number(at));
  }

  say(at) {
    this.output.value = `${this.axis.value} ${this.sign} ${at} hidden`;
  }

  // The ends of the scene along the axis.
  get ends() {
    return this.bounds.map((corner) => corner["xyz".indexOf(this.axis.value)]);
  }

  // Where the slider is, to a thousandth of the scene; at its ends, those of the scene.
  get at() {
    const [lower, upper] = this.ends, share = this.place.valueAsNumber / STEPS;
    if (share === 0 || share === 1) return share ? upper : lower;
    const step = (upper - lower) / STEPS;
    const digits = Math.max(0, Math.ceil(-Math.log10(step || 1)));
    return Number((lower + share * (upper - lower)).toFixed(Math.min(digits, 100)));
  }

  // What is to be hidden: of several sides, which an address may have, the first is chosen here.
  get chosen() {
    const first = this.axis.value ? [`${this.axis.value} ${this.sign} ${this.at}`] : [];
    return [...first, ...this.hidden.slice(1)];
  }

  // Whether `sides` are others than those that are hidden now.
  differs(sides) {
    return String(sides) !== String(this.hidden);
  }
}
