// The few lights that stand for a sky where no shadows are drawn.
import { lowered, raised } from "./matrix.js";

const FEW = 4;
const GOLDEN = (Math.sqrt(5) - 1) / 2;

// Directional lights, spread over the hemisphere as renderer/scene/sky.py does, and one for the sun.
export function skylights(sky, up) {
  const sun = sky.sun ? [directional(sky.sun, sky.sun_irradiance)] : [];
  return sky.lights ? [...Array.from({ length: FEW }, (_, i) => skylight(sky, up, i)), ...sun] : sun;
}

function skylight({ zenith, horizon }, up, i) {
  const height = (i + 0.5) / FEW, turn = 2 * Math.PI * ((i * GOLDEN) % 1), level = Math.sqrt(1 - height * height);
  // About z, as that file has it.
  const towards = lowered([level * Math.sin(turn), level * Math.cos(turn), height], "z");
  const color = horizon.map((x, k) => ((x + height * (zenith[k] - x)) * 2) / FEW);
  return directional(raised(towards.map((x) => -x), up), color);
}

const directional = (direction, color) => ({ type: "directional", direction, color });
