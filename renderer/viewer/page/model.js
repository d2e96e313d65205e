// The scene's triangles in WebGL: lit as OpenGL would, or in one given colour a face.
import { program } from "./program.js";

const MAGIC = 0x4853454d;
// Values of each face stand in textures of this width, which every WebGL2 offers.
const COLUMNS = 2048;
const MAX_LIGHTS = 8;
// Texels a material: diffuse and shininess, specular and kind, reflectance, transmittance.
const TEXELS = 4;
const KINDS = { phong: 0, mirror: 1, dielectric: 2 };

export const LIT = 0;
export const FACES = 1;
export const DEPTH = 2;

// Each shading is a program of its own, so that none moves values which it does not look at.
const source = (shading, text) => `#version 300 es
#define LIT ${LIT}
#define FACES ${FACES}
#define SHADING ${shading}
precision highp float;
${text}`;

const VERTEX = `
layout(location = 0) in vec3 position;
uniform mat4 clip;
#if SHADING == LIT || SHADING == FACES
layout(location = 1) in vec3 normal;
uniform highp usampler2D materials_of;
out vec3 point;
out vec3 shading_normal;
flat out int material;
#endif
#if SHADING == FACES
uniform sampler2D face_colors;
flat out vec3 face_color;
#endif

void main() {
#if SHADING == LIT || SHADING == FACES
  int face = gl_VertexID / 3;
  ivec2 texel = ivec2(face % ${COLUMNS}, face / ${COLUMNS});
  material = int(texelFetch(materials_of, texel, 0).r);
  point = position;
  shading_normal = normal;
#endif
#if SHADING == FACES
  face_color = texelFetch(face_colors, texel, 0).rgb;
#endif
  gl_Position = clip * vec4(position, 1.0);
}`;

// Mirrors and glass have no diffuse colour: a mirror is shown as polished metal in its reflectance, glass as a tinted
// film that lets the scene behind it through.
const FRAGMENT = `
uniform vec4 veil; // premultiplied
out vec4 color;

#if SHADING == LIT || SHADING == FACES
in vec3 point;
in vec3 shading_normal;
flat in int material;
uniform bool glass;
uniform vec3 eye;
uniform sampler2D materials;
#endif
#if SHADING == FACES
flat in vec3 face_color;
#elif SHADING == LIT
uniform vec3 ambient;
uniform vec3 background;
uniform int light_count;
uniform vec4 light_places[${MAX_LIGHTS}]; // w 0: towards the light; w 1: its position
uniform vec3 light_colors[${MAX_LIGHTS}];

vec3 srgb(vec3 linear) {
  vec3 x = clamp(linear, 0.0, 1.0);
  return mix(12.92 * x, 1.055 * pow(x, vec3(1.0 / 2.4)) - 0.055, step(0.0031308, x));
}

vec3 lit(vec3 n, vec3 v, vec4 specular) {
  vec4 diffuse = texelFetch(materials, ivec2(0, material), 0);
  vec3 kd = diffuse.rgb, ks = specular.rgb, sum = ambient * kd;
  float shininess = diffuse.w;
  if (specular.w != 0.0) {
    vec3 reflectance = texelFetch(materials, ivec2(2, material), 0).rgb;
    vec3 transmittance = texelFetch(materials, ivec2(3, material), 0).rgb;
    vec3 around = mix(background * 0.45, background, smoothstep(-0.2, 0.5, reflect(-v, n).y));
    sum = specular.w == 1.0 ? reflectance * around * 0.8 : transmittance * background * 0.9;
    ks = vec3(0.5);
    shininess = 90.0;
  }
  for (int i = 0; i < light_count; i++) {
    vec3 l = light_places[i].xyz - point * light_places[i].w;
    vec3 arriving = light_colors[i] / mix(1.0, dot(l, l), light_places[i].w);
    l = normalize(l);
    float cosine = max(dot(n, l), 0.0);
    float highlight = cosine > 0.0 ? pow(max(dot(2.0 * cosine * n - l, v), 1e-6), shininess) : 0.0;
    sum += (kd * cosine + ks * highlight) * arriving;
  }
  return srgb(sum);
}
#endif

void main() {
#if SHADING == LIT || SHADING == FACES
  vec4 specular = texelFetch(materials, ivec2(1, material), 0);
  if ((specular.w == 2.0) != glass) discard;
  vec3 v = normalize(eye - point);
  vec3 n = normalize(shading_normal);
  n = dot(n, v) < 0.0 ? -n : n;
  float alpha = glass ? 0.28 + 0.6 * pow(1.0 - dot(n, v), 3.0) : 1.0;
#endif
#if SHADING == LIT
  color = vec4((lit(n, v, specular) * (1.0 - veil.a) + veil.rgb) * alpha, alpha);
#elif SHADING == FACES
  color = vec4((face_color * (1.0 - veil.a) + veil.rgb) * alpha, alpha);
#else
  color = veil;
#endif
}`;

export class Model {
  constructor(gl) {
    this.gl = gl;
    this.programs = []; // by shading, each made when it is first needed
    this.vertices = gl.createVertexArray();
    this.buffers = [gl.createBuffer(), gl.createBuffer()];
    this.textures = [0, 1, 2].map(() => gl.createTexture());
    this.faces = 0;
  }

