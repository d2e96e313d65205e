// What the fields of materials, lights and a sky may hold, as the server checks it.

export const [COLOR, VECTOR, NUMBER] = ["color", "vector", "number"];
// What numbers may be; an index of refraction is more than nothing.
export const LIMITS = {
  shininess: { least: 0 }, ior: { least: 1e-6 },
  lights: { least: 0, most: 4096, whole: true }, sun_angle: { least: 0, most: 45 }, sun_lights: { least: 1, most: 4096, whole: true },
};
// The fields that may be missing.
const OPTIONAL = ["ambient", "ground", "sun"];

export const same = (a, b) => JSON.stringify(a) === JSON.stringify(b);
export const copy = (value) => JSON.parse(JSON.stringify(value));

const finite = (x) => typeof x === "number" && Number.isFinite(x);
const three = (value, allowed) => Array.isArray(value) && value.length === 3 && value.every((x) => finite(x) && allowed(x));
const within = (value, { least, most = Infinity, whole }) => value >= least && value <= most && (!whole || Number.isInteger(value));

// Whether a value is of that kind, in the field of that name.
const TAKEN = {
  [COLOR]: (value) => three(value, (x) => x >= 0),
  [VECTOR]: (value, name) => three(value, () => true) && (name === "position" || value.some((x) => x !== 0)),
  [NUMBER]: (value, name) => finite(value) && (name === "ior" ? value > 0 : within(value, LIMITS[name])),
};

export const isColor = TAKEN[COLOR];

// Whether `given` has all fields of `known`, {name: [kind]}, no others, and values that the server takes.
export function fits(given, known) {
  return typeof given === "object" && given !== null && Object.keys(given).every((name) => Object.hasOwn(known, name)) &&
    Object.entries(known).every(([name, [kind]]) => (given[name] === undefined ? OPTIONAL.includes(name) : TAKEN[kind](given[name], name)));
}
