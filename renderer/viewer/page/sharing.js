// The panel's section of files to hand on: all in one, which the page makes by itself.
import { element } from "./card.js";
import { download } from "./save.js";
import { Share } from "./share.js";

// Milliseconds between looks at whether the picture is finished.
const LOOK = 100;

export class Sharing {
  constructor(viewer, section) {
    this.viewer = viewer;
    this.share = new Share(viewer);
    const file = element("button", { type: "button", id: "share-file", textContent: "Save as one file",
      title: "Picture, model, boxes and ray as an HTML file that needs no server" });
    file.addEventListener("click", () => this.saveFile(file));
    section.append(element("summary", { textContent: "Share" }), element("div", { className: "buttons" }, file));
  }

  // Make the file of what is seen, once the picture under way is finished.
  async saveFile(button) {
    const { viewer } = this;
    if (!viewer.scene) return;
    button.disabled = true;
    viewer.busy.begin("sharing", "Making the file …");
    try {
      while (viewer.coming) await new Promise((resolve) => setTimeout(resolve, LOOK));
      const { blob, name, note } = await this.share.file();
      download(blob, name);
      viewer.notices.say(`Saved: ${name}, ${(blob.size / 1e6).toFixed(1)} MB. ${note}`.trim());
    } catch (error) {
      viewer.notices.say(`The file cannot be made: ${error.message}`);
    } finally {
      viewer.busy.end("sharing");
      button.disabled = false;
    }
  }

  received() {
    return false;
  }

  told() {}

  lost() {}
}
