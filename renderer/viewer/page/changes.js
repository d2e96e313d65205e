// The scene's file as it would be with what is changed here: shown as a diff before it is saved.
import { element } from "./element.js";
import { saveText } from "./save.js";

export class Changes {
  constructor(dialog) {
    this.dialog = dialog;
    dialog.querySelector("#close-changes").addEventListener("click", () => dialog.close());
    dialog.querySelector("#save-changes").addEventListener("click", () => {
      saveText(this.name, this.text);
      dialog.close();
    });
  }

  // `diff` is unified; an empty one says that nothing differs.
  show({ name, text, diff }) {
    Object.assign(this, { name, text });
    const lines = diff ? diff.split("\n").filter((line) => !/^(---|\+\+\+) /.test(line)) : ["Nothing here differs from the file."];
    const kinds = { "+": "added", "-": "removed", "@": "place" };
    this.dialog.querySelector("pre").replaceChildren(...lines.map((line) =>
      element("span", { className: (diff && kinds[line[0]]) || "", textContent: `${line}\n` })));
    this.dialog.querySelector("h2").textContent = `Changes to ${name}`;
    this.dialog.querySelector("#save-changes").disabled = !diff;
    this.dialog.showModal();
  }
}
