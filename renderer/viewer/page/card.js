// The card of a picked pixel: where its ray went and what it met.
import { KINDS, shownKind } from "./overlay.js";

const NAMES = { camera: "camera ray", reflected: "reflected", refracted: "refracted", shadow: "shadow, lit", blocked: "shadow, blocked" };

export function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

const vector = (v) => v.map((x) => x.toFixed(3)).join("  ");
const rgb = (color) => `rgb(${color.map((x) => Math.round(255 * Math.min(x, 1) ** (1 / 2.2))).join(" ")})`;

function swatch(color) {
  const dot = element("i", { className: "swatch" });
  dot.style.background = color;
  return dot;
}

function rows(pick, scene) {
  if (!pick.hit) return [["hit", "nothing: the background"]];
  const material = scene.materials.find((m) => m.name === pick.material);
  const shown = { phong: "diffuse", mirror: "reflectance", dielectric: "transmittance" }[material?.type];
  const name = material ? [swatch(rgb(material[shown])), `${material.name} · ${material.type}`] : [String(pick.material)];
  return [["material", ...name], ["face", String(pick.face)], ["t", pick.t.toPrecision(6)],
    ["point", vector(pick.point)], ["normal", vector(pick.normal)]];
}

// How many rays of each kind, in the order in which they first came.
function legend(path) {
  const counts = new Map();
  for (const segment of path) {
    const kind = shownKind(segment);
    counts.set(kind, (counts.get(kind) ?? 0) + 1);
  }
  return [...counts].map(([kind, count]) =>
    element("li", {}, swatch(`rgb(${KINDS[kind].join(" ")})`), `${count} ${NAMES[kind]}`));
}

// Fill and show `card`; `close()` is called by its button and `toggle(shown)` by the switch of the visited nodes.
export function showCard(card, pick, { scene, close, toggle, shown }) {
  const list = element("dl");
  for (const [name, ...value] of rows(pick, scene)) list.append(element("dt", { textContent: name }), element("dd", {}, ...value));
  const closing = element("button", { type: "button", className: "close", ariaLabel: "Close", textContent: "×" });
  closing.addEventListener("click", close);
  const nodes = element("input", { type: "checkbox", checked: shown });
  nodes.setAttribute("role", "switch");
  nodes.addEventListener("change", () => toggle(nodes.checked));
  const visited = element("label", { className: "switch" }, element("span", {}, `${pick.visited} nodes visited`), nodes);
  const title = element("h2", { textContent: pick.hit ? "Ray" : "Ray into the open" });
  card.replaceChildren(closing, title, list, element("ul", { className: "legend" }, ...legend(pick.path)), visited);
  card.hidden = false;
}
