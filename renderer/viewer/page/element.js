// Elements of the page, made of their properties and what is in them.

export function element(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

// A button that says `text`; `act(event)` is called when it is pressed.
export function button(text, act, properties = {}) {
  const made = element("button", { type: "button", textContent: text, ...properties });
  made.addEventListener("click", act);
  return made;
}

// The cross in the corner of a card.
export const closing = (label, act) => button("×", act, { className: "close", ariaLabel: label });

// A dot in a colour of CSS.
export function swatch(color) {
  const dot = element("i", { className: "swatch" });
  dot.style.background = color;
  return dot;
}

// The text of a page's heading and its class: a scene's name in words, or the name of another file as it is.
export function heading(name) {
  const words = name.replace(/\.toml$/, "");
  return words.includes(".") ? { textContent: words, className: "" } : { textContent: words.replaceAll("_", " "), className: "words" };
}
