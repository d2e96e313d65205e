// The traced picture: a 2D canvas that shows each pass as it arrives, stretched to the frame.
import { PICTURE_JPEG, PROOF } from "./connection.js";
import { readProof } from "./proof.js";

export class Picture {
  // `proof` draws pictures that are two.
  constructor(canvas, proof) {
    Object.assign(this, { canvas, proof, parts: null });
    this.context = canvas.getContext("2d");
  }

  // Show a decoded picture, or a band of one over what stands there; resolves when it stands on the canvas.
  async show({ kind, w, h, first, rows, bytes }) {
    if (kind === PROOF) {
      this.parts = await readProof(bytes);
      this.resize(w, h);
      return this.paint();
    }
    this.parts = null;
    const jpeg = kind === PICTURE_JPEG && (await createImageBitmap(new Blob([bytes], { type: "image/jpeg" })));
    if (rows === h) this.resize(w, h);
    else this.stretch(w, h);
    if (jpeg) this.context.drawImage(jpeg, 0, first);
    else this.context.putImageData(new ImageData(bytes, w, rows), 0, first);
  }

  // Draw the two pictures of a proof, if that is what stands here, as they are wanted now.
  paint() {
    if (this.parts) this.proof.paint(this.context, this.parts);
  }

  resize(w, h) {
    if (this.canvas.width !== w) this.canvas.width = w;
    if (this.canvas.height !== h) this.canvas.height = h;
  }

  // The same picture in w x h pixels.
  stretch(w, h) {
    const { canvas } = this;
    if (canvas.width === w && canvas.height === h) return;
    const before = Object.assign(document.createElement("canvas"), { width: canvas.width, height: canvas.height });
    before.getContext("2d").drawImage(canvas, 0, 0);
    this.resize(w, h);
    this.context.drawImage(before, 0, 0, w, h);
  }

  clear() {
    this.parts = null;
    this.context.clearRect(0, 0, this.canvas.width, this.canvas.height);
  }

  set visible(value) {
    this.canvas.classList.toggle("away", !value);
  }
}
