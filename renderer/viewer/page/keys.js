// Keys on the stage that are commands; those that move the camera are in controls.js.

import { isForStage, isShortcut } from "./controls.js";

const MODES = ["gl", "phong", "brute", "octree", "proof"];

const HISTORY = { z: "undo", y: "redo", Z: "redo" };

export function bindKeys(viewer) {
  const { stage, panel } = viewer;
  const { fields } = panel;
  // As if the user had clicked: fires the form's input event.
  const click = (field) => field.click();
  const level = (step) => {
    if (fields.level.disabled) return;
    fields.level.valueAsNumber += step;
    fields.level.dispatchEvent(new Event("input", { bubbles: true }));
  };
  const commands = {
    r: () => viewer.reset(),
    f: () => viewer.fit(),
    b: () => click(fields.boxes),
    l: () => click(fields.walk),
    x: () => viewer.mode === "proof" && viewer.proof.toggle(),
    ",": () => level(-1),
    ".": () => level(1),
    m: () => viewer.measure.toggle(),
    Escape: () => (viewer.measure.on ? viewer.measure.end() : viewer.rays.shown ? viewer.rays.close() : viewer.cancel()),
    Enter: () => viewer.picking.middle(),
  };
  MODES.forEach((mode, i) => (commands[i + 1] = () => viewer.setMode(mode)));
  document.addEventListener("keydown", (event) => {
    if (event.altKey || document.querySelector("dialog[open]")) return;
    if (event.ctrlKey || event.metaKey) {
      const act = HISTORY[event.key];
      // A field that is typed in has an undo of its own.
      if (!act || event.target.matches("input[type=number]")) return;
      event.preventDefault();
      viewer.past[act]();
      return;
    }
    const own = isForStage(event, stage) || isShortcut(event) || event.key === "Escape";
    const command = commands[event.key.length === 1 ? event.key.toLowerCase() : event.key];
    if (!own || !command) return;
    event.preventDefault();
    command();
  });
}

// After a click on a control the stage has the keys again; who came by keyboard stays there. Sliders keep the arrow
// keys, by which they are set finely.
export function returnKeys(stage) {
  let byPointer = false;
  document.addEventListener("pointerdown", () => (byPointer = true), true);
  document.addEventListener("keydown", () => (byPointer = false), true);
  const giveBack = (event, controls) => {
    if (byPointer && event.target.closest(controls)) stage.focus({ preventScroll: true });
  };
  document.addEventListener("change", (event) => giveBack(event, "select, input:not([type=range])"));
  document.addEventListener("click", (event) => giveBack(event, "button, summary"));
}
