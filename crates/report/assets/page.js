// Sorts and filters tables, reads values off charts, orders the cards, and marks the section that is read.
'use strict';

// ---- Tables -------------------------------------------------------------------------------------------------------------------

function sortTable(heading) {
  const row = heading.parentElement;
  const column = [...row.children].indexOf(heading);
  const isNumber = heading.classList.contains('n');
  const former = heading.getAttribute('aria-sort');
  // The first click shows the largest numbers, or the first names.
  const next = former ? (former === 'ascending' ? 'descending' : 'ascending') : isNumber ? 'descending' : 'ascending';
  for (const other of row.children) other.removeAttribute('aria-sort');
  heading.setAttribute('aria-sort', next);
  const sign = next === 'ascending' ? 1 : -1;
  const body = heading.closest('table').tBodies[0];
  const key = (tr) => {
    const cell = tr.children[column];
    if (!isNumber) return cell.textContent;
    return cell.dataset.v === undefined ? NaN : Number(cell.dataset.v);
  };
  const compare = (a, b) => {
    if (!isNumber) return sign * a.key.localeCompare(b.key, 'en', { numeric: true });
    // Rows without a number stay at the end.
    if (Number.isNaN(a.key) || Number.isNaN(b.key)) return Number.isNaN(a.key) - Number.isNaN(b.key);
    return sign * (a.key - b.key);
  };
  const rows = [...body.rows].map((tr) => ({ tr, key: key(tr) }));
  rows.sort(compare);
  body.append(...rows.map((entry) => entry.tr));
}

function filterTable(input) {
  const id = input.dataset.filters;
  const words = input.value.toLowerCase().split(/\s+/).filter(Boolean);
  let shown = 0;
  for (const tr of document.getElementById(id).tBodies[0].rows) {
    const text = tr.textContent.toLowerCase();
    tr.hidden = !words.every((word) => text.includes(word));
    if (!tr.hidden) shown += 1;
  }
  document.querySelector(`[data-counts="${id}"]`).textContent = shown === 1 ? '1 row' : `${shown} rows`;
}

document.addEventListener('click', (event) => {
  const button = event.target.closest('table.sortable thead button');
  if (button) sortTable(button.parentElement);
});
document.addEventListener('input', (event) => {
  if (event.target.dataset && event.target.dataset.filters) filterTable(event.target);
});

// ---- Charts -------------------------------------------------------------------------------------------------------------------

const tip = document.createElement('div');
tip.id = 'tip';
tip.hidden = true;
document.body.append(tip);
const pointsOfLine = new WeakMap();

function pointsOf(line) {
  if (!pointsOfLine.has(line)) {
    pointsOfLine.set(line, line.getAttribute('points').split(' ').filter(Boolean).map((pair) => pair.split(',').map(Number)));
  }
  return pointsOfLine.get(line);
}

function valueText(value) {
  const size = Math.abs(value);
  if (size !== 0 && (size < 1e-3 || size >= 1e6)) return value.toExponential(2);
  return Number(value.toPrecision(4)).toString();
}

function readChart(svg, event) {
  const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
  const [x0, x1, left, right] = svg.dataset.x.split(' ').map(Number);
  const [y0, y1, bottom, top] = svg.dataset.y.split(' ').map(Number);
  const x = Math.min(Math.max(at.x, left), right);
  const rows = [];
  let nearest = x;
  for (const line of svg.querySelectorAll('polyline.line')) {
    let best = null;
    for (const point of pointsOf(line)) {
      if (!best || Math.abs(point[0] - x) < Math.abs(best[0] - x)) best = point;
    }
    if (!best) continue;
    nearest = best[0];
    rows.push({ line, value: y0 + ((best[1] - bottom) / (top - bottom)) * (y1 - y0) });
  }
  const cross = svg.querySelector('.cross');
  cross.setAttribute('transform', `translate(${nearest} 0)`);
  cross.setAttribute('visibility', 'visible');
  tip.replaceChildren();
  const head = document.createElement('div');
  head.textContent = valueText(Math.round(x0 + ((nearest - left) / (right - left)) * (x1 - x0)));
  tip.append(head);
  for (const { line, value } of rows.slice(0, 16)) {
    const row = document.createElement('div');
    const swatch = document.createElement('span');
    swatch.className = `swatch ${[...line.classList].filter((name) => name !== 'line').join(' ')}`;
    row.append(swatch, `${line.dataset.name}: `, Object.assign(document.createElement('b'), { textContent: valueText(value) }));
    tip.append(row);
  }
  tip.hidden = false;
  const box = tip.getBoundingClientRect();
  const flip = event.clientX + 16 + box.width > innerWidth;
  tip.style.left = `${Math.max(4, flip ? event.clientX - 16 - box.width : event.clientX + 16)}px`;
  tip.style.top = `${Math.max(4, Math.min(event.clientY + 12, innerHeight - box.height - 4))}px`;
}

for (const svg of document.querySelectorAll('svg.lines')) {
  svg.addEventListener('pointermove', (event) => readChart(svg, event));
  svg.addEventListener('pointerleave', () => {
    tip.hidden = true;
    svg.querySelector('.cross').setAttribute('visibility', 'hidden');
  });
}

// ---- Cards --------------------------------------------------------------------------------------------------------------------

const CARDS_AT_ONCE = 6;
const cards = document.getElementById('cards');
if (cards) {
  let shown = CARDS_AT_ONCE;
  const more = document.getElementById('more-cards');
  const show = () => {
    [...cards.children].forEach((card, index) => { card.hidden = index >= shown; });
    more.hidden = shown >= cards.children.length;
  };
  more.addEventListener('click', () => { shown += 2 * CARDS_AT_ONCE; show(); });
  const orders = {
    worst: (a, b) => a.dataset.score - b.dataset.score,
    best: (a, b) => b.dataset.score - a.dataset.score,
    parts: (a, b) => b.dataset.k - a.dataset.k,
  };
  document.getElementById('gallery-order').addEventListener('change', (event) => {
    cards.append(...[...cards.children].sort(orders[event.target.value]));
    show();
  });
  show();
}

// ---- Navigation ---------------------------------------------------------------------------------------------------------------

const links = new Map([...document.querySelectorAll('nav a')].map((link) => [link.hash.slice(1), link]));
const seen = new Set();
const watcher = new IntersectionObserver((entries) => {
  for (const entry of entries) entry.isIntersecting ? seen.add(entry.target.id) : seen.delete(entry.target.id);
  const first = [...links.keys()].find((id) => seen.has(id));
  for (const [id, link] of links) id === first ? link.setAttribute('aria-current', 'true') : link.removeAttribute('aria-current');
}, { rootMargin: '-20% 0px -60% 0px' });
for (const id of links.keys()) watcher.observe(document.getElementById(id));
