// The boxes of one level of the octree, as the server has them.
import { fetchFrom } from "./connection.js";
import { levelBoxes } from "./overlay.js";

// Those of the scene with that id, `most` of them at the most, as `levelBoxes` makes them.
export async function fetchBoxes(id, level, most) {
  const buffer = await (await fetchFrom("octree", { id, level })).arrayBuffer();
  const [all, levels] = new Uint32Array(buffer, 0, 2);
  return levelBoxes(new Float32Array(buffer, 8, 6 * all), { level, levels, all }, most);
}
