// The picked pixel: asks the renderer for its ray, and keeps its lines and its card.
import { showCard } from "./card.js";
import { LineSet } from "./lines.js";
import { pathLines, visitedLines } from "./overlay.js";

const NONE = new LineSet(1);

export class Rays {
  // `changed()` is called when other lines are to be drawn, and `aside(pick)` to see a ray from the side.
  constructor(card, frame, changed, aside) {
    Object.assign(this, { card, frame, changed, aside, seq: 0, asked: null, path: NONE, nodes: NONE, showNodes: true });
  }

  get shown() {
    return !this.card.hidden;
  }

  get visited() {
    return this.showNodes ? this.nodes : NONE;
  }

  // The pixel of `view` under a point of the window, as {x, y} and that view; null beside the picture.
  pixel(view, clientX, clientY) {
    const { left, top, width, height } = this.frame.getBoundingClientRect();
    const x = Math.floor(((clientX - left) / width) * view.w);
    const y = Math.floor(((clientY - top) / height) * view.h);
    if (x < 0 || y < 0 || x >= view.w || y >= view.h) return null;
    return { x, y, ...view };
  }

  // The question for a pixel, with its values in the proof of that number, if there is one.
  ask(asked, settings, proof) {
    this.asked = asked;
    return { type: "pick", seq: ++this.seq, ...asked, ...(proof === null ? {} : { proof }), settings };
  }

  // Show the renderer's answer; `object` is the card's part of what was met.
  show(pick, scene, object) {
    this.pick = pick;
    this.path = pathLines(pick);
    this.nodes = visitedLines(pick);
    const toggle = (shown) => {
      this.showNodes = shown;
      this.changed();
    };
    const chosen = (index) => {
      this.path = pathLines(pick, index);
      this.changed();
    };
    const aside = () => this.aside(pick);
    showCard(this.card, pick, { scene, object, close: () => this.close(), toggle, chosen, aside, shown: this.showNodes });
    this.changed();
  }

  close() {
    // What is still on its way is no longer asked for.
    this.seq++;
    this.asked = null;
    if (this.card.contains(document.activeElement)) this.frame.parentElement.focus();
    this.card.hidden = true;
    this.path = this.nodes = NONE;
    this.changed();
  }
}
