// Mouse, touch and keys on the stage, as movements of the camera.

// Half a turn for a drag across the stage's smaller side.
const TURN = Math.PI;
// A wheel's notch is 100 to 120 units in most browsers: about an eighth closer.
const WHEEL = 0.0012;
// Browsers tell of two fingers that part on a trackpad as a wheel with the control key, of a hundredth for each part of
// e by which they part.
const PINCH = 0.01;
// A press that moves less is a click: hands and touch screens tremble by about this many pixels.
const STILL = 4;
// Radians, scene radii and factors of distance a second, while a key is held.
const TURN_RATE = 1.4;
const WALK_RATE = 0.5;
const ZOOM_RATE = 2;
// What a tap shorter than a frame does: as much as holding the key so long, in seconds.
const TAP = 0.04;

// What stands on the stage and is no part of the picture.
const OWN = "button, .axes g, .proof, .slider";

const HELD = {
  ArrowLeft: [0, -1, 0], ArrowRight: [0, 1, 0], ArrowUp: [0, 0, 1], ArrowDown: [0, 0, -1],
  KeyA: [1, -1, 0, 0], KeyD: [1, 1, 0, 0], KeyQ: [1, 0, -1, 0], KeyE: [1, 0, 1, 0],
  KeyS: [1, 0, 0, -1], KeyW: [1, 0, 0, 1],
  "+": [2, 1], "=": [2, 1], "-": [2, -1], "_": [2, -1],
};

// Before anything is focused, keys mean the stage too.
export const isForStage = (event, stage) => event.target === stage || event.target === document.body;

// Letters, digits and signs mean it on every control that makes nothing of them; lists search by them.
const MAKES_NOTHING_OF_THEM = "button, summary, [role=slider], input:is([type=checkbox], [type=radio], [type=range])";
export const isShortcut = (event) =>
  event.key.length === 1 && event.key !== " " && event.target.matches(MAKES_NOTHING_OF_THEM);

export class Controls {
  // `moved()` is called after each movement, `clicked(clientX, clientY)` for a press that did not move,
  // `focused(clientX, clientY)` for two of them. `frame` is the picture's element on the stage.
  constructor(stage, frame, { camera, moved, clicked, focused }) {
    Object.assign(this, { stage, frame, camera, moved, clicked, walking: false });
    this.pointers = new Map();
    this.held = new Map();
    this.travelled = 0;
    // Where the first press of some at one place fell, and whether the last of them fell on something else.
    this.pressed = null;
    this.stray = false;
    stage.addEventListener("pointerdown", (event) => this.press(event));
    stage.addEventListener("pointermove", (event) => this.drag(event));
    for (const name of ["pointerup", "pointercancel"])
      stage.addEventListener(name, (event) => this.release(event));
    stage.addEventListener("wheel", (event) => this.wheel(event), { passive: false });
    // Between two clicks a card may have come over the picture, or gone: the first press tells what they are meant for.
    for (const name of ["mousedown", "click"]) document.addEventListener(name, (event) => this.follow(event), true);
    document.addEventListener("dblclick", (event) => {
      if (this.isBareStage(this.pressed)) focused(event.clientX, event.clientY);
    });
    stage.addEventListener("contextmenu", (event) => event.preventDefault());
    document.addEventListener("keydown", (event) => this.keyDown(event));
    document.addEventListener("keyup", (event) => this.held.delete(event.code));
    for (const left of [stage, window]) left.addEventListener("blur", () => this.held.clear());
  }

  // Whether it is the stage without the controls that stand there.
  isBareStage(target) {
    return this.stage.contains(target) && !target.closest(OWN);
  }

  // Clicks after the first mean nothing to what has come there since: they would press a button, select a word, or pick
  // what a card has covered.
  follow(event) {
    const { detail, type, target } = event;
    if (type === "mousedown" && detail <= 1) this.pressed = target;
    this.stray = detail > 1 && this.isBareStage(this.pressed) !== this.isBareStage(target);
    if (!this.stray) return;
    event.preventDefault();
    event.stopPropagation();
  }

