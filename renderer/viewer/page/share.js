// One HTML file that shows what the page shows, without a server: the picture, the model, boxes and rays.
import { encoded, dataUrl } from "./base64.js";
import { element, heading } from "./element.js";
import { fetchFrom } from "./connection.js";
import { drawing } from "./layers.js";
import { NO_BOXES, NO_RAYS } from "./overlay.js";
import { count } from "./readings.js";

// The most faces of a model in a file: 74 bytes each are 20 MB in base64, 22 with colours, which mail and browsers take.
const MOST_FACES = 200000;
// The module that the file begins with; those that it imports come along. In the file they have this name.
const FIRST = "standalone.js";
const BARE = "octree-render/";
const IMPORT = /\bfrom "\.\/([\w-]+\.js)"/g;
// What the file says of itself as a page: that nothing is fetched, from anywhere.
const POLICY =
  "default-src 'none'; script-src 'unsafe-inline' data:; style-src 'unsafe-inline'; img-src data:; base-uri 'none'; form-action 'none'";
// What of the server's /scene the file needs; it names no other file, and no server.
const TOLD = ["name", "camera", "bounds", "faces", "materials", "lights", "ambient", "background"];

export class Share {
  constructor(viewer) {
    Object.assign(this, { viewer, mostFaces: MOST_FACES });
  }

  // The file as {blob, name, note}; the note says what it lacks, or is empty.
  async file() {
    const { viewer } = this;
    const { dressed: scene } = viewer;
    // At once, before anything moves.
    const { canvas, view, mode } = this.seen();
    const { boxes } = viewer.scenes;
    const known = {
      scene: Object.fromEntries(TOLD.map((key) => [key, scene[key]])),
      view: { m: view.m, fovy: view.fovy, height: view.height, w: canvas.width, h: canvas.height },
      camera: viewer.camera.state,
      mode,
      gain: viewer.layer?.gain ?? 1,
      boxes: { level: boxes.level, levels: boxes.levels, all: boxes.all },
      pick: viewer.rays.shown ? viewer.rays.pick : null,
      object: viewer.rays.shown ? viewer.picking.object.labelOf(viewer.rays.pick) : null,
      note: this.lacks(scene),
    };
    const corners = new Blob([boxes.panes.corners]);
    const [picture, mesh, modules, style, icon] = await Promise.all([
      new Promise((done) => canvas.toBlob(done, "image/png")).then(dataUrl),
      known.note ? new Blob([]) : fetchFrom("mesh", { id: scene.id }).then((answer) => answer.blob()),
      modulesFrom(FIRST),
      Promise.all(["viewer.css", "standalone.css"].map(textOf)),
      fetchFrom("static/icon.svg").then((answer) => answer.blob()).then(dataUrl),
    ]);
    const data = { known, mesh: await encoded(mesh), corners: await encoded(corners) };
    const page = html(scene.name, { picture, icon, modules, style: style.join("\n"), data });
    return { blob: new Blob([page], { type: "text/html" }), name: scene.name.replace(/(\.\w+)?$/, ".html"), note: known.note };
  }

  lacks({ faces }) {
    if (faces <= this.mostFaces) return "";
    return `The model has ${count(faces)} faces, more than the ${count(this.mostFaces)} that a file holds: the picture alone.`;
  }

  // A canvas with what is seen, but for boxes and rays; its view and the name of its mode.
  seen() {
    const { viewer } = this;
    const name = document.querySelector(`[name=mode][value=${viewer.mode}]`).parentElement.textContent.slice(1);
    const { current, shown } = viewer.traced;
    if (current || (shown && !viewer.layer?.loaded)) return { canvas: viewer.picture.canvas, view: shown.view, mode: name };
    if (!viewer.layer?.loaded) throw new Error("there is no picture yet");
    const { canvas } = viewer.layer;
    const copy = element("canvas", { width: canvas.width, height: canvas.height });
    viewer.layer.draw(viewer.view(), drawing(viewer.frames.shading, NO_BOXES, NO_RAYS));
    copy.getContext("2d").drawImage(canvas, 0, 0);
    viewer.frames.draw();
    return { canvas: copy, view: viewer.view(), mode: viewer.mode === "phong" ? name : "Preview" };
  }
}

const textOf = async (name) => (await fetchFrom(`static/${name}`)).text();

// The page's module `first` and all that it imports, by their bare names as data URLs. Modules with data URLs have no
// place that "./x.js" could be meant from.
async function modulesFrom(first) {
  const found = {};
  const take = async (name) => {
    if (found[BARE + name]) return;
    found[BARE + name] = " ";
    const text = await textOf(name);
    const bare = text.replace(IMPORT, `from "${BARE}$1"`);
    found[BARE + name] = `data:text/javascript;charset=utf-8,${encodeURIComponent(bare)}`;
    await Promise.all([...text.matchAll(IMPORT)].map(([, imported]) => take(imported)));
  };
  await take(first);
  return found;
}

// Text in HTML; and JSON in a script element, which "</script>" and "<!--" would end or open.
const escaped = (text) => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll('"', "&quot;");
const json = (value) => JSON.stringify(value).replaceAll("<", "\\u003c");

const html = (name, { picture, icon, modules, style, data }) => `<!doctype html>
<html lang="en">
<head>
<meta charset="utf-8">
<meta http-equiv="Content-Security-Policy" content="${POLICY}">
<meta name="viewport" content="width=device-width, initial-scale=1">
<meta name="color-scheme" content="dark light">
<title>${escaped(name)} · octree-render</title>
<link rel="icon" href="${icon}">
<style>
${style.replaceAll("</", "<\\/")}
</style>
<script type="importmap">${json({ imports: modules })}</script>
</head>
<body>
<header>
  <img class="logo" src="${icon}" alt="" width="26" height="26">
  <h1 id="name" class="${heading(name).className}">${escaped(heading(name).textContent)}</h1>
  <fieldset class="modes" id="shows">
    <legend class="unseen">Show</legend>
    <label><input type="radio" name="shows" value="picture" checked><span><kbd>1</kbd>Picture</span></label>
    <label><input type="radio" name="shows" value="model"><span><kbd>2</kbd>Model</span></label>
  </fieldset>
</header>
<main>
  <div id="stage" tabindex="0" role="application"
       aria-label="Picture. Arrow keys orbit the model, plus and minus zoom, 1 shows the picture, 2 the model.">
    <div id="frame">
      <img id="picture" src="${picture}" alt="The picture of ${escaped(name)}">
      <canvas id="gl"></canvas>
    </div>
    <p class="hud" id="hud"></p>
  </div>
  <section class="card" id="card" aria-label="The picked ray" hidden></section>
</main>
<footer>
  <label class="switch"><span>Boxes</span><input type="checkbox" id="boxes" role="switch"></label>
  <label class="switch"><span>Ray</span><input type="checkbox" id="rays" role="switch"></label>
  <button type="button" id="reset">Reset</button>
  <button type="button" id="fit">Fit</button>
  <p class="note" id="note" role="status"></p>
</footer>
<script type="application/json" id="known">${json(data.known)}</script>
<script type="text/plain" id="mesh">${data.mesh}</script>
<script type="text/plain" id="corners">${data.corners}</script>
<script type="module">import "${BARE}${FIRST}";</script>
</body>
</html>
`;
