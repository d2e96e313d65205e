// The list of the scene's objects, each of which can be hidden.
import { element } from "./element.js";
import { norm, sub } from "./matrix.js";
import { count } from "./readings.js";

// A floor is left out of Fit that makes the scene so many times as large.
const WIDE = 3;

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

  // What of the scene's bounds Fit shows: all, but for a floor that is much larger than what stands on it.
  fitted([lower, upper]) {
    const shown = this.objects.filter((one) => one.shown && one.bounds && one.name !== "floor");
    if (!shown.length) return [lower, upper];
    const corner = (k, most, end) => lower.map((_, axis) => Math[most](...shown.map(({ bounds }) => bounds[k][axis]), end[axis]));
    // A section may leave less of an object than all of it.
    const least = corner(0, "min", upper).map((x, axis) => Math.max(x, lower[axis]));
    const greatest = corner(1, "max", lower).map((x, axis) => Math.min(x, upper[axis]));
    return norm(sub(upper, lower)) > WIDE * norm(sub(greatest, least)) ? [least, greatest] : [lower, upper];
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
