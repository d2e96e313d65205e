// The scale of a picture's colours: a bar with the values at its ends.
import { element } from "./element.js";
import { count } from "./readings.js";

const NAMES = {
  depth: "depth, scene units", cost: "rays of a pixel", nodes: "nodes visited by the camera ray",
  triangles: "triangles tested by the camera ray", difference: "largest difference of a pixel's values",
};
const WHOLE = ["cost", "nodes", "triangles"];

const value = (aov, x) => (WHOLE.includes(aov) ? count(x) : aov === "difference" ? x.toExponential(1) : x.toPrecision(4));

export class Legend {
  constructor(box) {
    Object.assign(this, { box, told: undefined });
  }

  // Show the scale that the server told of; null for none.
  show(told) {
    if (told === this.told) return;
    this.told = told;
    this.box.hidden = told === null;
    if (told === null) return;
    const { aov, low, high, colors } = told;
    const bar = element("i", { className: "scale" });
    bar.style.background = `linear-gradient(to right, ${colors.map((c) => `rgb(${c.join(" ")})`).join(", ")})`;
    const same = aov === "difference" ? [element("span", {}, element("i", { className: "swatch none" }), "identical")] : [];
    const ends = element("div", { className: "ends" }, element("span", {}, value(aov, low)), ...same, element("span", {}, WHOLE.includes(aov) ? `${value(aov, high)} or more` : value(aov, high)));
    this.box.replaceChildren(element("b", { textContent: NAMES[aov] }), bar, ends);
  }
}
