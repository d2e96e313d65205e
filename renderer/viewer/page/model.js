// The scene's triangles in WebGL: lit as OpenGL would, or in one given colour a face.
import { program } from "./program.js";

const MAGIC = 0x4853454d;
export const MAX_LIGHTS = 8;
// Texels a material: diffuse and shininess, specular and kind, reflectance, transmittance, emission.
const TEXELS = 5;
const KINDS = { phong: 0, mirror: 1, dielectric: 2 };

// Attributes of a corner. What belongs to a face, WebGL takes from the face's last corner.
const [POSITION, NORMAL, MATERIAL, COLOR] = [0, 1, 2, 3];
const LAST = 2;
// The positions of the two corners before a corner: of the last one, all that its face's normal takes.
const [BEFORE, FIRST] = [4, 5];
// The colour of a corner, in scenes that have any.
const TINT = 6;
// Bytes of a position.
const POINT = 12;

export const LIT = 0;
export const FACES = 1;
export const DEPTH = 2;
export const FLAT = 3;
export const WIREFRAME = 4;

export const LIGHTED = [LIT, FLAT, WIREFRAME];

// Each shading of what is opaque and of glass is a program of its own, so that none moves values it does not look at:
// software GL, and whoever has only that, spends its time on the values of corners.
const source = (shading, glass, tinted, text) => `#version 300 es
#define LIT ${LIT}
#define FACES ${FACES}
#define FLAT ${FLAT}
#define WIREFRAME ${WIREFRAME}
#define LIGHTED ${Number(LIGHTED.includes(shading))}
#define SHADING ${shading}
#define GLASS ${Number(glass)}
#define TINTED ${Number(tinted)}
precision highp float;
precision highp int;
${text}`;

const VERTEX = `
layout(location = ${POSITION}) in vec3 position;
uniform mat4 clip;
#if LIGHTED || GLASS
layout(location = ${NORMAL}) in vec3 normal;
out vec3 point;
out vec3 shading_normal;
#endif
#if SHADING == FLAT
layout(location = ${BEFORE}) in vec3 before;
layout(location = ${FIRST}) in vec3 first;
flat out vec3 face_normal;
#elif SHADING == WIREFRAME
out vec3 corner;
#endif
#if LIGHTED
layout(location = ${MATERIAL}) in uint material_of_face;
flat out uint material;
#if TINTED
layout(location = ${TINT}) in vec3 encoded_tint; // sRGB
out vec3 tint;
#endif
#elif SHADING == FACES
layout(location = ${COLOR}) in vec3 color_of_face;
flat out vec3 face_color;
#endif

void main() {
#if LIGHTED || GLASS
  point = position;
  shading_normal = normal;
#endif
#if SHADING == FLAT
  face_normal = cross(normalize(before - first), normalize(position - first));
#elif SHADING == WIREFRAME
  corner = vec3(equal(ivec3(gl_VertexID % 3), ivec3(0, 1, 2)));
#endif
#if LIGHTED
  material = material_of_face;
#if TINTED
  tint = mix(encoded_tint / 12.92, pow((encoded_tint + 0.055) / 1.055, vec3(2.4)), step(0.04045, encoded_tint));
#endif
#elif SHADING == FACES
  face_color = color_of_face;
#endif
  gl_Position = clip * vec4(position, 1.0);
}`;

