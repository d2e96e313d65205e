// The rays of a picked pixel, one below the other: what each is, what it weighs and brings, and what it met.
import { button, element, swatch } from "./element.js";
import { KINDS, shownKind } from "./overlay.js";

// More rows than anyone reads.
const MOST = 200;
const NAMES = { camera: "camera", reflected: "reflected", refracted: "refracted", shadow: "shadow", blocked: "shadow, blocked" };

const srgb = (x) => Math.round(255 * (x <= 0.0031308 ? 12.92 * x : 1.055 * Math.min(x, 1) ** (1 / 2.4) - 0.055));
const percent = (weight) => {
  const share = 100 * Math.max(...weight);
  return share === 0 || share >= 0.1 ? `${share.toFixed(share < 10 ? 1 : 0)} %` : "< 0.1 %";
};
const brings = (radiance) => `brings ${radiance.map((x) => x.toPrecision(4)).join("  ")}`;
const met = (segment) => (segment.face >= 0 ? `face ${segment.face}` : segment.kind === "shadow" ? "the light" : "nothing");

// The list, and steps through it; `chosen(index)` is called with the ray that is pointed at, or -1.
export function rayTree(path, chosen) {
  const list = element("ul", { className: "rays" });
  const shown = path.slice(0, MOST);
  const buttons = shown.map((segment, i) => row(segment, () => choose(i)));
  list.append(...buttons.map((button) => element("li", {}, button)));
  if (path.length > MOST) list.append(element("li", { className: "note", textContent: `and ${path.length - MOST} more` }));
  const told = element("output");
  let current = -1;
  function choose(index) {
    current = index;
    buttons.forEach((button, i) => (i === index ? button.setAttribute("aria-current", "true") : button.removeAttribute("aria-current")));
    buttons[index]?.scrollIntoView({ block: "nearest" });
    const segment = shown[index];
    told.value = segment ? `${index + 1} of ${path.length}: ${brings(segment.radiance)}` : `${path.length} ${path.length === 1 ? "ray" : "rays"}`;
    chosen(index);
  }
  const step = (by) => () => choose(Math.min(Math.max(current + by, 0), shown.length - 1));
  const back = button("‹", step(-1), { ariaLabel: "Previous ray" });
  const on = button("›", step(1), { ariaLabel: "Next ray" });
  list.addEventListener("pointerleave", () => !list.contains(document.activeElement) && choose(-1));
  choose(-1);
  return [element("div", { className: "steps" }, back, told, on), list];
}

function row(segment, choose) {
  const kind = shownKind(segment);
  const made = element("button", { type: "button" },
    swatch(`rgb(${KINDS[kind].join(" ")})`), element("span", {}, NAMES[kind]), element("span", { className: "note" }, met(segment)),
    element("span", { className: "weight" }, percent(segment.weight)), swatch(`rgb(${segment.radiance.map(srgb).join(" ")})`));
  made.style.paddingLeft = `${6 + 12 * Math.min(segment.depth + (segment.kind === "shadow"), 8)}px`;
  made.title = `depth ${segment.depth}; weight ${segment.weight.map((x) => x.toPrecision(3)).join("  ")}; ${brings(segment.radiance)}`;
  for (const name of ["pointerenter", "focus", "click"]) made.addEventListener(name, choose);
  return made;
}
