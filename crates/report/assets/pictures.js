// Paints the pictures of the cards when they come into view.
'use strict';

const pixels = () => Math.min(window.devicePixelRatio || 1, 2);
const painter = new Painter(document.createElement('canvas'));
const wrongOnly = document.getElementById('gallery-wrong');
let painting = Promise.resolve();

async function paintPicture(link) {
  const canvas = link.querySelector('canvas');
  const size = Math.round(canvas.clientWidth * pixels());
  if (!painter.gl || size === 0) return;
  const points = await unpacked(Number(link.dataset.shape));
  const layer = wrongOnly.checked ? link.dataset.layer.replace('p', 'd') : link.dataset.layer;
  painter.clear(size, size);
  painter.paint(points, colorBytes(points, layer, null), fitted(points, START, size, size), [0, 0, size, size]);
  [canvas.width, canvas.height] = [size, size];
  canvas.getContext('2d').drawImage(painter.canvas, 0, 0);
  canvas.dataset.painted = layer;
}

const queuePicture = (link) => { painting = painting.then(() => paintPicture(link)); };
const visible = new Set();
const pictureWatcher = new IntersectionObserver((entries) => {
  for (const { target, isIntersecting } of entries) {
    if (!isIntersecting) { visible.delete(target); continue; }
    visible.add(target);
    if (!target.querySelector('canvas').dataset.painted) queuePicture(target);
  }
}, { rootMargin: '300px' });
const pictures = [...document.querySelectorAll('a.pic')];
for (const link of pictures) pictureWatcher.observe(link);
function repaintPictures() {
  for (const link of pictures) delete link.querySelector('canvas').dataset.painted;
  for (const link of visible) queuePicture(link);
}
if (wrongOnly) wrongOnly.addEventListener('change', repaintPictures);
