// The view in the page's address, after the #: scene, mode, camera and what differs from the scene's own settings.

const MODES = ["gl", "phong", "brute", "octree", "proof"];
const NUMBERS = ["yaw", "pitch", "distance", "height", "fovy"];
// Fields of view that the server allows.
const [NARROWEST, WIDEST] = [0.001, 3.1];

// `state` is that of a camera, `chosen` what the panel says that the user chose, `hidden` names of objects.
export function written({ file, mode, state, chosen, hidden }) {
  const camera = [...NUMBERS.map((name) => state[name] ?? ""), ...state.pivot].join(",");
  const parts = { file, mode, camera, ...(hidden.length ? { hidden: hidden.join(",") } : {}), ...chosen };
  return `#${new URLSearchParams(parts)}`;
}

// What an address says; what is no view of this page is left out.
export function read(hash) {
  const { file, mode, camera, hidden, ...chosen } = Object.fromEntries(new URLSearchParams(hash.slice(1)));
  return { file, mode: MODES.includes(mode) ? mode : undefined, state: cameraIn(camera), hidden: hidden?.split(",") ?? [], chosen };
}

function cameraIn(text) {
  const parts = (text ?? "").split(",");
  if (parts.length !== NUMBERS.length + 3) return null;
  const [yaw, pitch, distance, height, fovy, ...pivot] = parts.map((part) => (part === "" ? NaN : Number(part)));
  const parallel = parts[3] !== "";
  const known = [yaw, pitch, distance, fovy, ...pivot, ...(parallel ? [height] : [])].every(Number.isFinite);
  const allowed = distance > 0 && fovy >= NARROWEST && fovy <= WIDEST && (!parallel || height > 0);
  return known && allowed ? { yaw, pitch, distance, height: parallel ? height : null, fovy, pivot } : null;
}
