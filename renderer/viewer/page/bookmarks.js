// Views that the user keeps, by their addresses, for each scene in this browser.
import { button, element } from "./element.js";
import { read, write } from "./stored.js";

const KEY = "octree-render-views";
const MOST = 50;

// The views of all scenes.
const kept = () => read("localStorage", KEY) ?? {};

const isView = (one) => typeof one?.name === "string" && typeof one.address === "string";

export class Bookmarks {
  // `seen()` is the address of what is seen, and `go(address)` shows another one.
  constructor(list, { seen, go, say }) {
    Object.assign(this, { list, seen, go, say, scene: "" });
  }

  load({ name }) {
    this.scene = name;
    this.show();
  }

  get views() {
    const views = kept()[this.scene];
    return Array.isArray(views) ? views.filter(isView) : [];
  }

  set views(views) {
    const done = write("localStorage", KEY, { ...kept(), [this.scene]: views });
    if (!done) this.say("This browser keeps no views for this page; the address in its bar holds this one.");
    this.show();
  }

  add() {
    const { views } = this;
    if (views.length >= MOST) return this.say(`${MOST} views are kept; remove one first.`);
    const taken = views.map(({ name }) => Number(name.slice(5)));
    this.views = [...views, { name: `View ${Math.max(0, ...taken) + 1}`, address: this.seen() }];
  }

  show() {
    this.list.replaceChildren(...this.views.map((view, i) => {
      const remove = () => (this.views = this.views.toSpliced(i, 1));
      return element("li", {}, button(view.name, () => this.go(view.address)),
        button("×", remove, { className: "remove", ariaLabel: `Remove ${view.name}`, title: "Remove" }));
    }));
  }
}
