// What a click on the picture does: its pixel's ray is asked for, looked at from the side, or turned about.
import { ObjectCard } from "./objectcard.js";
import { Rays } from "./rays.js";

export class Picking {
  constructor(viewer, card, frame) {
    Object.assign(this, { viewer, card, frame, focusing: null });
    this.rays = new Rays(card, frame, () => viewer.frames.request(), (pick) => this.seeAside(pick));
    this.object = new ObjectCard(viewer);
  }

  get asked() {
    return this.rays.asked;
  }

  at(clientX, clientY) {
    const asked = this.rays.pixel(this.viewer.view(), clientX, clientY);
    // A card over the picture stands on the other side of it.
    const { left, width } = this.frame.getBoundingClientRect();
    this.card.parentElement.classList.toggle("aside-left", clientX > left + width / 2);
    if (asked && !this.viewer.measure.take(asked)) this.ask(asked);
  }

  middle() {
    const { left, top, width, height } = this.frame.getBoundingClientRect();
    this.at(left + width / 2, top + height / 2);
  }

  // Ask for the same pixel by the settings and the proof as they are now.
  again() {
    if (this.asked) this.ask(this.asked);
  }

  ask(asked) {
    const { connection, panel, traced } = this.viewer;
    connection.send(this.rays.ask(asked, panel.settings, traced.proofOf(asked)));
  }

  picked(pick) {
    if (pick.seq !== this.rays.seq) return;
    this.viewer.hint.learnt();
    this.rays.show(pick, this.viewer.dressed, this.object.part(pick));
    if (this.focusing === pick.seq) this.focusOn(pick);
  }

  // See the first ray of a pick from its side.
  seeAside({ path: [{ start, end }] }) {
    this.viewer.camera.seeAside(start, end, this.free);
    this.viewer.moved();
  }

  // The part of the picture beside the card, as `Camera.seeAside` takes it.
  get free() {
    const [frame, card] = [this.frame, this.card].map((one) => one.getBoundingClientRect());
    const [left, right] = [Math.max(card.left, frame.left), Math.min(card.right, frame.right)];
    const above = getComputedStyle(this.card).position === "absolute"; // on phones it goes below the picture
    const over = above && card.top < frame.bottom && card.bottom > frame.top ? Math.max(right - left, 0) : 0;
    const hidden = over && over + Math.min(left - frame.left, frame.right - right); // with the gap at its side
    const side = left - frame.left < frame.right - right ? 1 : -1;
    return { x: (side * hidden) / 2 / frame.height, width: (frame.width - hidden) / frame.height };
  }

  // Turn about what was clicked last, once it is known what that is.
  focus(clientX, clientY) {
    const { rays } = this;
    if (!rays.pixel(this.viewer.view(), clientX, clientY)) return; // beside the picture nothing was clicked
    if (rays.pick?.seq === rays.seq) this.focusOn(rays.pick);
    else this.focusing = rays.seq;
  }

  focusOn({ hit, point }) {
    this.focusing = null;
    this.rays.close(); // which the first click opened
    if (!hit) return;
    this.viewer.camera.focus(point);
    this.viewer.moved();
  }
}
