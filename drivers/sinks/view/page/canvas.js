// Canvases in screen resolution, and readings at the pointer or at the keyboard position.
import { theme } from './colours.js';

const kFont = '12px system-ui, sans-serif';

export const byId = (id) => document.getElementById(id);
export const pixelRatio = () => Math.min(window.devicePixelRatio || 1, 3);

/// Sets a text if it changed: setting the same text again would cost a layout.
export function setText(element, text) { if (element.textContent !== text) element.textContent = text; }

/// Sets an attribute if it changed.
export function setAttribute(element, name, value) {
  if (element.getAttribute(name) !== String(value)) element.setAttribute(name, value);
}

const sizes = new WeakMap();
const observer = new ResizeObserver((entries) => {
  for (const { target } of entries) sizes.set(target, { width: target.clientWidth, height: target.clientHeight });
  document.dispatchEvent(new Event('canvas-resized'));
});
/// {width, height} of a canvas on the page. Cached, because reading it while drawing forces the
/// browser to lay out the page again.
export function sizeOf(canvas) {
  if (!sizes.has(canvas)) {
    sizes.set(canvas, { width: canvas.clientWidth, height: canvas.clientHeight });
    observer.observe(canvas);
  }
  return sizes.get(canvas);
}

/// Sizes a canvas to its place on the page and clears it.
export function context(canvas) {
  const ratio = pixelRatio();
  const { width, height } = sizeOf(canvas);
  if (canvas.width !== Math.round(width * ratio) || canvas.height !== Math.round(height * ratio)) {
    canvas.width = Math.round(width * ratio);
    canvas.height = Math.round(height * ratio);
  }
  const c = canvas.getContext('2d');
  c.setTransform(ratio, 0, 0, ratio, 0, 0);
  c.clearRect(0, 0, width, height);
  c.font = kFont;
  c.lineWidth = 1;
  return { c, width, height, ratio };
}

/// A part of a picture that changes rarely: drawn when its key changes, otherwise copied.
export class Layer {
  constructor() { this.canvas = document.createElement('canvas'); this.key = null; }

  /// Copies the layer onto a context of `context()`. \param key  all that the layer shows, as a text or a number
  show({ c, width, height, ratio }, key, draw) {
    const { canvas } = this, whole = `${width} ${height} ${ratio} ${theme()} ${key}`;
    if (this.key !== whole) {
      this.key = whole;
      canvas.width = Math.max(1, Math.round(width * ratio));     // also clears it
      canvas.height = Math.max(1, Math.round(height * ratio));
      const own = canvas.getContext('2d');
      own.setTransform(ratio, 0, 0, ratio, 0, 0);
      own.font = kFont;
      draw(own);
    }
    c.save();
    c.setTransform(1, 0, 0, 1, 0, 0);
    c.drawImage(canvas, 0, 0);
    c.restore();
  }
}

const kArrows = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] };

/// Follows the pointer or, in a focused canvas, the arrow keys, and shows the reading there.
/// \param describe  (x, y) → text.  \param choose  (x, y, event): a click or Enter
export function follow(canvas, output, { describe, choose = () => {} }) {
  let place = null;
  const update = () => { if (place) output.textContent = describe(place.x, place.y); };
  canvas.addEventListener('pointermove', (event) => { place = { x: event.offsetX, y: event.offsetY }; update(); });
  canvas.addEventListener('click', (event) => choose(event.offsetX, event.offsetY, event));
  for (const gone of ['pointerleave', 'blur']) {
    canvas.addEventListener(gone, () => { place = null; output.textContent = ''; });
  }
  canvas.addEventListener('keydown', (event) => {
    if (event.key === 'Enter' && place) { choose(place.x, place.y, event); event.preventDefault(); return; }
    const step = kArrows[event.key];
    if (!step) return;
    const width = canvas.clientWidth, height = canvas.clientHeight, by = event.shiftKey ? 40 : 8;
    const from = place ?? { x: width / 2, y: height / 2 };
    place = { x: Math.min(width - 1, Math.max(0, from.x + step[0] * by)), y: Math.min(height - 1, Math.max(0, from.y + step[1] * by)) };
    update();
    event.preventDefault();
  });
  return { update, place: () => place };
}
