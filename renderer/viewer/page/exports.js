// Files that the server makes for this page: asked for one at a time, and received in pieces.
import { FILE } from "./connection.js";

const TYPES = { png: "image/png", webp: "image/webp", gif: "image/gif", exr: "image/x-exr" };

export class Exports {
  // `send(message)` asks the server. `shown(done)` is called with the share that is made, null when nothing is being made
  // any more; `made(blob, name)` when a file is there.
  constructor({ send, shown, made }) {
    Object.assign(this, { send, shown, made, seq: 0, name: "", pieces: [] });
  }

  ask(message, name) {
    Object.assign(this, { name, pieces: [] });
    this.send({ ...message, seq: ++this.seq });
  }

  stop() {
    this.send({ type: "stop" });
  }

  told({ seq, done }) {
    if (seq === this.seq) this.shown(done);
  }

  // Whether a binary message was a piece of a file.
  received({ kind, seq, last, bytes }) {
    if (kind !== FILE) return false;
    if (seq === this.seq) this.pieces.push(bytes);
    if (seq !== this.seq || !last) return true;
    this.made(new Blob(this.pieces, { type: TYPES[this.name.split(".").at(-1)] }), this.name);
    this.pieces = [];
    this.shown(null);
    return true;
  }

  // Without a connection there is nobody who makes one.
  lost() {
    this.pieces = [];
    this.shown(null);
  }
}
