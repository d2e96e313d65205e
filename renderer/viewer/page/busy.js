// What the page waits for, in a line over the stage.

export class Busy {
  constructor(line) {
    Object.assign(this, { line, waits: new Map() });
  }

  // Say `text` until `end(name)`; of several waits the newest is said.
  begin(name, text) {
    this.waits.delete(name);
    this.waits.set(name, text);
    this.show();
  }

  end(name) {
    if (this.waits.delete(name)) this.show();
  }

  show() {
    this.line.textContent = [...this.waits.values()].at(-1) ?? "";
    this.line.hidden = !this.waits.size;
  }
}
