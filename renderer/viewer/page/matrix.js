// Vectors are arrays of three numbers, matrices arrays of sixteen, column by column, as WebGL reads them.

export const add = (a, b) => [a[0] + b[0], a[1] + b[1], a[2] + b[2]];
export const sub = (a, b) => [a[0] - b[0], a[1] - b[1], a[2] - b[2]];
export const scale = (a, s) => [a[0] * s, a[1] * s, a[2] * s];
export const dot = (a, b) => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];
export const norm = (a) => Math.hypot(...a);
export const unit = (a) => scale(a, 1 / norm(a));
// From vectors with y up to those with another axis up, as renderer/arguments/up.py turns them, and back.
export const raised = ([x, y, z], up) => ({ x: [y, -x, z], y: [x, y, z], z: [x, -z, y] })[up];
export const lowered = ([x, y, z], up) => ({ x: [-y, x, z], y: [x, y, z], z: [x, z, -y] })[up];
export const cross = (a, b) => [
  a[1] * b[2] - a[2] * b[1],
  a[2] * b[0] - a[0] * b[2],
  a[0] * b[1] - a[1] * b[0],
];

export function multiply(a, b) {
  const product = new Array(16).fill(0);
  for (let column = 0; column < 4; column++)
    for (let row = 0; row < 4; row++)
      for (let k = 0; k < 4; k++) product[4 * column + row] += a[4 * k + row] * b[4 * column + k];
  return product;
}

// World to camera, where the camera's axes are orthonormal.
export function inverseRigid(m) {
  const [right, up, back, eye] = [0, 4, 8, 12].map((k) => m.slice(k, k + 3));
  return [
    right[0], up[0], back[0], 0,
    right[1], up[1], back[1], 0,
    right[2], up[2], back[2], 0,
    -dot(right, eye), -dot(up, eye), -dot(back, eye), 1,
  ];
}

export function perspective(fovy, aspect, near, far) {
  const f = 1 / Math.tan(fovy / 2);
  return [
    f / aspect, 0, 0, 0,
    0, f, 0, 0,
    0, 0, (far + near) / (near - far), -1,
    0, 0, (2 * far * near) / (near - far), 0,
  ];
}

// Of a film `height` high; what is seen has no perspective.
export function orthographic(height, aspect, near, far) {
  return [
    2 / (height * aspect), 0, 0, 0,
    0, 2 / height, 0, 0,
    0, 0, 2 / (near - far), 0,
    0, 0, (far + near) / (near - far), 1,
  ];
}

// Where a view {m, height} sees the scene within `bounds` from: the eye, or far behind it where all rays are parallel.
// So many times the scene's size and distance away they are, as exactly as float32 can tell.
const FAR = 1e4;
export function seenFrom(view, bounds) {
  const eye = view.m.slice(12, 15);
  if (!view.height) return eye;
  const centre = scale(add(bounds[0], bounds[1]), 0.5);
  const away = norm(sub(bounds[1], bounds[0])) + norm(sub(eye, centre));
  return add(centre, scale(view.m.slice(8, 11), FAR * away));
}

// World to clip space for a view {m, fovy, height, w, h}; the clip planes enclose the sphere around `bounds`.
export function clipMatrix(view, bounds) {
  const centre = scale(add(bounds[0], bounds[1]), 0.5);
  const radius = norm(sub(bounds[1], bounds[0])) / 2;
  const distance = dot(sub(view.m.slice(12, 15), centre), view.m.slice(8, 11));
  const far = Math.max(distance + 1.5 * radius, 1e-3 * radius);
  if (view.height) {
    // Rays begin at the eye's plane.
    const near = Math.max(distance - 1.5 * radius, 0);
    return multiply(orthographic(view.height, view.w / view.h, near, Math.max(far, near + radius)), inverseRigid(view.m));
  }
  // 24 bits of depth tell apart what lies a few thousandths of the near plane apart at this ratio.
  const near = Math.max(distance - 1.5 * radius, far / 4000);
  return multiply(perspective(view.fovy, view.w / view.h, near, far), inverseRigid(view.m));
}
