// The panel's section of files to hand on: all in one, which the page makes by itself, and pictures by the server.
import { button, element } from "./element.js";
import { Exports } from "./exports.js";
import { allowed } from "./film.js";
import { Progress } from "./progress.js";
import { bytes } from "./readings.js";
import { download } from "./save.js";
import { Share } from "./share.js";

// Milliseconds between looks at whether the picture is finished.
const LOOK = 100;
// Sizes of a still: of its own, or as many times the view's.
const SIZES = [["3840x2160", "3840 × 2160"], ["2560x1440", "2560 × 1440"], ["1920x1080", "1920 × 1080"],
  ["2048x2048", "2048 × 2048"], ["2", "view × 2"], ["4", "view × 4"]];
const STILLS = [["png", "PNG"], ["transparent", "PNG, transparent background"], ["exr", "EXR"]];
// Pixels from top to bottom of a turntable, which has the view's shape, and its frames.
const HEIGHTS = [["240", "240 high"], ["360", "360 high"], ["480", "480 high"], ["720", "720 high"]];
const FRAMES = [["24", "24 frames"], ["36", "36 frames"], ["72", "72 frames"]];
const FORMATS = [["webp", "WebP"], ["gif", "GIF"]];

function select(id, label, options, chosen) {
  const made = element("select", { id, ariaLabel: label });
  made.append(...options.map(([value, text]) => element("option", { value, textContent: text, selected: value === chosen })));
  return made;
}

export class Sharing {
  constructor(viewer, section) {
    this.viewer = viewer;
    this.share = new Share(viewer);
    this.exports = new Exports({
      send: (message) => viewer.connection.send(message),
      shown: (done) => this.showProgress(done),
      made: (blob, name) => this.saved(blob, name, this.note),
    });
    this.file = button("Save as one file", () => this.saveFile(),
      { id: "share-file", title: "Picture, model, boxes and ray as an HTML page that needs no server" });
    this.still = button("Save picture", () => this.askStill(), { id: "export-still", title: "Rendered in this size while the view stays" });
    this.turntable = button("Save turntable", () => this.askTurntable(), { id: "export-turntable", title: "Once around what the camera turns about" });
    this.size = select("still-size", "Size of the picture", SIZES, "3840x2160");
    this.stillFormat = select("still-format", "Format of the picture", STILLS, "png");
    this.height = select("turntable-height", "Size of the turntable", HEIGHTS, "480");
    this.frames = select("turntable-frames", "Frames of the turntable", FRAMES, "36");
    this.format = select("turntable-format", "Format of the turntable", FORMATS, "webp");
    const bar = element("div", { className: "exporting", id: "exporting", hidden: true },
      element("progress", { max: 1, ariaLabel: "File" }), element("output"),
      button("Cancel", () => this.exports.stop(), { id: "stop-export" }));
    this.progress = new Progress(bar);
    section.append(element("summary", {}, element("h2", { textContent: "Share" })), this.file,
      element("div", { className: "choices stills" }, this.size, this.stillFormat), this.still,
      element("div", { className: "choices" }, this.height, this.frames, this.format), this.turntable, bar);
  }

  // Make the file of what is seen, once the picture under way is finished.
  async saveFile() {
    const { viewer } = this;
    if (!viewer.scene) return;
    this.file.disabled = true;
    viewer.busy.begin("sharing", "Making the file …");
    try {
      while (viewer.traced.coming) await new Promise((resolve) => setTimeout(resolve, LOOK));
      const { blob, name, note } = await this.share.file();
      this.saved(blob, name, note);
    } catch (error) {
      viewer.notices.say(`The file cannot be made: ${error.message}`);
    } finally {
      viewer.busy.end("sharing");
      this.file.disabled = false;
    }
  }

  saved(blob, name, note = "") {
    download(blob, name);
    this.viewer.notices.say(`Saved: ${name}, ${bytes(blob.size)}. ${note}`.trim());
  }

  askStill() {
    const { w, h } = this.viewer.size;
    const [width, height] = this.size.value.split("x").map(Number);
    const size = height ? { w: width, h: height } : allowed([w * width, h * width]);
    const { settings } = this.asked;
    // As many as the view has once it rests.
    const samples = settings.aov === "color" ? Math.max(settings.samples, settings.refine) : settings.samples;
    this.note = samples > 1 ? `${samples} samples a pixel.` : "One sample a pixel.";
    const { value: format } = this.stillFormat;
    this.ask({ type: "still", ...this.asked, settings: { ...settings, samples }, ...size, format },
      `-${size.w}x${size.h}.${format === "exr" ? "exr" : "png"}`);
  }

  askTurntable() {
    const { size, camera } = this.viewer;
    const h = Number(this.height.value);
    const [format, frames] = [this.format.value, Number(this.frames.value)];
    this.note = "";
    const turn = { pivot: camera.pivot, axis: camera.axes[1], frames, format };
    const film = allowed([(h * size.w) / size.h, h]);
    this.ask({ type: "turntable", ...this.asked, ...film, ...turn }, `-turntable.${format}`);
  }

  // The camera and the settings as they are.
  get asked() {
    const { m, fovy, height } = this.viewer.view();
    return { m, fovy, height, settings: this.viewer.panel.settings };
  }

  ask(message, ending) {
    this.exports.ask(message, this.viewer.scene.name.replace(/(\.\w+)?$/, ending));
  }

  showProgress(done) {
    this.progress.show(done);
    this.still.disabled = this.turntable.disabled = done !== null;
  }

  received(message) {
    return this.exports.received(message);
  }

  told(message) {
    this.exports.told(message);
  }

  lost() {
    this.exports.lost();
  }
}
