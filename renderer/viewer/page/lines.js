// Lines of any width over the model: each is a quad in the film's plane with round ends, a dark rim and soft edges.
import { layInstancesOut, program } from "./program.js";

// Bytes a line: two points, colour (RGBA), width and dash in pixels.
const STRIDE = 36;

const VERTEX = `#version 300 es
layout(location = 0) in vec3 start;
layout(location = 1) in vec3 end;
layout(location = 2) in vec4 line_color;
layout(location = 3) in vec2 line_style;
uniform mat4 clip;
uniform vec2 half_film;
uniform vec2 fade; // distances where lines begin to fade and where they are faintest
out vec2 place;
out float across;
flat out float length_;
flat out vec4 color_;
flat out vec2 style;

void main() {
  vec4 a = clip * vec4(start, 1.0), b = clip * vec4(end, 1.0);
  float near = 0.02 * fade.x;
  gl_Position = vec4(2.0, 2.0, 2.0, 1.0);
  if (a.w < near && b.w < near) return;
  if (a.w < near) a = mix(a, b, (near - a.w) / (b.w - a.w));
  if (b.w < near) b = mix(b, a, (near - b.w) / (a.w - b.w));
  vec2 p = a.xy / a.w * half_film, q = b.xy / b.w * half_film;
  length_ = distance(p, q);
  vec2 along = length_ > 1e-4 ? (q - p) / length_ : vec2(1.0, 0.0);
  float radius = 0.5 * line_style.x + 1.5;
  bool at_end = gl_VertexID == 1 || gl_VertexID == 2 || gl_VertexID == 4;
  float side = gl_VertexID == 2 || gl_VertexID == 4 || gl_VertexID == 5 ? 1.0 : -1.0;
  place = vec2(at_end ? length_ + radius : -radius, side * radius);
  vec4 own = at_end ? b : a;
  vec2 film = (at_end ? q : p) + along * (at_end ? radius : -radius) + vec2(-along.y, along.x) * place.y;
  across = mix(1.0, 0.3, smoothstep(fade.x, fade.y, own.w));
  color_ = line_color;
  style = line_style;
  // w is 1, so that everything is interpolated along the film and not along the depth.
  gl_Position = vec4(film / half_film, own.z / own.w, 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec2 place;
in float across;
flat in float length_;
flat in vec4 color_;
flat in vec2 style;
uniform float strength;
out vec4 color;

void main() {
  if (style.y > 0.0 && fract(place.x / style.y) > 0.55) discard;
  float away = distance(place, vec2(clamp(place.x, 0.0, length_), 0.0)) - 0.5 * style.x;
  float core = clamp(0.5 - away, 0.0, 1.0);
  // Thin lines come in crowds, where dark rims would add up to a veil.
  float rim = 0.5 * clamp(style.x - 1.0, 0.0, 1.0) * clamp(1.5 - away, 0.0, 1.0);
  float alpha = color_.a * strength * across;
  color = vec4(color_.rgb * core, core + rim * (1.0 - core)) * alpha;
}`;

// Lines to be drawn: the numbers are collected once and uploaded when they changed.
export class LineSet {
  constructor(capacity = 64) {
    this.reserve(capacity);
    this.count = 0;
  }

  reserve(capacity) {
    const bytes = new ArrayBuffer(capacity * STRIDE);
    if (this.bytes) new Uint8Array(bytes).set(new Uint8Array(this.bytes));
    Object.assign(this, { capacity, bytes, floats: new Float32Array(bytes), colors: new Uint8Array(bytes) });
  }

  // `color` is [r, g, b, a] in bytes, `width` and `dash` (0: none) are pixels.
  add(start, end, color, width, dash = 0) {
    if (this.count === this.capacity) this.reserve(2 * this.capacity);
    const word = (this.count * STRIDE) / 4;
    this.floats.set(start, word);
    this.floats.set(end, word + 3);
    this.colors.set(color, this.count * STRIDE + 24);
    this.floats[word + 7] = width;
    this.floats[word + 8] = dash;
    this.count++;
  }

  // The twelve edges of the box from `lower` to `upper`.
  addBox(lower, upper, color, width) {
    const corner = (i) => [0, 1, 2].map((axis) => ((i >> axis) & 1 ? upper : lower)[axis]);
    for (let i = 0; i < 8; i++)
      for (let axis = 0; axis < 3; axis++)
        if (!((i >> axis) & 1)) this.add(corner(i), corner(i | (1 << axis)), color, width);
  }
}

export class Lines {
  constructor(gl) {
    this.gl = gl;
    this.uploaded = new Map();
    this.film = [1, 1]; // in CSS pixels, the unit of widths
  }

  // The buffer and vertex array of `name`, filled anew when `set` is another one.
  arrays(name, set) {
    const { gl } = this;
    const own = this.uploaded.get(name) ?? { vertices: gl.createVertexArray(), buffer: gl.createBuffer() };
    if (own.set === set) return own.vertices;
    this.uploaded.set(name, Object.assign(own, { set }));
    gl.bindVertexArray(own.vertices);
    gl.bindBuffer(gl.ARRAY_BUFFER, own.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, new Uint8Array(set.bytes, 0, set.count * STRIDE), gl.STATIC_DRAW);
    const layout = [[3, gl.FLOAT, false, 0], [3, gl.FLOAT, false, 12], [4, gl.UNSIGNED_BYTE, true, 24], [2, gl.FLOAT, false, 28]];
    layInstancesOut(gl, STRIDE, layout);
    return own.vertices;
  }

  // Draw `set`: what the model hides by the share `hidden`, the rest in full. `fade` as in the shader.
  draw(name, set, clip, fade, hidden) {
    if (!set.count) return;
    const { gl } = this;
    this.shaders ??= program(gl, VERTEX, FRAGMENT);
    const { linked, uniforms } = this.shaders;
    gl.useProgram(linked);
    gl.bindVertexArray(this.arrays(name, set));
    gl.uniformMatrix4fv(uniforms.clip, false, clip);
    gl.uniform2f(uniforms.half_film, this.film[0] / 2, this.film[1] / 2);
    gl.uniform2fv(uniforms.fade, fade);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    for (const [comparison, strength] of [[gl.GREATER, hidden], [gl.LEQUAL, 1]]) {
      gl.depthFunc(comparison);
      gl.uniform1f(uniforms.strength, strength);
      gl.drawArraysInstanced(gl.TRIANGLES, 0, 6, set.count);
    }
    gl.depthMask(true);
    gl.depthFunc(gl.LESS);
    gl.disable(gl.BLEND);
  }
}
