// One camera for all modes: it looks at a pivot from a distance, by yaw and pitch about the scene's vertical.
import { add, cross, norm, scale, sub, unit, dot } from "./matrix.js";

// Just short of the pole, where the horizontal would be undefined.
const STEEPEST = (89.5 * Math.PI) / 180;
// The field of view that an orthographic camera has once it is a perspective one: the renderer's own default.
const USUAL = Math.PI / 4;
// Half the height of the film, in millimetres, for which focal lengths are given: 36 x 24, as of 35 mm cameras.
const HALF_FILM = 12;
const QUARTER = Math.PI / 2;
// Fields of view that the server allows.
const [NARROWEST, WIDEST] = [0.001, 3.1];

// Around a scene that fits, a margin of a twentieth is left.
const ROOM = 1.05;

export class Camera {
  // `scene` is what the server says of the scene: its camera and bounds.
  constructor(scene) {
    this.scene = scene;
    this.radius = Math.max(norm(sub(scene.bounds[1], scene.bounds[0])) / 2, 1e-9);
    this.reset();
  }

  reset() {
    const { eye, target, up, fov, height, type } = this.scene.camera;
    const vertical = unit(up ?? [0, 1, 0]);
    const aside = Math.abs(vertical[0]) < 0.9 ? [1, 0, 0] : [0, 0, 1];
    const depth = unit(cross(aside, vertical));
    this.axes = [cross(vertical, depth), vertical, depth];
    const offset = sub(eye, target);
    const back = unit(offset);
    // The height of an orthographic camera's film; null for perspective.
    this.height = type === "orthographic" ? height : null;
    this.fovy = type === "orthographic" ? USUAL : (fov * Math.PI) / 180;
    this.distance = norm(offset);
    this.yaw = Math.atan2(dot(back, this.axes[0]), dot(back, this.axes[2]));
    this.pitch = Math.asin(Math.max(-1, Math.min(1, dot(back, vertical))));
    this.pivot = [...target];
  }

  // Where the sides of the scene lie.
  get sides() {
    const [right, top, front] = this.axes;
    const [left, bottom, back] = this.axes.map((axis) => scale(axis, -1));
    return { front, back, left, right, top, bottom };
  }

  // What the user changes, to be kept and set again.
  get state() {
    const { yaw, pitch, distance, height, fovy, pivot } = this;
    return { yaw, pitch, distance, height, fovy, pivot };
  }

  set state(state) {
    Object.assign(this, state, { pivot: [...state.pivot] });
  }

  // The height of the picture in scene units, where the pivot is.
  get extent() {
    return this.height ?? 2 * this.distance * Math.tan(this.fovy / 2);
  }

  get orthographic() {
    return this.height !== null;
  }

  // Change the projection; what is as far away as the pivot keeps its size.
  set orthographic(wanted) {
    if (wanted === this.orthographic) return;
    const { extent } = this;
    this.height = wanted ? extent : null;
    // Nothing lies behind the eye of an orthographic camera that is so far away.
    this.distance = wanted ? Math.max(this.distance, 2 * this.radius) : extent / (2 * Math.tan(this.fovy / 2));
  }

  // In millimetres, of a camera whose film is 24 high.
  get focal() {
    return HALF_FILM / Math.tan(this.fovy / 2);
  }

  // As another lens would: the eye stays.
  set focal(millimetres) {
    this.fovy = Math.min(Math.max(2 * Math.atan(HALF_FILM / millimetres), NARROWEST), WIDEST);
  }

  // All that is within `bounds` in view, seen from the side where the camera is.
  fit(aspect, bounds = this.scene.bounds) {
    const [lower, upper] = bounds;
    this.pivot = scale(add(lower, upper), 0.5);
    const [right, up, back] = this.frame();
    const slope = Math.tan(this.fovy / 2) / ROOM;
    // How far each corner of the bounds lies towards the eye, and aside: half the film's height that shows it.
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((corner) => {
      const at = sub([0, 1, 2].map((k) => ((corner >> k) & 1 ? upper : lower)[k]), this.pivot);
      return [dot(at, back), Math.max(Math.abs(dot(at, right)) / aspect, Math.abs(dot(at, up)))];
    });
    if (this.height !== null) {
      this.height = 2 * ROOM * Math.max(...corners.map(([, aside]) => aside), 1e-3 * this.radius);
      this.distance = 2 * this.radius; // nothing lies behind the eye
    } else this.distance = Math.max(...corners.map(([near, aside]) => near + aside / slope), 1e-3 * this.radius);
  }

