// Paints points with WebGL 2. A point is a disc along the surface. The nearer of two centers wins, so that labels meet in clean
// borders.
'use strict';

const VERTEX = `#version 300 es
  layout(location = 0) in vec2 corner;
  layout(location = 1) in vec3 position;
  layout(location = 2) in vec3 normal;
  layout(location = 3) in vec4 color;
  uniform mat3 turn;
  uniform vec2 scale;
  uniform vec2 shift;
  uniform float radius;
  out vec2 at;
  out vec3 paint;
  out float behind;
  void main() {
    vec3 n = turn * normal;
    vec3 side = normalize(cross(n, abs(n.z) < 0.9 ? vec3(0, 0, 1) : vec3(0, 1, 0)));
    vec3 p = turn * position + radius * (corner.x * side + corner.y * cross(n, side));
    bool away = n.z < 0.0;
    vec3 facing = away ? -n : n;
    float light = 0.5 + 0.36 * max(dot(facing, normalize(vec3(-0.45, 0.75, 0.6))), 0.0) + 0.2 * facing.z;
    paint = color.rgb * (away ? 0.55 : 1.0) * light;
    behind = away ? 1.0 : 0.0;
    at = corner;
    gl_Position = vec4(p.xy * scale + shift, -0.5 * p.z, 1);
  }`;
const FRAGMENT = `#version 300 es
  precision highp float;
  in vec2 at;
  in vec3 paint;
  in float behind;
  uniform float radius;
  out vec4 pixel;
  void main() {
    float d = dot(at, at);
    if (d > 1.0) discard;
    gl_FragDepth = clamp(gl_FragCoord.z + radius * (0.12 * d + 0.1 * behind), 0.0, 1.0);
    pixel = vec4(paint, 1);
  }`;

class Painter {
  constructor(canvas) {
    this.canvas = canvas;
    const gl = canvas.getContext('webgl2', { alpha: true, antialias: true, preserveDrawingBuffer: true });
    this.gl = gl;
    if (!gl) return;
    const program = gl.createProgram();
    for (const [type, source] of [[gl.VERTEX_SHADER, VERTEX], [gl.FRAGMENT_SHADER, FRAGMENT]]) {
      const shader = gl.createShader(type);
      gl.shaderSource(shader, source);
      gl.compileShader(shader);
      gl.attachShader(program, shader);
    }
    gl.linkProgram(program);
    if (!gl.getProgramParameter(program, gl.LINK_STATUS)) throw new Error(`the view: ${gl.getProgramInfoLog(program)}`);
    gl.useProgram(program);
    this.at = Object.fromEntries(['turn', 'scale', 'shift', 'radius'].map((name) => [name, gl.getUniformLocation(program, name)]));
    gl.enable(gl.DEPTH_TEST);
    gl.enable(gl.SCISSOR_TEST);
    this.buffers = [0, 1, 2, 3].map(() => gl.createBuffer());
    this.fill(0, new Float32Array([-1, -1, 1, -1, -1, 1, 1, 1]), 2, gl.FLOAT, false, 0);
  }

  fill(location, values, size, type, normalized, divisor) {
    const { gl } = this;
    gl.bindBuffer(gl.ARRAY_BUFFER, this.buffers[location]);
    gl.bufferData(gl.ARRAY_BUFFER, values, gl.DYNAMIC_DRAW);
    gl.enableVertexAttribArray(location);
    gl.vertexAttribPointer(location, size, type, normalized, 0, 0);
    gl.vertexAttribDivisor(location, divisor);
  }

  /** Empties the canvas, which has this many pixels from now on. */
  clear(width, height) {
    const { gl, canvas } = this;
    if (canvas.width !== width || canvas.height !== height) [canvas.width, canvas.height] = [width, height];
    gl.scissor(0, 0, width, height);
    gl.clear(gl.COLOR_BUFFER_BIT | gl.DEPTH_BUFFER_BIT);
  }

  /** Paints points into a rectangle of the canvas: left, bottom, width and height in pixels. */
  paint(points, colors, camera, [left, bottom, width, height]) {
    const { gl } = this;
    if (this.points !== points) {
      this.points = points;
      this.fill(1, points.positions, 3, gl.FLOAT, false, 1);
      this.fill(2, points.normals, 3, gl.FLOAT, false, 1);
    }
    this.fill(3, colors, 4, gl.UNSIGNED_BYTE, true, 1);
    gl.viewport(left, bottom, width, height);
    gl.scissor(left, bottom, width, height);
    const [r, u, e] = axesOf(camera);
    const scale = scaleOf(points, camera, width, height);
    gl.uniformMatrix3fv(this.at.turn, false, [r[0], u[0], e[0], r[1], u[1], e[1], r[2], u[2], e[2]]);
    gl.uniform2f(this.at.scale, scale[0], scale[1]);
    gl.uniform2f(this.at.shift, camera.x * points.reach * scale[0], camera.y * points.reach * scale[1]);
    gl.uniform1f(this.at.radius, shapes[points.index].r);
    gl.drawArraysInstanced(gl.TRIANGLE_STRIP, 0, 4, points.n);
  }
}
