// What a tab keeps when its page is loaded again: which scene it shows, and from where.
import { read, write } from "./stored.js";

const KEY = "octree-render";

// Where it cannot be kept the page begins anew.
export const remember = (kept) => write("sessionStorage", KEY, kept);
export const remembered = () => read("sessionStorage", KEY);

// Whether a page goes on with the same scene of the same server.
export const continues = (before, scene) => before?.name === scene.name && before.server === scene.server;

// The name of a scene, its server, its own camera, and the one that it is seen by; null for no scene.
export const kept = (scene, camera) =>
  scene && { name: scene.name, server: scene.server, own: scene.camera, camera: camera.state };

// Whether the camera of `before` is to stay for `scene`: not where its file has another one now.
export const stays = (before, scene) =>
  before?.name === scene.name && JSON.stringify(before.own) === JSON.stringify(scene.camera);
