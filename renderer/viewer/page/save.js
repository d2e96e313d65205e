// Files that the page offers for download.
import { element } from "./element.js";

export function download(blob, name) {
  const url = URL.createObjectURL(blob);
  element("a", { href: url, download: name }).click();
  // The browser has opened it by then.
  setTimeout(() => URL.revokeObjectURL(url), 1000);
}

export const saveText = (name, text) => download(new Blob([text], { type: "text/plain" }), name);

// What is seen as a PNG: `canvases` over each other, at the size of the first. Returns the file's name and size, as text.
export function savePicture(canvases, sceneName) {
  const whole = element("canvas", { width: canvases[0].width, height: canvases[0].height });
  const context = whole.getContext("2d");
  for (const canvas of canvases) context.drawImage(canvas, 0, 0, whole.width, whole.height);
  const name = sceneName.replace(/(\.\w+)?$/, ".png");
  whole.toBlob((blob) => download(blob, name), "image/png");
  return `${name}, ${whole.width} × ${whole.height}`;
}

// Whether `text` is on the clipboard now, which a browser may refuse.
export async function copyText(text) {
  try {
    await navigator.clipboard.writeText(text);
    return true;
  } catch {
    return false;
  }
}
