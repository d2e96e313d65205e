// Controls for numbers and colours of materials, lights and surroundings.
import { element } from "./element.js";

const linear = (code) => (code <= 0.04045 ? code / 12.92 : ((code + 0.055) / 1.055) ** 2.4);
const coded = (x) => (x <= 0.0031308 ? 12.92 * x : 1.055 * Math.min(x, 1) ** (1 / 2.4) - 0.055);
const hex = (x) => Math.round(255 * coded(Math.max(x, 0))).toString(16).padStart(2, "0");
// A picker has 256 steps; four digits tell them apart.
const rounded = (x) => Number(x.toPrecision(4));

// The colour of a picker for linear red, green and blue; what is brighter than white is shown as bright as white.
export const pickerColor = (rgb) => `#${rgb.map((x) => hex(x / Math.max(1, ...rgb))).join("")}`;

// Linear red, green and blue of a picker's colour, as bright as those before if they were brighter than white.
export const pickedColor = (color, before) =>
  [1, 3, 5].map((i) => rounded(linear(parseInt(color.slice(i, i + 2), 16) / 255) * Math.max(1, ...before)));

// What is wrong with a number that was entered, "" for nothing.
function faultOf(input) {
  if (input.value === "" || !Number.isFinite(input.valueAsNumber)) return "Expected a number";
  const { rangeUnderflow, rangeOverflow, stepMismatch } = input.validity;
  const parts = [rangeUnderflow && `at least ${input.min}`, rangeOverflow && `at most ${input.max}`, stepMismatch && "a whole number"];
  const expected = parts.find(Boolean);
  return expected ? `Expected ${expected}` : "";
}

function numberInput(value, label, { least = "", most = "", whole = false }) {
  return element("input", { type: "number", step: whole ? 1 : "any", min: least, max: most, defaultValue: value, ariaLabel: label });
}

// The line that says what is wrong with some inputs. `taken()` is called when all are right, or returns what is wrong
// with them together; an input that is left with a fault gets its last right value again.
function guard(inputs, taken) {
  const line = element("output", { className: "fault", hidden: true });
  line.setAttribute("role", "alert");
  let right = inputs.map((input) => input.value);
  const check = () => {
    const faults = inputs.map(faultOf);
    inputs.forEach((input, i) => input.setAttribute("aria-invalid", String(faults[i] !== "")));
    const fault = faults.find((text) => text) ?? taken() ?? "";
    Object.assign(line, { value: fault, hidden: !fault });
    if (!fault) right = inputs.map((input) => input.value);
  };
  const restore = () => {
    if (line.hidden) return;
    inputs.forEach((input, i) => (input.value = right[i]));
    check();
  };
  for (const input of inputs) {
    input.addEventListener("input", check);
    input.addEventListener("change", restore);
  }
  return { line, keep: () => (right = inputs.map((input) => input.value)) };
}

// A number `value` within `limits`, {least, most, whole}; `changed(value)` is called with what the user enters, if it is one.
export function numberField(name, value, limits, changed) {
  const input = numberInput(value, name, limits);
  const { line } = guard([input], () => void changed(input.valueAsNumber));
  return element("div", {}, element("label", { className: "row" }, element("span", { textContent: name }), input), line);
}

// Three numbers, and for a colour a picker too; a direction has a length.
export function vectorField(name, value, { isColor, isDirection }, changed) {
  const axes = isColor ? ["red", "green", "blue"] : ["x", "y", "z"];
  const inputs = value.map((x, i) => numberInput(x, `${name}, ${axes[i]}`, isColor ? { least: 0 } : {}));
  let current = value;
  const take = (next) => {
    current = next;
    changed(next);
  };
  const picker = isColor && element("input", { type: "color", defaultValue: pickerColor(value), ariaLabel: name });
  const { line, keep } = guard(inputs, () => {
    const entered = inputs.map((input) => input.valueAsNumber);
    if (isDirection && entered.every((x) => x === 0)) return "Expected a direction, not 0 0 0";
    if (picker) picker.value = pickerColor(entered);
    take(entered);
  });
  picker?.addEventListener?.("input", () => {
    const picked = pickedColor(picker.value, current);
    inputs.forEach((input, i) => (input.value = picked[i]));
    keep();
    take(picked);
  });
  return element("div", { className: "vector" }, element("span", { textContent: name }), ...(picker ? [picker] : []), ...inputs, line);
}
