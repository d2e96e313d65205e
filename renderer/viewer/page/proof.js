// Two pictures of one view: one left and one right of a divider, or where they differ.
import { element } from "./element.js";
import { count } from "./readings.js";

// The three PNG files of a proof's message as bitmaps: one way, the other way, and the heat map.
export async function readProof(bytes) {
  const view = new DataView(bytes.buffer, bytes.byteOffset, bytes.byteLength);
  const files = [];
  for (let at = 0; at < bytes.length; ) {
    const size = view.getUint32(at, true);
    files.push(new Blob([bytes.subarray(at + 4, at + 4 + size)], { type: "image/png" }));
    at += 4 + size;
  }
  return Promise.all(files.map((file) => createImageBitmap(file)));
}

const number = (x) => (x === 0 ? "0" : x.toExponential(1).replace("e", " × 10^").replace(/\^(.*)$/, (_, power) => superscript(Number(power))));
const superscript = (power) => [...String(power)].map((c) => "⁰¹²³⁴⁵⁶⁷⁸⁹"[c] ?? "⁻").join("");
const time = (s) => (s < 1 ? `${(1e3 * s).toFixed(0)} ms` : `${s.toFixed(1)} s`);

export class Proof {
  // `bar` holds the controls, `divider` the line between the pictures in `frame`; `changed()` is called when the
  // pictures are to be drawn anew, and `asked()` when others are to be computed.
  constructor({ bar, divider, frame, changed, asked }) {
    Object.assign(this, { bar, divider, frame, changed, split: 0.5, told: null });
    this.pair = bar.querySelector("[name=pair]");
    this.verdict = bar.querySelector("output");
    this.names = frame.querySelectorAll(".way");
    this.none = frame.querySelector("#no-difference");
    this.pair.addEventListener("change", () => asked());
    bar.addEventListener("change", ({ target }) => target.name === "proof-as" && this.show());
    divider.addEventListener("pointerdown", (event) => divider.setPointerCapture(event.pointerId));
    divider.addEventListener("pointermove", (event) => event.buttons && this.moveTo(event.clientX));
    divider.addEventListener("keydown", (event) => {
      const step = { ArrowLeft: -0.02, ArrowRight: 0.02, Home: -1, End: 1 }[event.key];
      if (!step) return;
      event.preventDefault();
      event.stopPropagation();
      this.move(this.split + step);
    });
  }

  get differences() {
    return this.bar.querySelector("[name=proof-as]:checked").value === "difference";
  }

  // The other renderers that the server can ask.
  offer(references) {
    const chosen = this.pair.value;
    for (const old of this.pair.querySelectorAll("[data-reference]")) old.remove();
    for (const name of references) {
      const option = element("option", { value: name, textContent: `octree | ${name}` });
      option.dataset.reference = name;
      this.pair.append(option);
    }
    if ([...this.pair.options].some((option) => option.value === chosen)) this.pair.value = chosen;
  }

  moveTo(clientX) {
    const { left, width } = this.frame.getBoundingClientRect();
    this.move((clientX - left) / width);
  }

  move(split) {
    this.split = Math.min(Math.max(split, 0), 1);
    this.show();
  }

  toggle() {
    const [split, difference] = this.bar.querySelectorAll("[name=proof-as]");
    (this.differences ? split : difference).checked = true;
    this.show();
  }

  // Draw `parts` on a canvas as it is chosen.
  paint(context, [one, other, heat]) {
    const { width, height } = context.canvas;
    const cut = Math.round(this.split * width);
    if (this.differences) return context.drawImage(heat, 0, 0);
    context.drawImage(one, 0, 0);
    if (cut < width) context.drawImage(other, cut, 0, width - cut, height, cut, 0, width - cut, height);
  }

  // What the server says of the comparison: see `Comparison.described`.
  tell(told) {
    this.told = told;
    const { pixels, identical, largest, at, names, seconds, w, h } = told;
    const times = names.map((name, i) => `${name} ${time(seconds[i])}`).join(", ");
    const same = identical === pixels;
    this.verdict.classList.toggle("same", same);
    this.verdict.value = same
      ? `All ${count(pixels)} pixels are identical to the bit (${w} × ${h}; ${times}).`
      : `${count(identical)} of ${count(pixels)} pixels are identical; the largest difference is ${number(largest)}, at ${at.join(", ")} (${w} × ${h}; ${times}).`;
    this.names.forEach((label, i) => (label.textContent = names[i]));
    this.show();
  }

  // Nothing is known of the view any more.
  forget() {
    this.told = null;
    this.verdict.value = "";
    this.verdict.classList.remove("same");
    this.show();
  }

  show() {
    const split = this.told !== null && !this.differences;
    this.bar.classList.toggle("split", split);
    this.divider.hidden = !split;
    this.divider.style.left = `${100 * this.split}%`;
    this.divider.setAttribute("aria-valuenow", Math.round(100 * this.split));
    for (const label of this.names) label.hidden = !split;
    this.none.hidden = !this.told || !this.differences || this.told.identical !== this.told.pixels;
    this.changed();
  }
}
