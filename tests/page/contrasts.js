// The contrasts of texts and of the edges of controls with what is behind them, each with its element's own words. What
// lies over the picture is measured over black and over white, of which the worse counts.
() => {
  const parse = (css) => {
    const numbers = (css.match(/[\d.]+/g) ?? [0, 0, 0, 0]).map(Number);
    return [...numbers.slice(0, 3), numbers[3] ?? 1];
  };
  const over = (top, under) => [0, 1, 2].map((i) => top[i] * top[3] + under[i] * (1 - top[3])).concat(1);
  const linear = (c) => (c <= 0.04045 ? c / 12.92 : ((c + 0.055) / 1.055) ** 2.4);
  const luminance = ([r, g, b]) => 0.2126 * linear(r / 255) + 0.7152 * linear(g / 255) + 0.0722 * linear(b / 255);
  const contrast = (a, b) => {
    const [l, m] = [luminance(a), luminance(b)];
    return (Math.max(l, m) + 0.05) / (Math.min(l, m) + 0.05);
  };
  const grounds = (element) => {
    const layers = [];
    const overPicture = element.closest("#stage, .bar, .card") !== null;
    for (let at = element; at && !(overPicture && at.matches("#stage, main")); at = at.parentElement)
      layers.unshift(parse(getComputedStyle(at).backgroundColor));
    const bases = overPicture ? [[0, 0, 0, 1], [255, 255, 255, 1]] : [[255, 255, 255, 1]];
    return bases.map((base) => layers.reduce((under, layer) => over(layer, under), base));
  };
  const worst = (color, element) =>
    Math.min(...grounds(element).map((ground) => contrast(over(parse(color), ground), ground)));
  const seen = (element) =>
    element.checkVisibility({ visibilityProperty: true }) && !element.closest(":disabled, fieldset:disabled, .unseen, option");
  const words = (element) =>
    [...element.childNodes].filter((node) => node.nodeType === Node.TEXT_NODE).map((node) => node.data.trim()).join(" ").trim();
  const found = [];
  for (const element of [...document.querySelectorAll("body *")].filter(seen)) {
    const own = words(element);
    const style = getComputedStyle(element);
    const name = `${element.tagName.toLowerCase()}#${element.id}.${element.className} ${own.slice(0, 30)}`;
    // A label of the axes lies on its knob.
    const knob = element.matches("svg text") && parse(getComputedStyle(element.previousElementSibling).fill);
    if (own) found.push(["text", knob ? contrast(parse(style.fill), knob) : worst(style.color, element), name]);
    if (element.matches("select, input[type=number], input[type=color]"))
      found.push(["edge", worst(style.borderTopColor, element.parentElement), name]);
    if (element.matches("[role=switch]")) found.push(["switch", worst(style.backgroundColor, element.parentElement), name]);
  }
  return found;
}
