// What is drawn over the model or over a traced picture: boxes of the octree and rays, and how strongly.

// Hidden parts of lines shine through the model by these shares.
const HIDDEN = { boxes: 0.1, visited: 0.3, rays: 0.65 };
// Under boxes the model is darkened by this share, so that they glow.
const VEIL = 0.66;

// What GlLayer.draw takes beside the view, for `boxes` {edges, panes, count}, `rays` {path, visited} and, where there is
// one, `measure` {lines}.
export const drawing = (shading, boxes, rays, measure) => ({
  shading,
  veil: boxes.count ? VEIL : 0,
  panes: boxes.panes,
  layers: [
    { name: "boxes", set: boxes.edges, hidden: HIDDEN.boxes, fades: true },
    { name: "visited", set: rays.visited, hidden: HIDDEN.visited, fades: true },
    { name: "rays", set: rays.path, hidden: HIDDEN.rays, fades: false },
    ...(measure ? [{ name: "measure", set: measure.lines, hidden: HIDDEN.rays, fades: false }] : []),
  ],
});
