// Saving what is seen as a picture, at once or when it is finished.
import { savePicture } from "./save.js";

export class Saving {
  constructor(viewer) {
    Object.assign(this, { viewer, waiting: false });
  }

  // Save what is seen; a traced picture once it is finished, if it will be.
  save() {
    if (!this.viewer.traced.coming) return this.now();
    this.waiting = true;
    this.viewer.notices.say("The picture is saved when it is finished.", "saving");
  }

  // Save a picture that was waited for, if it is finished.
  finish() {
    if (this.waiting && this.viewer.traced.finished) this.now();
  }

  now() {
    const { frames, scene, notices } = this.viewer;
    this.stop();
    notices.say(`Saved: ${savePicture(frames.layers, scene.name)}`);
  }

  // Another scene has come, whose picture it is not.
  give() {
    if (this.waiting) this.viewer.notices.say("The picture was not saved: the scene has changed.");
    this.stop();
  }

  stop() {
    this.waiting = false;
    this.viewer.notices.clear("saving");
  }
}
