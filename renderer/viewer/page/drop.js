// Files of the user's own, dropped on the page or chosen by a button: the server takes them, and shows their scene.
import { address } from "./connection.js";

const MIB = 1 << 20;

const listed = (files) => files.map(({ name }) => name).join(", ");
const mebibytes = (n) => `${Math.ceil(n / MIB)} MiB`;
// What is said of them while they are on their way.
const brief = (files) => (files.length === 1 ? files[0].name : `${files.length} files`);

export class Drop {
  constructor(viewer, { button, input, target }) {
    Object.assign(this, { viewer, input, target, request: null });
    button.addEventListener("click", () => this.choose());
    input.addEventListener("change", () => {
      this.open([...input.files]);
      input.value = ""; // so that the same file can be chosen again
    });
    addEventListener("dragover", (event) => this.over(event));
    // Which says where to, unless that is out of the window.
    addEventListener("dragleave", ({ relatedTarget }) => relatedTarget === null && (target.hidden = true));
    addEventListener("drop", (event) => this.dropped(event));
  }

  // What the server takes: the most bytes, and suffixes.
  get taken() {
    return this.viewer.scene.drop;
  }

  choose() {
    // Browsers know the last suffix of a name alone.
    this.input.accept = [...new Set(this.taken.suffixes.map((suffix) => suffix.slice(suffix.lastIndexOf("."))))].join();
    this.input.click();
  }

  over(event) {
    if (!event.dataTransfer.types.includes("Files")) return;
    event.preventDefault();
    event.dataTransfer.dropEffect = "copy";
    this.target.hidden = false;
  }

  dropped(event) {
    this.target.hidden = true;
    const files = [...event.dataTransfer.files];
    if (!files.length) return;
    event.preventDefault();
    this.open(files);
  }

  // Show the scene of these files; where there is none, say what is wrong and leave all as it is.
  async open(given) {
    const { notices } = this.viewer;
    const files = given.filter(({ name }) => this.taken.suffixes.some((suffix) => name.toLowerCase().endsWith(suffix)));
    const others = given.filter((file) => !files.includes(file));
    const fault = this.fault(files, given);
    if (fault) return notices.say(fault);
    if (others.length) notices.say(`Left out, as no mesh is in them: ${listed(others)}`);
    try {
      const file = await this.send(files);
      if (file) this.viewer.scenes.open(file);
    } catch (error) {
      notices.say(error.message);
    }
  }

  // Why the server would refuse the files of those that were given; null where it may take them.
  fault(files, given) {
    const { most, suffixes } = this.taken;
    const size = files.reduce((sum, file) => sum + file.size, 0);
    if (!files.length) return `${listed(given)}: expected a scene or a mesh (${suffixes.join(" ")}), got none`;
    return size > most ? `${listed(files)}: expected at most ${mebibytes(most)}, got ${mebibytes(size)}` : null;
  }

  // Send them one after the other in one request; the answer is the name of the scene, null if others came after them.
  send(files) {
    this.request?.abort();
    const request = (this.request = new XMLHttpRequest()); // fetch tells of no progress
    const sizes = files.map(({ name, size }) => [name, size]);
    request.open("POST", address("drop", { files: JSON.stringify(sizes) }));
    request.upload.addEventListener("progress", ({ loaded, total }) => this.tell(files, loaded / total));
    this.tell(files, 0);
    return new Promise((resolve, reject) => {
      request.addEventListener("load", () => {
        if (request.status === 200) resolve(JSON.parse(request.responseText).file);
        else reject(new Error(request.responseText));
      });
      request.addEventListener("error", () => reject(new Error(`${listed(files)}: cannot be read or sent`)));
      request.addEventListener("abort", () => resolve(null));
      request.addEventListener("loadend", () => this.request === request && this.viewer.busy.end("uploading"));
      request.send(new Blob(files));
    });
  }

  // In steps of ten, which a screen reader can follow.
  tell(files, share) {
    const sent = `Uploading ${brief(files)}, ${10 * Math.floor(10 * share)} %`;
    this.viewer.busy.begin("uploading", share < 1 ? sent : `Reading ${brief(files)} …`);
  }
}
