// The WebSocket to the renderer: messages out as JSON, pictures in as binary; it comes back when the server does.

export const PICTURE_RGBA = 1;
export const PICTURE_JPEG = 2;
export const FACE_COLORS = 3;
export const PROOF = 4;
export const FILE = 5;
const HEADER = 40;
// Seconds between attempts: at once after a hiccup, then slow enough not to be a load.
const PATIENCE = [0.3, 1, 2, 5];
// RFC 6455, 7.4.1: a message was larger than the other side takes.
const TOO_LARGE = 1009;

// A path of the server as a full address, with the token that this page was opened with.
export function address(path, query = {}) {
  const url = new URL(path, document.baseURI);
  const token = new URLSearchParams(location.search).get("token");
  if (token) url.searchParams.set("token", token);
  for (const [name, value] of Object.entries(query)) url.searchParams.set(name, value);
  return url;
}

export async function fetchFrom(path, query) {
  const response = await fetch(address(path, query));
  if (!response.ok) {
    const { status } = response;
    throw Object.assign(new Error(`${path}: ${status} ${await response.text()}`), { status });
  }
  return response;
}

// A picture, a band of one, face colours or a proof: {kind, seq, step, last, w, h, first, rows, ms, rate, bytes}. The
// picture is w x h; bytes holds `rows` of it from the `first`. The rate is in million rays a second. Of a piece of a
// file, first, rows and h count bytes.
export function decode(buffer) {
  const [kind, seq, step, last, w, rows, first, h] = new Uint32Array(buffer, 0, 8);
  const [ms, rate] = new Float32Array(buffer, 32, 2);
  const bytes = new Uint8ClampedArray(buffer, HEADER);
  return { kind, seq, step, last: last === 1, w, h, first, rows, ms, rate, bytes };
}

export class Connection {
  // Begins with `open`. `received(picture)`, `told(message)` and `changed(open)` are called as things arrive;
  // `refused(true)` where a message is too large for the server, and `refused(false)` once one of its type is not.
  constructor({ received, told, changed, refused }) {
    Object.assign(this, { received, told, changed, refused, attempts: 0, limit: Infinity, refusedType: null });
  }

  open() {
    const url = address("ws");
    url.protocol = url.protocol.replace("http", "ws");
    this.socket = new WebSocket(url);
    this.socket.binaryType = "arraybuffer";
    this.largest = { size: 0, type: null };
    this.socket.addEventListener("open", () => this.changed(true));
    this.socket.addEventListener("message", ({ data }) => {
      if (typeof data === "string") this.text(JSON.parse(data));
      else this.received(decode(data));
    });
    this.socket.addEventListener("close", ({ code }) => this.closed(code));
  }

  text(message) {
    // A server that has too many pages opens the connection, and closes it before it tells of a scene.
    if (message.type === "scene") this.attempts = 0;
    this.told(message);
  }

  closed(code) {
    this.changed(false);
    if (code === TOO_LARGE) {
      this.limit = this.largest.size;
      this.refuse(this.largest.type);
    }
    const wait = PATIENCE[Math.min(this.attempts++, PATIENCE.length - 1)];
    setTimeout(() => this.open(), wait * 1000);
  }

  get ready() {
    return this.socket?.readyState === WebSocket.OPEN;
  }

  refuse(type) {
    this.refusedType = type;
    this.refused(true);
  }

  // Whether the message was sent. Drops it where there is no connection: only the newest view matters, and it is sent
  // again on return; and where it is as large as one for which the server closed the connection.
  send(message) {
    if (!this.ready) return false;
    const text = JSON.stringify(message), { type } = message;
    if (text.length >= this.limit) {
      this.refuse(type);
      return false;
    }
    if (text.length > this.largest.size) this.largest = { size: text.length, type };
    this.socket.send(text);
    if (type === this.refusedType) {
      this.refusedType = null;
      this.refused(false);
    }
    return true;
  }
}
