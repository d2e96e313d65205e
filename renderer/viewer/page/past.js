// Views before and after, as entries of the browser's history: Back and Undo are one.

// Milliseconds after the last change: a drag is one step, and browsers refuse more than some entries a second.
const REST = 400;

export class Past {
  // `written()` gives the address of what is seen now.
  constructor(written, undo, redo) {
    // `furthest` counts the steps to the last view that Redo leads to.
    Object.assign(this, { written, undoing: undo, redoing: redo, timer: null, came: true, furthest: 0 });
    undo.addEventListener("click", () => this.undo());
    redo.addEventListener("click", () => this.redo());
  }

  // How many steps led here from the first view of this page.
  get steps() {
    return history.state?.steps ?? 0;
  }

  // Write the view into the address once nothing has changed for a moment.
  keep() {
    clearTimeout(this.timer);
    this.timer = setTimeout(() => this.write(), REST);
  }

  // What is seen next has come by the history, or from the page's own beginning: it is no further step.
  arrive() {
    this.came = true;
  }

  write() {
    clearTimeout(this.timer);
    this.timer = null;
    const hash = this.written();
    const address = location.pathname + location.search + hash;
    if (this.came) history.replaceState({ steps: this.steps }, "", address);
    else if (hash !== location.hash) {
      history.pushState({ steps: this.steps + 1 }, "", address);
      this.furthest = this.steps;
    }
    this.came = false;
    this.furthest = Math.max(this.furthest, this.steps);
    this.undoing.disabled = this.steps === 0;
    this.redoing.disabled = this.steps === this.furthest;
  }

  undo() {
    if (this.timer !== null) this.write(); // what has not come to rest is a step too
    if (this.steps > 0) history.back();
  }

  redo() {
    history.forward();
  }
}
