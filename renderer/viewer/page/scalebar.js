// A bar whose length in the scene is a round number: anywhere for parallel rays, else as far away as the pivot.

// Pixels that it takes at the most.
const WIDEST = 130;

export class ScaleBar {
  constructor(bar) {
    this.bar = bar;
  }

  // Measure a picture that is `height` CSS pixels high.
  show(camera, height) {
    const most = (WIDEST * camera.extent) / height;
    const power = 10 ** Math.floor(Math.log10(most));
    const length = power * [5, 2, 1].find((n) => n * power <= most);
    this.bar.style.width = `${(length * height) / camera.extent}px`;
    const shown = Number(length.toPrecision(1)).toLocaleString("en", { maximumSignificantDigits: 1, notation: length < 1e7 && length > 1e-5 ? "standard" : "scientific" });
    this.bar.textContent = camera.orthographic ? shown : `≈ ${shown}`;
    this.bar.title = camera.orthographic ? "In units of the scene" : "In units of the scene, as far away as the point that the camera turns about";
  }
}
