// Short messages over the stage, such as what the server says is wrong.
import { element } from "./element.js";

// Milliseconds: long enough to read two lines.
const SHOWN = 8000;

export class Notices {
  constructor(list) {
    this.list = list;
  }

  // Show `text`; one with a `name` stays until it is cleared. What is said again takes the place of what was said.
  say(text, name) {
    if (name && this.list.querySelector(`[data-name="${name}"]`)) return;
    for (const old of [...this.list.children]) if (!name && !old.dataset.name && old.textContent === text) old.remove();
    const notice = element("p", { textContent: text, title: text });
    // Its first lines, and all of it after a click.
    notice.addEventListener("click", () => notice.classList.toggle("whole"));
    if (name) notice.dataset.name = name;
    else setTimeout(() => notice.remove(), SHOWN);
    this.list.append(notice);
  }

  // Remove what begins with `text`.
  withdraw(text) {
    for (const old of [...this.list.children]) if (old.textContent.startsWith(text)) old.remove();
  }

  clear(name) {
    this.list.querySelector(`[data-name="${name}"]`)?.remove();
  }
}