  press(event) {
    if (!this.isBareStage(event.target)) return;
    this.stray = false;
    this.stage.focus({ preventScroll: true });
    this.stage.setPointerCapture(event.pointerId);
    if (!this.pointers.size) this.travelled = 0;
    else this.travelled = Infinity; // two fingers are no click
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
  }

  drag(event) {
    const before = this.pointers.get(event.pointerId);
    if (!before) return;
    const [x, y] = [event.clientX - before[0], event.clientY - before[1]];
    this.travelled += Math.hypot(x, y);
    const others = [...this.pointers].filter(([id]) => id !== event.pointerId);
    this.pointers.set(event.pointerId, [event.clientX, event.clientY]);
    if (this.travelled < STILL) return;
    if (others.length) this.pinch([event.clientX, event.clientY], before, others[0][1]);
    else if (event.shiftKey || event.buttons & 6) this.pan(x, y);
    else this.rotate(x, y);
    this.moved();
  }

  release(event) {
    if (!this.pointers.delete(event.pointerId)) return;
    const click = event.type === "pointerup" && event.button === 0 && this.travelled < STILL && !this.stray;
    if (click && !this.pointers.size) this.clicked(event.clientX, event.clientY);
  }

  rotate(x, y) {
    const { width, height } = this.stage.getBoundingClientRect();
    const rate = TURN / Math.min(width, height);
    if (this.walking) this.camera().turn(-x * rate * 0.5, y * rate * 0.5);
    else this.camera().orbit(-x * rate, y * rate);
  }

  pan(x, y) {
    const { height } = this.frame.getBoundingClientRect();
    this.camera().pan(-x / height, y / height);
  }

  // Zoom by a factor towards or away from a point of the window.
  zoomAt(factor, [x, y]) {
    const { left, top, width, height } = this.frame.getBoundingClientRect();
    this.camera().zoom(factor, (x - left - width / 2) / height, (top + height / 2 - y) / height);
  }

  // One finger moved from `before` to `now` while the other stood still.
  pinch(now, before, still) {
    this.pan((now[0] - before[0]) / 2, (now[1] - before[1]) / 2);
    const spread = (p) => Math.max(Math.hypot(p[0] - still[0], p[1] - still[1]), 1);
    this.zoomAt(spread(before) / spread(now), [(now[0] + still[0]) / 2, (now[1] + still[1]) / 2]);
  }

  wheel(event) {
    event.preventDefault();
    const unit = event.deltaMode === WheelEvent.DOM_DELTA_LINE ? 33 : 1;
    const amount = event.deltaY * unit * (event.ctrlKey ? PINCH : WHEEL);
    if (this.walking) this.camera().walk(0, 0, -amount * this.camera().radius * 0.5);
    else this.zoomAt(Math.exp(amount), [event.clientX, event.clientY]);
    this.moved();
  }

  keyDown(event) {
    const held = HELD[event.code] ?? HELD[event.key];
    if (!held || event.ctrlKey || event.metaKey || event.altKey) return;
    if (!isForStage(event, this.stage) && !isShortcut(event)) return;
    event.preventDefault();
    if (this.held.has(event.code)) return;
    // By its place on the keyboard, because a shift released earlier changes the character of its keyup.
    this.held.set(event.code, held);
    this.advance(TAP);
  }

  // Let the held keys act for `seconds`; returns whether any was held.
  advance(seconds) {
    const camera = this.camera();
    for (const [kind, x, y, z] of this.held.values()) {
      const step = WALK_RATE * camera.radius * seconds;
      const angle = TURN_RATE * seconds;
      if (kind === 1) camera.walk(x * step, (y || 0) * step, (z || 0) * step);
      else if (kind === 2) camera.zoom(ZOOM_RATE ** (-x * seconds));
      else if (this.walking) camera.turn(-x * angle, y * angle);
      else camera.orbit(x * angle, y * angle);
    }
    if (this.held.size) this.moved();
    return this.held.size > 0;
  }
}
