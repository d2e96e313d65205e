// The axes of the scene in a corner of the picture: each end is a button that sees the scene from there.
import { dot, scale } from "./matrix.js";

const SVG = "http://www.w3.org/2000/svg";
// Of a square of a hundred: how long an arm is, and how wide a knob.
const ARM = 36;
const KNOB = 11;
const NAMES = ["X", "Y", "Z"];

function made(tag, attributes) {
  const element = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) element.setAttribute(name, value);
  return element;
}

export class Axes {
  // `look(direction)` is to see the scene from where the direction points.
  constructor(svg, look) {
    this.svg = svg;
    this.ends = [0, 1, 2].flatMap((axis) => [1, -1].map((sign) => this.end(axis, sign, look)));
  }

  end(axis, sign, look) {
    const direction = [0, 0, 0].map((_, k) => (k === axis ? sign : 0));
    const group = made("g", { class: `${"xyz"[axis]} ${sign < 0 ? "far" : ""}` });
    const [line, knob] = [made("line", {}), made("circle", { r: KNOB })];
    const label = made("text", { "text-anchor": "middle", "dominant-baseline": "central" });
    label.textContent = sign > 0 ? NAMES[axis] : "";
    group.append(...(sign > 0 ? [line] : []), knob, label);
    group.addEventListener("click", () => look(direction));
    const title = made("title", {});
    title.textContent = `From ${sign < 0 ? "−" : "+"}${NAMES[axis]}`;
    group.append(title);
    return { direction, group, line, knob, label };
  }

  // Draw them as `camera` sees them, the nearest last.
  show(camera) {
    const [right, up, back] = camera.frame();
    for (const { direction, line, knob, label } of this.ends) {
      const [x, y] = scale([dot(direction, right), -dot(direction, up), 0], ARM);
      for (const [element, names] of [[line, ["x2", "y2"]], [knob, ["cx", "cy"]], [label, ["x", "y"]]])
        [x, y].forEach((value, k) => element.setAttribute(names[k], value.toFixed(2)));
    }
    const nearness = ({ direction }) => dot(direction, back);
    this.svg.replaceChildren(...this.ends.toSorted((a, b) => nearness(a) - nearness(b)).map(({ group }) => group));
  }
}
