// Faces of boxes as panes of tinted glass, brighter towards their rims.
import { layInstancesOut, program } from "./program.js";

// Bytes a box: two corners and a colour (RGBA).
const STRIDE = 28;

const VERTEX = `#version 300 es
layout(location = 0) in vec3 lower;
layout(location = 1) in vec3 upper;
layout(location = 2) in vec4 box_color;
uniform mat4 clip;
out vec2 place;
flat out vec4 pane;
const vec2 CORNERS[6] = vec2[](vec2(0, 0), vec2(1, 0), vec2(1, 1), vec2(0, 0), vec2(1, 1), vec2(0, 1));

void main() {
  int axis = gl_VertexID / 12;
  place = CORNERS[gl_VertexID % 6];
  vec3 share;
  share[axis] = float(gl_VertexID / 6 % 2);
  share[(axis + 1) % 3] = place.x;
  share[(axis + 2) % 3] = place.y;
  pane = box_color;
  gl_Position = clip * vec4(mix(lower, upper, share), 1.0);
}`;

const FRAGMENT = `#version 300 es
precision highp float;
in vec2 place;
flat in vec4 pane;
out vec4 color;

void main() {
  vec2 inwards = min(place, 1.0 - place);
  float rim = exp(-9.0 * min(inwards.x, inwards.y));
  float alpha = pane.a * (0.35 + 0.65 * rim);
  color = vec4(pane.rgb * alpha, alpha);
}`;

// Boxes to be drawn: the numbers are collected once and uploaded when they changed.
export class BoxSet {
  constructor(capacity) {
    const bytes = new ArrayBuffer(capacity * STRIDE);
    Object.assign(this, { bytes, floats: new Float32Array(bytes), colors: new Uint8Array(bytes), count: 0 });
  }

  // `color` is [r, g, b, a] in bytes.
  add(lower, upper, color) {
    const word = (this.count * STRIDE) / 4;
    this.floats.set(lower, word);
    this.floats.set(upper, word + 3);
    this.colors.set(color, this.count * STRIDE + 24);
    this.count++;
  }

  // The boxes' corners, lower and upper: six numbers each.
  get corners() {
    const corners = new Float32Array(6 * this.count);
    for (let i = 0; i < this.count; i++) corners.set(this.floats.subarray((i * STRIDE) / 4, (i * STRIDE) / 4 + 6), 6 * i);
    return corners;
  }
}

export class Boxes {
  constructor(gl) {
    this.gl = gl;
    this.vertices = gl.createVertexArray();
    this.buffer = gl.createBuffer();
  }

  upload(set) {
    const { gl } = this;
    this.set = set;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffer);
    gl.bufferData(gl.ARRAY_BUFFER, set.bytes, gl.STATIC_DRAW);
    const layout = [[3, gl.FLOAT, false, 0], [3, gl.FLOAT, false, 12], [4, gl.UNSIGNED_BYTE, true, 24]];
    layInstancesOut(gl, STRIDE, layout);
  }

  // Draw what the model does not hide of `set`, by `clip` (world to clip space).
  draw(set, clip) {
    if (!set.count) return;
    const { gl } = this;
    this.shaders ??= program(gl, VERTEX, FRAGMENT);
    const { linked, uniforms } = this.shaders;
    gl.useProgram(linked);
    gl.bindVertexArray(this.vertices);
    if (set !== this.set) this.upload(set);
    gl.uniformMatrix4fv(uniforms.clip, false, clip);
    gl.enable(gl.BLEND);
    gl.blendFunc(gl.ONE, gl.ONE_MINUS_SRC_ALPHA);
    gl.depthMask(false);
    gl.drawArraysInstanced(gl.TRIANGLES, 0, 36, set.count);
    gl.depthMask(true);
    gl.disable(gl.BLEND);
  }
}
