// Shaders compiled and their uniforms found, and the attributes of instances laid out.

export function program(gl, vertex, fragment) {
  const linked = gl.createProgram();
  for (const [kind, source] of [[gl.VERTEX_SHADER, vertex], [gl.FRAGMENT_SHADER, fragment]]) {
    const shader = gl.createShader(kind);
    gl.shaderSource(shader, source);
    gl.compileShader(shader);
    if (!gl.getShaderParameter(shader, gl.COMPILE_STATUS)) throw new Error(gl.getShaderInfoLog(shader));
    gl.attachShader(linked, shader);
  }
  gl.linkProgram(linked);
  if (!gl.getProgramParameter(linked, gl.LINK_STATUS)) throw new Error(gl.getProgramInfoLog(linked));
  const uniforms = {};
  for (let i = 0; i < gl.getProgramParameter(linked, gl.ACTIVE_UNIFORMS); i++) {
    const { name } = gl.getActiveUniform(linked, i);
    uniforms[name.replace("[0]", "")] = gl.getUniformLocation(linked, name);
  }
  return { linked, uniforms };
}

// Lay the numbers of the bound buffer out as attributes 0, 1, ... of instances that are `stride` bytes apart; `layout`
// has [size, type, normalized, offset] for each.
export function layInstancesOut(gl, stride, layout) {
  layout.forEach(([size, type, normalized, offset], location) => {
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, size, type, normalized, stride, offset);
    gl.vertexAttribDivisor(location, 1);
  });
}
