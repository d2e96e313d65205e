// Which parts of the panel are open, and whether the panel itself is: as this browser was left.
import { read, write } from "./stored.js";

const KEY = "octree-render-folds";
// On windows less wide than this the picture has the room, until the panel is opened.
const NARROW = "(max-width: 1099px)";
// Milliseconds for which an entry that was looked for stands out.
const FOUND = 2500;
// The parts that are open at the first visit.
const FIRST = ["fold-scene", "fold-readings"];

export class Folds {
  constructor(panel, toggle) {
    Object.assign(this, { panel, toggle, state: read("localStorage", KEY) ?? {} });
    for (const fold of panel.querySelectorAll("details.fold")) {
      fold.open = this.state[fold.id] ?? FIRST.includes(fold.id);
      fold.addEventListener("toggle", () => this.keep(fold.id, fold.open));
    }
    this.show(this.state.panel ?? !matchMedia(NARROW).matches);
    toggle.addEventListener("click", () => {
      this.show(document.body.classList.contains("wide"));
      if (!document.body.classList.contains("wide")) panel.scrollIntoView(); // on phones it stands under the picture
      this.keep("panel", !document.body.classList.contains("wide"));
    });
  }

  show(open) {
    document.body.classList.toggle("wide", !open);
    this.toggle.setAttribute("aria-expanded", String(open));
  }

  keep(name, open) {
    this.state[name] = open;
    write("localStorage", KEY, this.state); // or the page begins folded
  }

  // Open the panel and the parts around an entry, and let it stand out for a moment.
  reveal(entry) {
    if (document.body.classList.contains("wide")) this.toggle.click();
    for (let part = entry; part; part = part.parentElement.closest("details")) part.open = true;
    entry.scrollIntoView({ block: "start" });
    entry.classList.add("found");
    setTimeout(() => entry.classList.remove("found"), FOUND);
  }

  // What a folded part says of itself, beside its title.
  tell(name, text) {
    this.panel.querySelector(`#fold-${name} > summary output`).textContent = text;
  }
}
