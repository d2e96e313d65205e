// The traced picture: a 2D canvas that shows each pass as it arrives, stretched to the frame.
import { PICTURE_JPEG } from "./connection.js";

export class Picture {
  constructor(canvas) {
    this.canvas = canvas;
    this.context = canvas.getContext("2d");
  }

  // Show a decoded picture; resolves when it stands on the canvas.
  async show({ kind, w, h, bytes }) {
    if (kind === PICTURE_JPEG) {
      const bitmap = await createImageBitmap(new Blob([bytes], { type: "image/jpeg" }));
      this.resize(w, h);
      this.context.drawImage(bitmap, 0, 0);
    } else {
      this.resize(w, h);
      this.context.putImageData(new ImageData(bytes, w, h), 0, 0);
    }
  }

  resize(w, h) {
    if (this.canvas.width !== w) this.canvas.width = w;
    if (this.canvas.height !== h) this.canvas.height = h;
  }

  clear() {
    this.context.clearRect(0, 0, this.canvas.width, this.canvas.height);
  }

  set visible(value) {
    this.canvas.classList.toggle("away", !value);
  }
}
