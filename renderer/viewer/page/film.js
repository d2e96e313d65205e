// How large pictures are: on the screen, and in pixels that are traced.

// Of a traced picture's sides, and of its pixels, as the server allows.
const LARGEST = 4096;
const MOST = 2 ** 23;

// `stage` is the room in CSS pixels, [width, height], with `density` device pixels along each of them; `chosen` is a
// share of its device pixels along both sides such as "0.5", a size such as "512x512", or "scene" for `own`, [w, h].
// Returns {css, size}: what to show as [width, height], what to trace as {w, h}.
export function film(stage, chosen, own, density = 1) {
  const asked = chosen === "scene" ? own : chosen.split("x").map(Number);
  if (asked.length === 1) return { css: stage, size: allowed(stage.map((side) => side * asked[0] * density)) };
  // Larger pictures than allowed keep their shape, and are shown as large as there is room.
  const size = allowed(asked);
  const shown = Math.min(1, stage[0] / size.w, stage[1] / size.h);
  return { css: [Math.round(size.w * shown), Math.round(size.h * shown)], size };
}

// The size nearest the one asked for that the server allows, of the same shape.
export function allowed([width, height]) {
  const share = Math.min(1, LARGEST / Math.max(width, height), Math.sqrt(MOST / (width * height)));
  // Rounded down where it is reduced, so that it is allowed.
  const round = share < 1 ? Math.floor : Math.round;
  const [w, h] = [width, height].map((side) => Math.max(round(side * share), 1));
  return { w, h };
}
