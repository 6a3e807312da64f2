// Unpacks the points of a shape from the page: positions, normals, faces, and the part of each point by each reference and
// prediction.
'use strict';

const shapes = JSON.parse(document.getElementById('shape-data')?.textContent ?? '[]');
const NONE = 0xffff;

const MAX_UNPACKED = 48;
const unpackedShapes = new Map();

/** The points of a shape, unpacked once; the oldest are forgotten. */
function unpacked(index) {
  const found = unpackedShapes.get(index) ?? unpack(index);
  unpackedShapes.delete(index);
  unpackedShapes.set(index, found);
  if (unpackedShapes.size > MAX_UNPACKED) unpackedShapes.delete(unpackedShapes.keys().next().value);
  return found;
}

async function unpack(index) {
  const { n, refs, preds, faces } = shapes[index];
  const packed = Uint8Array.from(atob(document.getElementById(`points-${index}`).textContent), (char) => char.charCodeAt(0));
  const stream = new Blob([packed]).stream().pipeThrough(new DecompressionStream('deflate-raw'));
  const bytes = new Uint8Array(await new Response(stream).arrayBuffer());
  let offset = 0;
  const words = () => {
    const plane = new Uint16Array(n);
    for (let i = 0; i < n; i += 1) plane[i] = (bytes[offset + i] << 8) | bytes[offset + n + i];
    offset += 2 * n;
    return plane;
  };
  const positions = new Float32Array(3 * n);
  let reach = 0;
  for (let axis = 0; axis < 3; axis += 1) {
    const plane = words();
    const middle = plane.reduce((high, word) => Math.max(high, word), 0) / 2;
    for (let i = 0; i < n; i += 1) positions[3 * i + axis] = (plane[i] - middle) / 65535;
  }
  for (let i = 0; i < n; i += 1) reach = Math.max(reach, Math.hypot(positions[3 * i], positions[3 * i + 1], positions[3 * i + 2]));
  return {
    index,
    n,
    positions,
    reach: reach || 1,
    normals: normalsOf(words()),
    faces: faces.length ? words() : null,
    refs: refs.map(words),
    preds: new Map(preds.map((pred) => [pred.i, words()])),
  };
}

/** Unit vectors of octahedral coordinates. */
function normalsOf(plane) {
  const normals = new Float32Array(3 * plane.length);
  const sign = (value) => (value < 0 ? -1 : 1);
  plane.forEach((word, i) => {
    const u = (word >> 8) / 127 - 1;
    const v = (word & 255) / 127 - 1;
    const z = 1 - Math.abs(u) - Math.abs(v);
    const x = z < 0 ? (1 - Math.abs(v)) * sign(u) : u;
    const y = z < 0 ? (1 - Math.abs(u)) * sign(v) : v;
    const length = Math.hypot(x, y, z) || 1;
    normals.set([x / length, y / length, z / length], 3 * i);
  });
  return normals;
}
