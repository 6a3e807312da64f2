// The 3D view: four panes with one camera, picking, pointers and keys.
'use strict';

// The height of the menu of a pane; the picture is below it.
const HEAD = 40;

function startView() {

  const canvas = document.getElementById('view-canvas');
  const frame = document.getElementById('panes');
  const picked = document.getElementById('picked');
  const shapeSelect = document.getElementById('shape');
  const partList = document.getElementById('parts');
  const view = new Painter(canvas);
  const panes = [...frame.querySelectorAll('.pane')].map((box) => {
    const marker = Object.assign(document.createElement('i'), { className: 'marker', hidden: true });
    box.append(marker);
    return { box, select: box.querySelector('select'), marker, layer: null, colors: null };
  });
  let camera = { ...START };
  let points = null;
  let chosen = null;
  let scheduled = false;
  if (!view.gl) picked.textContent = 'This browser has no WebGL 2, which pictures and the 3D view need.';

  const predName = (pred) => `${pred.name}, seed ${pred.seed}`;

  /** What a pane can show of a shape, in groups. */
  function layersOf(shape) {
    const many = new Set(shape.preds.map((pred) => pred.by)).size > 1;
    const text = (pred) => `${predName(pred)} · mIoU ${pred.miou.toFixed(3)}${many ? ` · ${pred.by}` : ''}${shape.refs.length > 1 ? ` · vs ${shape.refs[pred.ref].name}` : ''}`;
    const groups = [
      ['Reference', shape.refs.map((reference, index) => [`r${index}`, `reference: ${reference.name}`])],
      ['Prediction', shape.preds.map((pred) => [`p${pred.i}`, `prediction: ${text(pred)}`])],
      ['Difference', shape.preds.map((pred) => [`d${pred.i}`, `difference: ${text(pred)}`])],
    ];
    if (shape.faces.length) groups.push(['Geometry', [['t', 'primitive types'], ['f', 'faces']]]);
    return groups;
  }

  /** The reference, the first prediction with its difference, and the next row's prediction. */
  function startLayers(shape) {
    const main = shape.preds.filter((pred) => pred.ref === 0 && pred.by === shape.preds[0].by);
    const first = main[0];
    const second = main.find((pred) => first && pred.name !== first.name) ?? main[1];
    return ['r0', first ? `p${first.i}` : 'r0', first ? `d${first.i}` : 'r0', second ? `p${second.i}` : 'r0'];
  }

  function fillSelects(shape) {
    const groups = layersOf(shape);
    const known = new Set(groups.flatMap(([, layers]) => layers.map(([layer]) => layer)));
    const start = startLayers(shape);
    panes.forEach((pane, index) => {
      pane.select.replaceChildren(...groups.filter(([, layers]) => layers.length).map(([label, layers]) => {
        const group = Object.assign(document.createElement('optgroup'), { label });
        group.append(...layers.map(([value, text]) => new Option(text, value)));
        return group;
      }));
      if (!known.has(pane.layer)) pane.layer = start[index];
      pane.select.value = pane.layer;
    });
  }

  function fillParts(shape) {
    const reference = shape.refs[0];
    const colors = partColors(reference);
    const first = shape.preds.find((pred) => pred.ref === 0);
    const order = reference.parts.map((part, index) => index).sort((a, b) => reference.parts[b][1] - reference.parts[a][1]);
    partList.replaceChildren(...order.map((part) => {
      const [label, size, type] = reference.parts[part];
      const button = Object.assign(document.createElement('button'), { type: 'button' });
      const spot = document.createElement('i');
      spot.style.background = css(colors[part]);
      const iou = first ? ` · IoU ${first.iou[part].toFixed(2)}` : '';
      button.append(spot, `part ${label}${type ? ` ${type}` : ''} · ${(100 * size).toFixed(1)} %${iou}`);
      button.dataset.part = part;
      button.addEventListener('click', () => choose(chosen && chosen.reference === 0 && chosen.part === part ? null : { reference: 0, part }));
      return button;
    }));
  }

  /** Keeps a part: the others fade in all panes. */
  function choose(next) {
    chosen = next;
    for (const button of partList.children) button.setAttribute('aria-pressed', String(!!chosen && chosen.reference === 0 && chosen.part === Number(button.dataset.part)));
    recolor();
  }

  function recolor() {
    for (const pane of panes) pane.colors = null;
    schedule();
  }

  function schedule() {
    if (scheduled) return;
    scheduled = true;
    requestAnimationFrame(() => { scheduled = false; draw(); });
  }

  function rectOf(pane) {
    const [outer, inner] = [canvas.getBoundingClientRect(), pane.box.getBoundingClientRect()];
    const height = Math.max(1, inner.height - HEAD);
    return { left: inner.left - outer.left, width: inner.width, height, below: outer.bottom - inner.bottom };
  }

  function draw() {
    if (!view.gl || !points || !canvas.clientWidth) return;
    const ratio = pixels();
    view.clear(Math.round(canvas.clientWidth * ratio), Math.round(canvas.clientHeight * ratio));
    for (const pane of panes) {
      const rect = rectOf(pane);
      pane.colors ??= colorBytes(points, pane.layer, chosen);
      view.paint(points, pane.colors, camera, [rect.left, rect.below, rect.width, rect.height].map((value) => Math.round(value * ratio)));
    }
    canvas.dataset.drawn = String(points.index);
  }

  /** Shows a shape; the promise is kept when it is drawn. */
  async function show(index, part, layer) {
    const next = await unpacked(index);
    const shape = shapes[index];
    points = next;
    shapeSelect.value = String(index);
    fillSelects(shape);
    if (layer && layer[0] === 'p') {
      [panes[1].layer, panes[2].layer] = [layer, layer.replace('p', 'd')];
      for (const pane of panes) pane.select.value = pane.layer;
    }
    fillParts(shape);
    resetCamera();
    place(null);
    choose(part === undefined ? null : { reference: 0, part });
  }

  function resetCamera() {
    const rect = rectOf(panes[0]);
    if (points && rect.width) camera = fitted(points, START, rect.width, rect.height);
    schedule();
  }

  // Picking.

  /** The pane at a position of the window, and the position in it from -1 to 1. */
  function paneAt(clientX, clientY) {
    for (const pane of panes) {
      const box = pane.box.getBoundingClientRect();
      const x = (2 * (clientX - box.left)) / box.width - 1;
      const { width, height } = rectOf(pane);
      const y = 1 - (2 * (clientY - box.top - HEAD)) / height;
      if (Math.abs(x) <= 1 && Math.abs(y) <= 1) return { pane, x, y, width, height };
    }
    return null;
  }

  /** The point on the surface that is nearest to the eye at a position of a pane; -1 where there is none. */
  function pointAt({ x, y, width, height }) {
    const [right, up, eye] = axesOf(camera);
    const scale = scaleOf(points, camera, width, height);
    const radius = shapes[points.index].r;
    const at = [x / scale[0] - camera.x * points.reach, y / scale[1] - camera.y * points.reach];
    let [best, nearest] = [-1, Infinity];
    let front = -Infinity;
    const covering = [];
    for (let i = 0; i < points.n; i += 1) {
      const distance = Math.hypot(dot(right, points.positions, i) - at[0], dot(up, points.positions, i) - at[1]);
      if (distance > radius || dot(eye, points.normals, i) < -0.05) continue;
      const depth = dot(eye, points.positions, i);
      front = Math.max(front, depth);
      covering.push([i, distance, depth]);
    }
    // Of the discs of the front surface, that with the nearest center is seen.
    for (const [i, distance, depth] of covering) {
      if (depth > front - 2 * radius && distance < nearest) [best, nearest] = [i, distance];
    }
    return best;
  }

  const partText = (reference, part) => {
    const facts = reference.parts[part];
    return facts ? `part ${facts[0]}${facts[2] ? ` (${facts[2]})` : ''}` : 'no part';
  };

  /** Names the part and the face of a point, and where predictions put it. */
  function describe(pane, point) {
    const shape = shapes[points.index];
    const index = referenceOf(shape, pane.layer);
    const reference = shape.refs[index];
    const part = points.refs[index][point];
    const facts = reference.parts[part];
    const strong = (text) => Object.assign(document.createElement('b'), { textContent: text });
    const pieces = [strong(partText(reference, part)), ` of ${reference.name}`];
    if (facts) pieces.push(`, ${(100 * facts[1]).toFixed(1)} % of the points${facts[3] ? `, ${facts[3]} ${facts[3] === 1 ? 'face' : 'faces'}` : ''}`);
    const face = points.faces ? shape.faces[points.faces[point]] : null;
    if (face) pieces.push('; on ', strong(`face #${face[1]} (${face[0]})`));
    const told = new Set();
    for (const other of [pane, ...panes]) {
      if (!'pd'.includes(other.layer[0]) || told.has(other.layer.slice(1))) continue;
      told.add(other.layer.slice(1));
      const pred = predOf(shape, other.layer);
      const to = points.preds.get(pred.i)[point];
      const where = to === points.refs[pred.ref][point] ? 'in its own part' : to < shape.refs[pred.ref].parts.length ? `in ${partText(shape.refs[pred.ref], to)}` : 'in a cluster without a part';
      const iou = pred.iou[points.refs[pred.ref][point]];
      pieces.push(`; ${predName(pred)} puts it ${where}${iou === undefined ? '' : ` (IoU of the part ${iou.toFixed(2)})`}`);
    }
    picked.replaceChildren(...pieces, '.');
    picked.dataset.part = facts ? facts[0] : '';
    picked.dataset.face = face ? face[1] : '';
    return facts ? { reference: index, part } : null;
  }

  /** Marks a point in all panes. */
  function place(point) {
    const [right, up] = axesOf(camera);
    for (const pane of panes) {
      pane.marker.hidden = point === null;
      if (point === null) continue;
      const { width, height } = rectOf(pane);
      const scale = scaleOf(points, camera, width, height);
      const x = (dot(right, points.positions, point) + camera.x * points.reach) * scale[0];
      const y = (dot(up, points.positions, point) + camera.y * points.reach) * scale[1];
      pane.marker.style.left = `${((x + 1) * width) / 2}px`;
      pane.marker.style.top = `${HEAD + ((1 - y) * height) / 2}px`;
    }
  }

  function pick(clientX, clientY, keep) {
    const at = points && paneAt(clientX, clientY);
    const point = at ? pointAt(at) : -1;
    if (point < 0) { place(null); return; }
    place(point);
    const part = describe(at.pane, point);
    if (keep) choose(part);
  }

  // Pointers and keys.

  const pointers = new Map();
  let moved = 0;

  function turn(dx, dy) {
    camera.yaw -= dx;
    camera.pitch = Math.max(-Math.PI / 2, Math.min(Math.PI / 2, camera.pitch + dy));
    place(null);
    schedule();
  }

  function zoom(factor) {
    const next = Math.max(0.2, Math.min(60, camera.zoom * factor));
    camera.zoom = next;
    place(null);
    schedule();
  }

  function shift(dx, dy) {
    const { width, height } = rectOf(panes[0]);
    const scale = scaleOf(points, camera, width, height);
    camera.x += (2 * dx) / width / scale[0] / points.reach;
    camera.y -= (2 * dy) / height / scale[1] / points.reach;
    place(null);
    schedule();
  }

  canvas.addEventListener('pointerdown', (event) => {
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
    canvas.setPointerCapture(event.pointerId);
    moved = 0;
  });
  canvas.addEventListener('pointermove', (event) => {
    const former = pointers.get(event.pointerId);
    if (!former) { pick(event.clientX, event.clientY, false); return; }
    const [dx, dy] = [event.clientX - former[0], event.clientY - former[1]];
    moved += Math.hypot(dx, dy);
    if (!points || moved < 4) return;
    if (pointers.size === 2) {
      const [other] = [...pointers].filter(([id]) => id !== event.pointerId).map(([, at]) => at);
      const gap = (at) => Math.hypot(at[0] - other[0], at[1] - other[1]) || 1;
      zoom(gap([event.clientX, event.clientY]) / gap(former));
      shift(dx / 2, dy / 2);
    } else if (event.shiftKey || event.buttons === 2 || event.buttons === 4) shift(dx, dy);
    else turn(dx / 140, dy / 140);
    pointers.set(event.pointerId, [event.clientX, event.clientY]);
  });
  const release = (event) => {
    if (event.type === 'pointerup' && pointers.size === 1 && moved < 4) pick(event.clientX, event.clientY, true);
    pointers.delete(event.pointerId);
  };
  canvas.addEventListener('pointerup', release);
  canvas.addEventListener('pointercancel', release);
  canvas.addEventListener('pointerleave', () => { if (!pointers.size) place(null); });
  canvas.addEventListener('contextmenu', (event) => event.preventDefault());
  canvas.addEventListener('dblclick', resetCamera);
  // The wheel belongs to the page until the view was clicked.
  canvas.addEventListener('wheel', (event) => {
    if (document.activeElement !== canvas) return;
    event.preventDefault();
    zoom(Math.exp(-event.deltaY / 500));
  }, { passive: false });
  canvas.addEventListener('keydown', (event) => {
    const keys = {
      ArrowLeft: () => turn(-0.12, 0), ArrowRight: () => turn(0.12, 0), ArrowUp: () => turn(0, -0.12), ArrowDown: () => turn(0, 0.12),
      '+': () => zoom(1.15), '=': () => zoom(1.15), '-': () => zoom(1 / 1.15), '0': resetCamera, Escape: () => { place(null); choose(null); },
      Enter: () => { const box = panes[0].box.getBoundingClientRect(); pick(box.left + box.width / 2, box.top + (HEAD + box.height) / 2, true); },
    };
    const action = keys[event.key];
    if (!action || event.ctrlKey || event.metaKey || event.altKey) return;
    event.preventDefault();
    action();
  });

  for (const pane of panes) {
    pane.select.addEventListener('change', () => {
      pane.layer = pane.select.value;
      pane.colors = null;
      schedule();
    });
  }
  shapeSelect.addEventListener('change', () => show(Number(shapeSelect.value)));
  const step = (by) => {
    const next = shapeSelect.selectedIndex + by;
    if (shapeSelect.options[next]) show(Number(shapeSelect.options[next].value));
  };
  document.getElementById('previous-shape').addEventListener('click', () => step(-1));
  document.getElementById('next-shape').addEventListener('click', () => step(1));
  document.getElementById('reset-view').addEventListener('click', resetCamera);
  document.addEventListener('click', (event) => {
    const link = event.target.closest('a[data-shape]');
    if (link) show(Number(link.dataset.shape), link.dataset.part === undefined ? undefined : Number(link.dataset.part), link.dataset.layer);
  });
  new ResizeObserver(schedule).observe(frame);
  matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => { recolor(); repaintPictures(); });

  // The worst shape is the first card.
  const worst = document.querySelector('a.pic');
  show(worst ? Number(worst.dataset.shape) : Number(shapeSelect.value));
}

if (document.getElementById('view-canvas')) startView();
