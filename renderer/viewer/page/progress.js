// How far a picture that takes its time is, and how long it will take from here.

// Before that share an estimate would jump about.
const SURE = 0.03;

export class Progress {
  constructor(bar) {
    this.bar = bar;
    this.began = 0;
  }

  // `done` from 0 to 1; null hides the bar.
  show(done) {
    this.bar.hidden = done === null;
    this.mark(false);
    const now = performance.now();
    if (!done) this.began = now;
    this.bar.querySelector("progress").value = done ?? 0;
    this.bar.querySelector("output").value = `${Math.round(100 * (done ?? 0))} %${this.left(done ?? 0, now)}`;
  }

  // The time that is left, if the rest takes as long as the same share before.
  left(done, now) {
    if (done < SURE) return "";
    const seconds = ((now - this.began) / 1000) * (1 / done - 1);
    return seconds < 1.5 ? "" : ` · ${seconds < 90 ? `${Math.round(seconds)} s` : `${Math.round(seconds / 60)} min`} left`;
  }

  // Say that it was cancelled; the button starts it again.
  stop() {
    this.mark(true);
    this.bar.querySelector("output").value = "Cancelled";
  }

  mark(stopped) {
    this.bar.classList.toggle("stopped", stopped);
    this.bar.querySelector("button").textContent = stopped ? "Start" : "Cancel";
  }

  // Whether a picture is under way.
  get shown() {
    return !this.bar.hidden && !this.bar.classList.contains("stopped");
  }
}
