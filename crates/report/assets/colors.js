// Chooses the color of each point: by parts, by what is wrong, by types or by faces.
'use strict';

// Neighbors in the list differ in hue and in lightness. Most readers tell the first eight apart, whatever colors they see.
const PART_COLORS = ['#4477c4', '#ee8033', '#2f9e76', '#f2cf5b', '#b0478c', '#66c5ea', '#8a5a2b', '#f4a6b8', '#24456e', '#a7d36c',
  '#d1495b', '#7d6bc9', '#c9b28f', '#0f7f8a', '#e3c3f0', '#6d7f1f'];
const TYPE_COLORS = { plane: '#6d9fd6', cylinder: '#ee8033', cone: '#f2cf5b', sphere: '#d1495b', torus: '#2f9e76', bezier: '#e3c3f0',
  bspline: '#8f74d6', revolution: '#55bfc4', extrusion: '#f4a6b8', offset: '#8c9a3a', other: '#8f969d' };
const hex = (text) => [1, 3, 5].map((at) => parseInt(text.slice(at, at + 2), 16));
const themed = (name) => hex(getComputedStyle(document.documentElement).getPropertyValue(name).trim());
const css = (rgb) => `rgb(${rgb.join(' ')})`;

/** The color of each part of a reference: the largest parts get the first colors. */
function partColors(reference) {
  const order = reference.parts.map((part, index) => index).sort((a, b) => reference.parts[b][1] - reference.parts[a][1]);
  const colors = [];
  order.forEach((part, rank) => { colors[part] = hex(PART_COLORS[rank % PART_COLORS.length]); });
  return colors;
}

const grayOf = (index) => { const level = 120 + ((index * 47) % 90); return [level, level, level + 6]; };
const predOf = (shape, layer) => shape.preds.find((pred) => pred.i === Number(layer.slice(1)));

/** The index of the reference that a layer belongs to. */
function referenceOf(shape, layer) {
  if (layer[0] === 'r') return Number(layer.slice(1));
  return 'pd'.includes(layer[0]) ? predOf(shape, layer).ref : 0;
}

/** A function from points to colors. Layers: r0 a reference, p0 a prediction, d0 its difference, t types, f faces. */
function colorOf(points, layer) {
  const shape = shapes[points.index];
  const kind = layer[0];
  if (kind === 't') return (i) => hex(TYPE_COLORS[shape.faces[points.faces[i]]?.[0] ?? 'other']);
  if (kind === 'f') return (i) => hex(PART_COLORS[points.faces[i] % PART_COLORS.length]);
  const reference = referenceOf(shape, layer);
  const parts = points.refs[reference];
  const colors = partColors(shape.refs[reference]);
  const none = themed('--right');
  if (kind === 'r') return (i) => colors[parts[i]] ?? none;
  const labels = points.preds.get(Number(layer.slice(1)));
  if (kind === 'p') return (i) => colors[labels[i]] ?? grayOf(labels[i]);
  const wrong = themed('--wrong');
  return (i) => (parts[i] === NONE || parts[i] === labels[i] ? none : wrong);
}

/** Four bytes per point. If a part is chosen, the others fade. */
function colorBytes(points, layer, chosen) {
  const color = colorOf(points, layer);
  const ground = themed('--pane');
  const bytes = new Uint8Array(4 * points.n).fill(255);
  for (let i = 0; i < points.n; i += 1) {
    let rgb = color(i);
    if (chosen && points.refs[chosen.reference][i] !== chosen.part) rgb = rgb.map((value, at) => 0.18 * value + 0.82 * ground[at]);
    bytes.set(rgb, 4 * i);
  }
  return bytes;
}
