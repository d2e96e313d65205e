// The list of the scene's objects, each of which can be hidden.
import { element } from "./element.js";
import { count } from "./readings.js";

export class Objects {
  // `hide(names)` is called with all that are to be hidden.
  constructor(list, hide) {
    Object.assign(this, { list, hide, objects: [] });
    list.addEventListener("input", (event) => event.stopPropagation());
  }

  load({ objects }) {
    this.objects = objects;
    this.switches = objects.map(({ name, shown }) => {
      const input = element("input", { type: "checkbox", defaultChecked: shown });
      input.setAttribute("role", "switch");
      input.dataset.name = name;
      input.addEventListener("change", () => this.hide(this.chosen));
      return input;
    });
    this.list.replaceChildren(...objects.map(({ label, faces, materials }, i) =>
      element("label", { className: "switch", title: materials.join(", ") },
        element("span", {}, label, element("span", { className: "note", textContent: ` ${count(faces)} faces` })), this.switches[i])));
    // One is left to be seen.
    const last = objects.filter(({ shown }) => shown).length === 1;
    objects.forEach(({ shown }, i) => (this.switches[i].disabled = last && shown));
  }

  // The names of those that are hidden now.
  get hidden() {
    return this.objects.filter(({ shown }) => !shown).map(({ name }) => name);
  }

  // Whether `names` are of objects, in any order, and others than those that are hidden now.
  differ(names) {
    const known = names.every((name) => this.objects.some((one) => one.name === name));
    return known && this.objects.some(({ name, shown }) => names.includes(name) === shown);
  }

  // The names of those that are to be hidden.
  get chosen() {
    return this.switches.filter((input) => !input.checked).map((input) => input.dataset.name);
  }
}
