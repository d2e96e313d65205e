// A link to what lies in closed sections opens them.
const reveal = () => {
  const target = document.getElementById(decodeURIComponent(location.hash.slice(1)));
  for (let place = target; place; place = place.parentElement) if (place.tagName === "DETAILS") place.open = true;
  target?.scrollIntoView();
};
addEventListener("hashchange", reveal);
reveal();
const cell = (row, text, tag = "td") => { row.appendChild(document.createElement(tag)).textContent = text; };
const line = (table, texts, tag) => { const row = table.insertRow(); for (const text of texts) cell(row, text, tag); };
const rays = (heading, way) => {
  const table = document.createElement("table");
  line(table, [heading, "from", "along", "hits face", "at t", "share", "spawns", "lights"], "th");
  for (const ray of way) {
    const lights = Object.entries(ray.lights).map(([light, seen]) => `${light} ${seen}`).join(", ");
    const hit = ray.face < 0 ? ["none", ""] : [ray.face, ray.t];
    line(table, [ray.kind, ray.origin.join(" "), ray.direction.join(" "), ...hit, ray.share.join(" "), ray.spawned.join(", "), lights]);
  }
  return table;
};
for (const reasons of document.querySelectorAll(".reasons")) {
  const map = reasons.querySelector(".map"), ways = reasons.querySelector(".ways");
  const pixels = JSON.parse(reasons.querySelector("script").textContent);
  const [width, height] = map.dataset.size.split(" ").map(Number);
  map.addEventListener("click", (event) => {
    const frame = map.getBoundingClientRect();
    const x = (event.clientX - frame.left) / frame.width * width, y = (event.clientY - frame.top) / frame.height * height;
    const off = (pixel) => Math.hypot(pixel.column + 0.5 - x, pixel.row + 0.5 - y);
    const pixel = pixels.reduce((best, one) => best && off(best) <= off(one) ? best : one, null);
    if (!pixel) { ways.textContent = "No pixel differs here."; return; }
    const said = document.createElement("p");
    said.textContent = `Row ${pixel.row}, column ${pixel.column}, ${pixel.offset} offset: ${pixel.reason}. `
      + `Ours ${pixel.colors[0].map((c) => c.toFixed(4)).join(" ")}, theirs ${pixel.colors[1].map((c) => c.toFixed(4)).join(" ")}. `
      + pixel.found.join("; ");
    ways.replaceChildren(said, rays("ours", pixel.ours), rays("theirs", pixel.theirs));
  });
}
