// A hint that pixels can be clicked, until one was.

const KEY = "octree-render-picked";

export class Hint {
  constructor(line) {
    this.line = line;
    try {
      line.hidden = localStorage.getItem(KEY) !== null;
    } catch {
      line.hidden = false; // some frames and private windows keep nothing
    }
  }

  learnt() {
    this.line.hidden = true;
    try {
      localStorage.setItem(KEY, "yes");
    } catch {
      // Then it is told again.
    }
  }
}
