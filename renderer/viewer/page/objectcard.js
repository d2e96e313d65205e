// The object that a picked ray met: its name on the card, and what can be done with it from there.
import { button } from "./element.js";

// The least share of the picture that an object is fitted into where a card covers the rest.
const LEAST = 0.25;

// How a notice of a hidden object begins, which is not true any more once others are hidden.
export const HIDDEN = "Hidden:";

// Whether a button was pressed by a key, whose user goes on from where the focus is.
const byKey = (event) => event.detail === 0;

export class ObjectCard {
  constructor(viewer) {
    Object.assign(this, { viewer, returning: null });
  }

  // The object that a pick met; undefined for none.
  objectOf({ object: name }) {
    return this.viewer.scene.objects.find((one) => one.name === name);
  }

  labelOf(pick) {
    return this.objectOf(pick)?.label ?? null;
  }

  // The label and the buttons for a pick; null where it met no object.
  part(pick) {
    const { material } = pick, { objects } = this.viewer.scene, object = this.objectOf(pick);
    if (!object) return null;
    const buttons = [
      button("Material", (event) => this.showMaterial(material, byKey(event)), { title: `Show ${material} in the panel` }),
      button("Frame", () => this.frame(object), { title: "All of the object in view" }),
    ];
    return { label: object.label, buttons: objects.length > 1 ? [...buttons, ...this.hiding(object, objects)] : buttons };
  }

  hiding(object, objects) {
    const alone = objects.every((one) => one.shown === (one === object));
    const hide = button("Hide", () => this.hide(object), { title: "Leave the object out" });
    hide.disabled = alone; // one is left to be seen
    const others = objects.filter((one) => one !== object).map(({ name }) => name);
    const isolate = button("Isolate", (event) => this.isolate(alone ? [] : others, byKey(event)),
      { title: alone ? "Show all objects" : "Hide all other objects" });
    isolate.setAttribute("aria-pressed", String(alone));
    // The card comes anew with the other scene.
    if (this.returning && this.returning === this.viewer.picking.asked) queueMicrotask(() => isolate.focus());
    this.returning = null;
    return [hide, isolate];
  }

  showMaterial(name, focus) {
    const { folds, edits } = this.viewer.panel;
    const entry = edits.entryOf(name);
    folds.reveal(entry);
    if (focus) entry.querySelector("summary").focus({ preventScroll: true });
  }

  // Fit the object into the part of the picture whose middle is the picture's and that the card leaves free.
  frame({ bounds }) {
    const { camera, picking, size } = this.viewer;
    const { x, width } = picking.free;
    camera.fit(Math.max(width - 2 * Math.abs(x), (LEAST * size.w) / size.h), bounds);
    this.viewer.moved();
  }

  hide({ name, label }) {
    const { objects, rays, scenes, notices } = this.viewer;
    rays.close();
    scenes.hideObjects([...objects.hidden, name]);
    notices.say(`${HIDDEN} ${label}. Undo, or its switch under Objects, shows it again.`);
  }

  isolate(hidden, focus) {
    const { picking, scenes } = this.viewer;
    if (focus) this.returning = picking.asked;
    scenes.hideObjects(hidden);
  }
}
