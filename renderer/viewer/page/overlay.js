// What is drawn over the model: the boxes of one level of the octree, and the way of a picked ray.
import { BoxSet } from "./boxes.js";
import { LineSet } from "./lines.js";

// From the root to the leaves: violet over blue and green to yellow (viridis, lightened so that lines read on any
// background).
const LEVELS = [[163, 113, 247], [122, 139, 255], [79, 163, 255], [52, 190, 235], [45, 210, 190], [84, 222, 140], [160, 230, 95], [222, 228, 80]];
const MANY_SHADOWS = 24;
const VISITED = [255, 170, 40];
const LEAF = [255, 92, 40];
export const KINDS = {
  camera: [255, 226, 130],
  reflected: [70, 214, 255],
  refracted: [236, 110, 255],
  shadow: [140, 236, 120],
  blocked: [255, 82, 82],
};

export const levelColor = (level, levels) => {
  const at = levels > 1 ? (level / (levels - 1)) * (LEVELS.length - 1) : 0;
  const [low, share] = [Math.floor(at), at % 1];
  const next = LEVELS[Math.min(low + 1, LEVELS.length - 1)];
  return LEVELS[low].map((c, i) => Math.round(c + share * (next[i] - c)));
};

export const NO_BOXES = { edges: new LineSet(1), panes: new BoxSet(0), count: 0, all: 0 };
export const NO_RAYS = { path: new LineSet(1), visited: new LineSet(1) };

// Boxes with those corners, six numbers each, on one of `levels` levels, `most` of them at the most and evenly from all
// of them: {edges, panes, count, all, level, levels}, of which `all` is the number of boxes that the level has.
export function levelBoxes(corners, { level, levels, all }, most) {
  const given = corners.length / 6;
  const count = Math.min(given, most);
  const edges = new LineSet(Math.max(12 * count, 1));
  const panes = new BoxSet(count);
  // Many boxes are drawn finer and fainter, or they would cover the model.
  const crowd = Math.min(Math.max((Math.log10(Math.max(count, 1)) - 1.2) / 2.6, 0), 1);
  const between = (few, many) => few + (many - few) * crowd;
  const color = levelColor(level, levels);
  for (let shown = 0; shown < count; shown++) {
    const i = Math.floor((shown * given) / count);
    const [lower, upper] = [corners.subarray(6 * i, 6 * i + 3), corners.subarray(6 * i + 3, 6 * i + 6)];
    edges.addBox(lower, upper, [...color, between(255, 70)], between(2.2, 0.9));
    panes.add(lower, upper, [...color, between(64, 40)]);
  }
  return { edges, panes, count, all, level, levels };
}

// As which of KINDS a segment of a path is shown.
export const shownKind = ({ kind, hit }) => (kind === "shadow" && hit ? "blocked" : kind);

// The rays of a picked pixel and the point that each of them met. Where one is `chosen` by its index, the others fade.
export function pathLines(pick, chosen = -1) {
  const set = new LineSet();
  // Those to the many lights of a sky would hide what they are about.
  const many = pick.path.filter(({ kind }) => kind === "shadow").length > MANY_SHADOWS;
  pick.path.forEach((segment, i) => {
    const shadow = segment.kind === "shadow";
    const faded = chosen >= 0 && i !== chosen;
    const thin = shadow && many && i !== chosen;
    const color = [...KINDS[shownKind(segment)], thin || faded ? 70 : shadow && i !== chosen ? 215 : 255];
    const width = (thin ? 1 : shadow ? 2 : 3) * (i === chosen ? 1.8 : 1);
    set.add(segment.start, segment.end, color, width, shadow && segment.hit ? 9 : 0);
    if (segment.hit && !thin) set.add(segment.end, segment.end, color, shadow ? 6 : 9);
  });
  return set;
}

// The nodes that a picked ray opened: the deeper the stronger, leaves in another colour.
export function visitedLines(pick) {
  const set = new LineSet();
  const deepest = Math.max(...pick.nodes.map((node) => node.level), 1);
  for (const { level, lower, upper, leaf } of pick.nodes) {
    const alpha = leaf ? 255 : 90 + Math.round((120 * level) / deepest);
    set.addBox(lower, upper, [...(leaf ? LEAF : VISITED), alpha], leaf ? 2.2 : 1.4);
  }
  return set;
}