// Mirrors and glass have no diffuse colour: a mirror is shown as polished metal in its reflectance, glass as a tinted
// film that lets the scene behind it through.
const FRAGMENT = `
uniform vec4 veil; // premultiplied
out vec4 color;

#if LIGHTED || GLASS
in vec3 point;
in vec3 shading_normal;
uniform vec3 eye;
#endif
#if SHADING == FLAT
flat in vec3 face_normal;
#elif SHADING == WIREFRAME
in vec3 corner; // barycentric

// How much of the pixel an edge covers. Where faces are but a few pixels high, their edges fade, or they would hide all.
float edge() {
  vec3 slope = fwidth(corner);
  vec3 pixels = corner / slope;
  float height = 1.0 / min(slope.x, min(slope.y, slope.z));
  return (1.0 - smoothstep(0.3, 1.3, min(pixels.x, min(pixels.y, pixels.z)))) * clamp(height / 8.0, 0.25, 1.0);
}
#endif
#if SHADING == FACES
flat in vec3 face_color;
#elif LIGHTED
flat in uint material;
#if TINTED
in vec3 tint;
#else
const vec3 tint = vec3(1.0);
#endif
uniform sampler2D materials;
uniform vec3 ambient;
uniform vec3 background;
uniform float gain;
uniform int light_count;
uniform vec4 light_places[${MAX_LIGHTS}]; // w 0: towards the light; w 1: its position
uniform vec3 light_colors[${MAX_LIGHTS}];

vec3 srgb(vec3 linear) {
  vec3 x = clamp(linear, 0.0, 1.0);
  return mix(12.92 * x, 1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, x));
}

vec3 lit(vec3 n, vec3 v) {
  int row = int(material);
  vec4 diffuse = texelFetch(materials, ivec2(0, row), 0), specular = texelFetch(materials, ivec2(1, row), 0);
  vec3 kd = diffuse.rgb * tint, ks = specular.rgb, sum = ambient * kd;
  float shininess = diffuse.w;
  if (specular.w != 0.0) {
    vec3 reflectance = texelFetch(materials, ivec2(2, row), 0).rgb;
    vec3 transmittance = texelFetch(materials, ivec2(3, row), 0).rgb;
    vec3 around = mix(background * 0.45, background, smoothstep(-0.2, 0.5, reflect(-v, n).y));
    sum = specular.w == 1.0 ? reflectance * around * 0.8 : transmittance * background * 0.9;
    ks = vec3(0.5);
    shininess = 90.0;
  }
  sum += texelFetch(materials, ivec2(4, row), 0).rgb * tint;
  for (int i = 0; i < light_count; i++) {
    vec3 l = light_places[i].xyz - point * light_places[i].w;
    vec3 arriving = light_colors[i] / mix(1.0, dot(l, l), light_places[i].w);
    l = normalize(l);
    float cosine = max(dot(n, l), 0.0);
    float highlight = cosine > 0.0 ? pow(max(dot(2.0 * cosine * n - l, v), 1e-6), shininess) : 0.0;
    sum += (kd * cosine + ks * highlight) * arriving;
  }
  return srgb(gain * sum);
}
#endif

void main() {
#if LIGHTED || GLASS
  vec3 v = normalize(eye - point);
#if SHADING == FLAT
  vec3 n = normalize(face_normal);
#else
  vec3 n = normalize(shading_normal);
#endif
  n = dot(n, v) < 0.0 ? -n : n;
#endif
#if GLASS
  float alpha = 0.28 + 0.6 * pow(1.0 - dot(n, v), 3.0);
#else
  float alpha = 1.0;
#endif
#if LIGHTED
  vec3 seen = lit(n, v);
#if SHADING == WIREFRAME
  // Dark on what is bright, bright on what is dark.
  float line = edge(), bright = smoothstep(0.25, 0.5, dot(seen, vec3(0.2126, 0.7152, 0.0722)));
  seen = mix(seen, mix(vec3(0.85), vec3(0.04), bright), 0.85 * line);
  alpha = mix(alpha, 1.0, line);
#endif
  color = vec4((seen * (1.0 - veil.a) + veil.rgb) * alpha, alpha);
#elif SHADING == FACES
  color = vec4((face_color * (1.0 - veil.a) + veil.rgb) * alpha, alpha);
#else
  color = veil;
#endif
}`;

export class Model {
  constructor(gl) {
    this.gl = gl;
    this.programs = {}; // each made when it is first needed
    this.vertices = gl.createVertexArray();
    this.buffers = Object.fromEntries([POSITION, NORMAL, MATERIAL, COLOR, TINT].map((location) => [location, gl.createBuffer()]));
    this.materials = gl.createTexture();
    this.clear();
  }

  // Draw nothing until `load`.
  clear() {
    Object.assign(this, { faces: 0, loaded: false, coloured: false, tinted: false, glass: null, materialOf: null, runs: { opaque: [], glass: [] } });
  }

  // Take the triangles of the server's /mesh and the materials of its /scene.
  load(buffer, scene) {
    const [magic, faces] = new Uint32Array(buffer, 0, 2);
    if (magic !== MAGIC) throw new Error("mesh: expected the renderer's format");
    const { gl } = this;
    this.faces = faces;
    this.coloured = false;
    this.colors = new Uint8Array(12 * faces);
    gl.bindVertexArray(this.vertices);
    this.fill(NORMAL, new Float32Array(buffer, 8 + 36 * faces, 9 * faces), gl.STATIC_DRAW);
    gl.vertexAttribPointer(NORMAL, 3, gl.FLOAT, false, 0, 0);
    this.fillPositions(new Float32Array(buffer, 8, 9 * faces));
    const materials = new Uint16Array(buffer, 8 + 72 * faces, faces);
    const ofCorners = new Uint16Array(3 * faces);
    for (let face = 0; face < faces; face++) ofCorners[3 * face + LAST] = materials[face];
    this.fill(MATERIAL, ofCorners, gl.STATIC_DRAW);
    gl.vertexAttribIPointer(MATERIAL, 1, gl.UNSIGNED_SHORT, 0, 0);
    this.fill(COLOR, this.colors, gl.DYNAMIC_DRAW);
    gl.vertexAttribPointer(COLOR, 3, gl.UNSIGNED_BYTE, true, 4, 0);
    this.loadTints(buffer, 8 + 74 * faces + (faces % 2) * 2);
    this.materialOf = materials;
    this.loaded = true;
    this.dress(scene.materials);
  }

  // The colours of corners are behind all else, if there are any.
  loadTints(buffer, first) {
    const { gl } = this;
    this.tinted = buffer.byteLength > first;
    if (!this.tinted) {
      gl.disableVertexAttribArray(TINT);
      return;
    }
    this.fill(TINT, new Uint8Array(buffer, first, 9 * this.faces), gl.STATIC_DRAW);
    gl.vertexAttribPointer(TINT, 3, gl.UNSIGNED_BYTE, true, 0, 0);
  }

