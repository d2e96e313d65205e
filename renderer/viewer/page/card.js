// The card of a picked pixel: where its ray went and what it met.
import { button, closing, element, swatch } from "./element.js";
import { KINDS, shownKind } from "./overlay.js";
import { rayTree } from "./raytree.js";
import { count } from "./readings.js";

const NAMES = { camera: "camera ray", reflected: "reflected", refracted: "refracted", shadow: "shadow, lit", blocked: "shadow, blocked" };

const vector = (v) => v.map((x) => x.toFixed(3)).join("  ");
const rgb = (color) => `rgb(${color.map((x) => Math.round(255 * Math.min(x, 1) ** (1 / 2.2))).join(" ")})`;

function rows(pick, scene, object) {
  if (!pick.hit) return [["hit", "nothing: the background"]];
  const material = scene.materials.find((m) => m.name === pick.material);
  const shown = { phong: "diffuse", mirror: "reflectance", dielectric: "transmittance" }[material?.type];
  const name = material ? [swatch(rgb(material[shown])), `${material.name} · ${material.type}`] : [String(pick.material)];
  return [...(object ? [["object", object.label]] : []), ["material", ...name], ["face", String(pick.face)], ["t", pick.t.toPrecision(6)],
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

// The pixel's values by both ways of a proof, and how they differ.
function values({ at, of, values: [one, other], same_rays: same }) {
  const cells = (numbers) => numbers.map((x) => element("td", {}, x.toPrecision(6)));
  const line = ({ name, radiance, rays }) =>
    element("tr", { title: rays === null ? "" : `${count(rays)} rays` }, element("th", { scope: "row" }, name), ...cells(radiance));
  const identical = one.radiance.every((x, i) => x === other.radiance[i]);
  const apart = one.radiance.map((x, i) => Math.abs(x - other.radiance[i]));
  const table = element("table", { className: "values" }, line(one), line(other), line({ name: "apart", radiance: apart, rays: null }));
  const counts = [one, other].map(({ rays }) => (rays === null ? "?" : count(rays))).join(" and ");
  const rays = same === null ? `${counts} rays` : `${same ? "the same" : "not the same"} ${counts} rays`;
  const where = `pixel ${at.join(", ")} of ${of.join(" × ")}`;
  const said = identical ? `Identical to the bit, ${rays}; ${where}` : `Different, ${rays}; ${where}`;
  return [element("h2", { textContent: "Comparison" }), table, element("p", { className: "note", textContent: said })];
}

// The nodes that the camera ray visited, as bars from the root's level down.
function byLevel(levels) {
  const most = Math.max(...levels, 1);
  const bars = levels.map((number, level) => {
    const bar = element("i", { title: `level ${level}: ${number}` });
    bar.style.height = `${(100 * number) / most}%`;
    return bar;
  });
  return element("div", { className: "by-level", role: "img", ariaLabel: `Nodes visited, by level: ${levels.join(", ")}` }, ...bars);
}

// Fill and show `card`; `close()` is called by its button, `toggle(shown)` by the switch of the visited nodes,
// `chosen(index)` for the ray that is pointed at, and `aside()`, where there is one, to see it from the side. `object`
// has the label of the object that was met, if there is one, and the buttons for it.
export function showCard(card, pick, { scene, object, close, toggle, chosen, aside, shown }) {
  const list = element("dl");
  for (const [name, ...value] of rows(pick, scene, object)) list.append(element("dt", { textContent: name }), element("dd", {}, ...value));
  const nodes = element("input", { type: "checkbox", checked: shown });
  nodes.setAttribute("role", "switch");
  nodes.addEventListener("change", () => toggle(nodes.checked));
  const visited = element("label", { className: "switch" }, element("span", {}, `${pick.visited} nodes visited`), nodes);
  const tested = element("p", { className: "note", textContent: `${count(pick.tested.triangles)} triangles tested by the camera ray` });
  const side = button("View from the side", () => aside());
  const title = element("h2", { textContent: pick.hit ? "Ray" : "Ray into the open" });
  const proof = pick.proof ? values(pick.proof) : [];
  const acts = object?.buttons.length ? [element("div", { className: "buttons" }, ...object.buttons)] : [];
  const rays = [element("ul", { className: "legend" }, ...legend(pick.path)), ...rayTree(pick.path, chosen)];
  const nodesByLevel = pick.levels.length ? [byLevel(pick.levels)] : [];
  // Of a ray into the open there is little to say.
  const parts = pick.hit ? [...acts, ...rays, visited, ...nodesByLevel, tested, ...(aside ? [side] : [])] : [visited];
  card.replaceChildren(closing("Close", close), ...proof, title, list, ...parts);
  card.hidden = false;
}
