const root = document.documentElement;
for (const slider of document.querySelectorAll(".slider")) {
  const [range, box] = slider.querySelectorAll("input");
  const layers = slider.querySelector(".layers");
  const place = (at) => { range.value = at; layers.style.setProperty("--at", at + "%"); };
  range.addEventListener("input", () => place(range.value));
  box.addEventListener("change", () => slider.classList.toggle("differs", box.checked));
  const drag = (event) => {
    const frame = layers.getBoundingClientRect();
    if (event.buttons) place(Math.round(100 * Math.min(1, Math.max(0, (event.clientX - frame.left) / frame.width))));
  };
  layers.addEventListener("pointerdown", drag);
  layers.addEventListener("pointermove", drag);
  layers.style.touchAction = "pan-y";
}
const button = document.getElementById("theme");
const dark = () => root.dataset.theme ? root.dataset.theme === "dark" : matchMedia("(prefers-color-scheme: dark)").matches;
const label = () => { button.textContent = dark() ? "light" : "dark"; };
button.hidden = false;
label();
button.addEventListener("click", () => {
  root.dataset.theme = dark() ? "light" : "dark";
  try { localStorage.setItem("theme", root.dataset.theme); } catch (e) {}
  label();
});