  // Take materials, as many as before.
  dress(materials) {
    if (!this.loaded) return;
    const glass = materials.map((m) => m.type === "dielectric");
    if (String(glass) !== this.glass) this.runs = runs(this.materialOf, glass);
    this.glass = String(glass);
    this.setMaterials(materials);
  }

  fill(location, values, usage) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[location]);
    gl.bufferData(gl.ARRAY_BUFFER, values, usage);
    gl.enableVertexAttribArray(location);
  }

  // Behind two that are nowhere, so that the corners before the first are in the buffer, too.
  fillPositions(values) {
    const { gl } = this;
    this.fill(POSITION, 2 * POINT + values.byteLength, gl.STATIC_DRAW);
    gl.bufferSubData(gl.ARRAY_BUFFER, 2 * POINT, values);
    for (const [location, offset] of [[POSITION, 2], [BEFORE, 1], [FIRST, 0]]) {
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, 3, gl.FLOAT, false, 0, offset * POINT);
    }
  }

  setMaterials(materials) {
    const { gl } = this;
    gl.bindTexture(gl.TEXTURE_2D, this.materials);
    const rows = new Float32Array(materials.flatMap(texels));
    gl.texImage2D(gl.TEXTURE_2D, 0, gl.RGBA32F, TEXELS, materials.length, 0, gl.RGBA, gl.FLOAT, rows);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER]) gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
  }

  // Colours of the faces, three bytes each; those of another scene are left alone.
  setFaceColors(bytes) {
    if (bytes.length !== 3 * this.faces) return;
    const { gl, colors } = this;
    for (let face = 0; face < this.faces; face++)
      for (let channel = 0; channel < 3; channel++) colors[4 * (3 * face + LAST) + channel] = bytes[3 * face + channel];
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[COLOR]);
    gl.bufferData(gl.ARRAY_BUFFER, colors, gl.DYNAMIC_DRAW);
    this.coloured = true;
  }

  // Draw by `clip` (world to clip space); `appearance` is {eye, scene, veil, gain}.
  draw(shading, clip, appearance) {
    const { gl } = this;
    const seen = shading === FACES && !this.coloured ? LIT : shading;
    gl.bindVertexArray(this.vertices);
    gl.bindTexture(gl.TEXTURE_2D, this.materials);
    gl.enable(gl.POLYGON_OFFSET_FILL); // so that lines on a surface are seen
    gl.polygonOffset(1, 1);
    this.drawRuns(this.runs.opaque, seen, false, clip, appearance);
    // Where depth alone is wanted, glass hides as much as anything.
    if (seen !== DEPTH) {
      gl.enable(gl.BLEND);
      gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    }
    this.drawRuns(this.runs.glass, seen, seen !== DEPTH, clip, appearance);
    gl.disable(gl.BLEND);
    gl.disable(gl.POLYGON_OFFSET_FILL);
  }

  drawRuns(runs, shading, glass, clip, { eye, scene, veil, gain }) {
    if (!runs.length) return;
    const { gl } = this;
    const kind = [shading, glass, this.tinted];
    this.programs[kind] ??= program(gl, source(...kind, VERTEX), source(...kind, FRAGMENT));
    const { linked, uniforms } = this.programs[kind];
    gl.useProgram(linked);
    gl.uniformMatrix4fv(uniforms.clip, false, clip);
    gl.uniform4fv(uniforms.veil, veil);
    if (uniforms.eye) gl.uniform3fv(uniforms.eye, eye);
    if (LIGHTED.includes(shading)) {
      this.setLights(uniforms, scene);
      gl.uniform1f(uniforms.gain, gain);
    }
    for (const [first, count] of runs) gl.drawArrays(gl.TRIANGLES, 3 * first, 3 * count);
  }

  setLights(uniforms, scene) {
    const { gl } = this;
    const lights = scene.lights.slice(0, MAX_LIGHTS);
    const places = lights.flatMap((l) => (l.type === "directional" ? [...l.direction.map((x) => -x), 0] : [...l.position, 1]));
    gl.uniform1i(uniforms.light_count, lights.length);
    if (lights.length) {
      gl.uniform4fv(uniforms.light_places, places);
      gl.uniform3fv(uniforms.light_colors, lights.flatMap((l) => l.color));
    }
    gl.uniform3fv(uniforms.ambient, scene.ambient);
    gl.uniform3fv(uniforms.background, scene.background);
  }
}

// The runs [first, count] of consecutive faces that are opaque, and of those that are glass.
const runs = (materials, isGlass) => {
  const found = { opaque: [], glass: [] };
  for (let first = 0, end; first < materials.length; first = end) {
    const glass = isGlass[materials[first]];
    for (end = first + 1; end < materials.length && isGlass[materials[end]] === glass; end++);
    found[glass ? "glass" : "opaque"].push([first, end - first]);
  }
  return found;
};

const texels = (m) => [
  ...m.diffuse, m.shininess,
  ...m.specular, KINDS[m.type],
  ...m.reflectance, 0,
  ...m.transmittance, 0,
  ...m.emission, 0,
];