  // Take the triangles of the server's /mesh and the materials of its /scene.
  load(buffer, scene) {
    const [magic, faces] = new Uint32Array(buffer, 0, 2);
    if (magic !== MAGIC) throw new Error("mesh: expected the renderer's format");
    const { gl } = this;
    this.faces = faces;
    this.rows = Math.max(Math.ceil(faces / COLUMNS), 1);
    this.coloured = false;
    gl.bindVertexArray(this.vertices);
    for (const location of [0, 1]) {
      gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[location]);
      gl.bufferData(gl.ARRAY_BUFFER, new Float32Array(buffer, 8 + 36 * faces * location, 9 * faces), gl.STATIC_DRAW);
      gl.enableVertexAttribArray(location);
      gl.vertexAttribPointer(location, 3, gl.FLOAT, false, 0, 0);
    }
    const indices = new Uint16Array(COLUMNS * this.rows);
    indices.set(new Uint16Array(buffer, 8 + 72 * faces, faces));
    this.texture(0, gl.R16UI, COLUMNS, this.rows, gl.RED_INTEGER, gl.UNSIGNED_SHORT, indices);
    this.texture(1, gl.RGB8, COLUMNS, this.rows, gl.RGB, gl.UNSIGNED_BYTE, null);
    const rows = new Float32Array(scene.materials.flatMap(texels));
    this.texture(2, gl.RGBA32F, TEXELS, scene.materials.length, gl.RGBA, gl.FLOAT, rows);
    this.hasGlass = scene.materials.some((m) => m.type === "dielectric");
  }

  texture(unit, format, width, height, layout, type, values) {
    const { gl } = this;
    gl.activeTexture(gl.TEXTURE0 + unit);
    gl.bindTexture(gl.TEXTURE_2D, this.textures[unit]);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    gl.texImage2D(gl.TEXTURE_2D, 0, format, width, height, 0, layout, type, values);
    for (const name of [gl.TEXTURE_MIN_FILTER, gl.TEXTURE_MAG_FILTER])
      gl.texParameteri(gl.TEXTURE_2D, name, gl.NEAREST);
  }

  // Colours of the faces, three bytes each; those of another scene are left alone.
  setFaceColors(bytes) {
    if (bytes.length !== 3 * this.faces) return;
    const { gl } = this;
    const whole = Math.floor(this.faces / COLUMNS);
    const rest = this.faces - whole * COLUMNS;
    const values = new Uint8Array(bytes.buffer, bytes.byteOffset, bytes.length);
    gl.activeTexture(gl.TEXTURE1);
    gl.bindTexture(gl.TEXTURE_2D, this.textures[1]);
    gl.pixelStorei(gl.UNPACK_ALIGNMENT, 1);
    const part = (row, width, height, start) =>
      gl.texSubImage2D(gl.TEXTURE_2D, 0, 0, row, width, height, gl.RGB, gl.UNSIGNED_BYTE, values.subarray(start));
    if (whole) part(0, COLUMNS, whole, 0);
    if (rest) part(whole, rest, 1, whole * COLUMNS * 3);
    this.coloured = true;
  }

  // Draw by `clip` (world to clip space); `appearance` is {scene, direction or null, veil}.
  draw(shading, clip, eye, appearance) {
    const { gl } = this;
    const seen = shading === FACES && !this.coloured ? LIT : shading;
    this.programs[seen] ??= program(gl, source(seen, VERTEX), source(seen, FRAGMENT));
    const { linked, uniforms } = this.programs[seen];
    gl.useProgram(linked);
    gl.bindVertexArray(this.vertices);
    gl.uniformMatrix4fv(uniforms.clip, false, clip);
    gl.uniform4fv(uniforms.veil, appearance.veil);
    if (seen !== DEPTH) this.bindTextures(uniforms);
    if (seen !== DEPTH) gl.uniform3fv(uniforms.eye, eye);
    if (seen === LIT) this.setLights(uniforms, appearance);
    gl.enable(gl.POLYGON_OFFSET_FILL); // so that lines on a surface are seen
    gl.polygonOffset(1, 1);
    gl.drawArrays(gl.TRIANGLES, 0, 3 * this.faces);
    if (this.hasGlass && seen !== DEPTH) this.drawGlass(uniforms);
    gl.disable(gl.POLYGON_OFFSET_FILL);
  }

  bindTextures(uniforms) {
    const { gl } = this;
    this.textures.forEach((texture, unit) => {
      gl.activeTexture(gl.TEXTURE0 + unit);
      gl.bindTexture(gl.TEXTURE_2D, texture);
    });
    gl.uniform1i(uniforms.materials_of, 0);
    gl.uniform1i(uniforms.face_colors ?? null, 1);
    gl.uniform1i(uniforms.materials, 2);
    gl.uniform1i(uniforms.glass, 0);
  }

  drawGlass(uniforms) {
    const { gl } = this;
    gl.uniform1i(uniforms.glass, 1);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.drawArrays(gl.TRIANGLES, 0, 3 * this.faces);
    gl.disable(gl.BLEND);
  }

  setLights(uniforms, { scene, direction }) {
    const { gl } = this;
    const lights = scene.lights.slice(0, MAX_LIGHTS);
    const turned = direction ? lights.findIndex((l) => l.type === "directional") : -1;
    const places = lights.flatMap((l, i) => {
      if (l.type !== "directional") return [...l.position, 1];
      return [...(i === turned ? direction : l.direction).map((x) => -x), 0];
    });
    gl.uniform1i(uniforms.light_count, lights.length);
    if (lights.length) {
      gl.uniform4fv(uniforms.light_places, places);
      gl.uniform3fv(uniforms.light_colors, lights.flatMap((l) => l.color));
    }
    gl.uniform3fv(uniforms.ambient, scene.ambient);
    gl.uniform3fv(uniforms.background, scene.background);
  }
}

const texels = (m) => [
  ...m.diffuse, m.shininess,
  ...m.specular, KINDS[m.type],
  ...m.reflectance, 0,
  ...m.transmittance, 0,
];