  // Right, up and back as unit vectors.
  frame() {
    const [x, y, z] = this.axes;
    const [c, s] = [Math.cos(this.yaw), Math.sin(this.yaw)];
    const right = sub(scale(x, c), scale(z, s));
    const level = add(scale(x, s), scale(z, c));
    const back = add(scale(level, Math.cos(this.pitch)), scale(y, Math.sin(this.pitch)));
    return [right, cross(back, right), back];
  }

  eye() {
    return add(this.pivot, scale(this.frame()[2], this.distance));
  }

  // Camera to world: right, up, back and eye, column by column.
  matrix() {
    const [right, up, back] = this.frame();
    return [...right, 0, ...up, 0, ...back, 0, ...this.eye(), 1];
  }

  // Swing around the pivot, by radians.
  orbit(yaw, pitch) {
    this.yaw += yaw;
    this.pitch = Math.max(-STEEPEST, Math.min(STEEPEST, this.pitch + pitch));
  }

  // Look around from where the eye is, by radians.
  turn(yaw, pitch) {
    const eye = this.eye();
    this.orbit(yaw, pitch);
    this.pivot = sub(eye, scale(this.frame()[2], this.distance));
  }

  // Move eye and pivot along the film, by shares of the picture's height.
  pan(x, y) {
    const [right, up] = this.frame();
    this.pivot = add(this.pivot, add(scale(right, x * this.extent), scale(up, y * this.extent)));
  }

  // Change the distance to the pivot by a factor, or the size of an orthographic film. What is seen `x` to the right of
  // the middle and `y` above it, in shares of the picture's height, stays there if it is as far away as the pivot.
  zoom(factor, x = 0, y = 0) {
    // From grazing the pivot to seeing the scene as a dot.
    const within = (size) => Math.max(1e-3 * this.radius, Math.min(100 * this.radius, size * factor));
    const before = this.extent;
    if (this.height !== null) this.height = within(this.height);
    else this.distance = within(this.distance);
    const share = before / this.extent - 1;
    this.pan(x * share, y * share);
  }

  // Look at a point, in the same direction from as far as before.
  focus(point) {
    this.pivot = [...point];
  }

  // Look at the middle of a way from its side, so far off that all of it is in view: in a part of the picture that is
  // `width` wide and whose middle is `x` to the right of the picture's, in shares of the picture's height.
  seeAside(start, end, { x, width }) {
    const way = sub(end, start);
    this.pivot = add(start, scale(way, 0.5));
    this.yaw = Math.atan2(dot(way, this.axes[0]), dot(way, this.axes[2])) + Math.PI / 2;
    this.pitch = 0.15;
    const wanted = (1.2 * norm(way)) / Math.min(width, 1);
    if (this.height !== null) this.height = wanted;
    else this.distance = wanted / (2 * Math.tan(this.fovy / 2));
    this.pan(-x, 0);
  }

  // See the pivot from where a direction points. From above and below, the picture's sides lie along two axes.
  lookFrom(direction) {
    const [aside, up, depth] = this.axes.map((axis) => dot(unit(direction), axis));
    this.pitch = Math.asin(Math.max(-1, Math.min(1, up)));
    const level = Math.hypot(aside, depth) > 1e-9;
    this.yaw = level ? Math.atan2(aside, depth) : Math.round(this.yaw / QUARTER) * QUARTER;
  }

  // Walk: right, up and forward in scene units.
  walk(x, y, z) {
    const [right, , back] = this.frame();
    const step = add(add(scale(right, x), scale(this.axes[1], y)), scale(back, -z));
    this.pivot = add(this.pivot, step);
  }
}
