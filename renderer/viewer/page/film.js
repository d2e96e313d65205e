// How large pictures are: on the screen, and in pixels that are traced.

const LARGEST = 1024; // of a traced picture's sides, as the server allows

// `stage` is the room in CSS pixels, [width, height]; `chosen` is a share of its pixels such as "0.5", a size such as
// "512x512", or "scene" for `own`, [w, h]. Returns {css, size}: what to show as [width, height], what to trace as {w, h}.
export function film(stage, chosen, own) {
  const asked = chosen === "scene" ? own : chosen.split("x").map(Number);
  if (asked.length === 1) {
    const share = Math.min(asked[0], LARGEST / Math.max(...stage));
    const [w, h] = stage.map((side) => Math.max(Math.round(side * share), 1));
    return { css: stage, size: { w, h } };
  }
  // Larger pictures than allowed keep their shape, and are shown as large as there is room.
  const share = Math.min(1, LARGEST / Math.max(...asked));
  const [w, h] = asked.map((side) => Math.max(Math.round(side * share), 1));
  const shown = Math.min(1, stage[0] / w, stage[1] / h);
  return { css: [Math.round(w * shown), Math.round(h * shown)], size: { w, h } };
}
