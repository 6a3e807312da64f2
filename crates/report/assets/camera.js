// Turns and fits: an orthographic camera around a shape, whose z is up.
'use strict';

const START = { yaw: -0.65, pitch: 0.5, zoom: 1, x: 0, y: 0 };

/** Rows of the matrix from the shape, whose z is up, to the screen: right, up, and towards the eye. */
function axesOf({ yaw, pitch }) {
  const [sa, ca, se, ce] = [Math.sin(yaw), Math.cos(yaw), Math.sin(pitch), Math.cos(pitch)];
  return [[ca, sa, 0], [-se * sa, se * ca, ce], [ce * sa, -ce * ca, se]];
}

const dot = (axis, values, i) => axis[0] * values[3 * i] + axis[1] * values[3 * i + 1] + axis[2] * values[3 * i + 2];

/** A camera that looks as `camera` does and shows the whole shape. */
function fitted(points, camera, width, height) {
  const [right, up] = axesOf(camera);
  const box = [Infinity, -Infinity, Infinity, -Infinity];
  for (let i = 0; i < points.n; i += 1) {
    const [x, y] = [dot(right, points.positions, i), dot(up, points.positions, i)];
    box[0] = Math.min(box[0], x); box[1] = Math.max(box[1], x);
    box[2] = Math.min(box[2], y); box[3] = Math.max(box[3], y);
  }
  const size = Math.min(width, height);
  const spare = 2 * shapes[points.index].r;
  const zoom = Math.min(width / size / (box[1] - box[0] + spare), height / size / (box[3] - box[2] + spare)) * 2 * points.reach;
  return { ...camera, zoom, x: -(box[0] + box[1]) / 2 / points.reach, y: -(box[2] + box[3]) / 2 / points.reach };
}

/** Screen units per unit of the shape, on the two axes of a viewport from -1 to 1. */
function scaleOf(points, camera, width, height) {
  const size = Math.min(width, height);
  const scale = (0.9 * camera.zoom) / points.reach;
  return [(scale * size) / width, (scale * size) / height];
}
