// How far a picture by brute force is.

export class Progress {
  constructor(bar) {
    this.bar = bar;
  }

  // `done` from 0 to 1; null hides the bar.
  show(done) {
    this.bar.hidden = done === null;
    this.bar.querySelector("progress").value = done ?? 0;
    this.bar.querySelector("output").value = `${Math.round(100 * (done ?? 0))} %`;
  }

  get shown() {
    return !this.bar.hidden;
  }
}
