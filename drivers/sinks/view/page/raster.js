// The spikes of all afferents, one row each; if the rows are too thin for the screen, their density.
import { context, Layer, sizeOf } from './canvas.js';
import { css, kPins, packedHex } from './colours.js';
import { Density, DensityImage } from './density.js';

const kFoot = 18;
const kThinnest = 2;     // device pixels per row, below which the density is drawn
const kCell = 2;         // device pixels per side of a density cell

export class Raster {
  constructor(canvas) {
    this.canvas = canvas;
    this.scratch = document.createElement('canvas');
    this.density = new Density();
    this.shaded = new DensityImage();
    this.labels = new Layer();
  }

  frame(margins) {
    const { width, height } = sizeOf(this.canvas);
    return { left: margins.left, w: Math.max(10, Math.min(margins.width, width - margins.left)), h: height - kFoot };
  }

  /// {afferent, t} under a pixel, or null.
  hit(x, y, margins, time, order) {
    const { left, w, h } = this.frame(margins);
    const row = order.rowAt(y / h), t = time.from + (x - left) / w * time.seconds;
    if (row < 0 || row >= order.rows.length || t < time.from || t > time.to) return null;
    return { afferent: order.rows[row], t };
  }

  /// \return 'ticks' or 'density', the mode of drawing
  draw({ spikes, time, order, margins, spans, pins }) {
    const target = context(this.canvas), { c, height, ratio } = target;
    const { left, w, h } = this.frame(margins);
    const columns = Math.round(w * ratio), lines = Math.round(h * ratio), rows = order.rows.length;
    const mode = lines / Math.max(rows, 1) >= kThinnest ? 'ticks' : 'density';
    const edges = order.edgesFor(mode === 'density'), colours = pins.map((unused, i) => kPins[i % kPins.length]);
    c.imageSmoothingEnabled = false;
    if (rows > 0 && mode === 'ticks') {
      this.#show(c, this.#ticks({ spikes, time, order, pins, colours, columns, lines }, ratio), { left, w, h }, 0, w / columns);
    } else if (rows > 0) {
      // A density is counted in cells and enlarged. Cells start at multiples of their length, so they scroll without a recount.
      const size = { columns: Math.ceil(columns / kCell), lines: Math.ceil(lines / kCell) }, step = w / size.columns;
      this.density.update({ spikes, time, order, edges, ...size });
      const shift = Math.round((time.from / this.density.cell_s - this.density.start) * step * ratio) / ratio;
      this.#show(c, this.shaded.shade(this.density, { order, pins, colours }), { left, w, h }, shift, step);
    }
    drawSpans(c, spans, time, { left, w, h }, true);
    this.labels.show(target, `${left} ${w} ${h} ${order.number} ${order.edges.curved} ${pins}`,
      (own) => this.#labels(own, { left, w, h, order, pins, edges }));
    timeAxis(c, time, { left, w }, height);
    return mode;
  }

  /// Draws an image with pixels `step` wide into the frame, moved to the left by `shift`.
  #show(c, image, { left, w, h }, shift, step) {
    const { scratch } = this;
    if (scratch.width !== image.width) scratch.width = image.width;
    if (scratch.height !== image.height) scratch.height = image.height;
    scratch.getContext('2d').putImageData(image, 0, 0);
    c.save();
    c.beginPath(); c.rect(left, 0, w, h); c.clip();
    c.drawImage(scratch, left - shift, 0, image.width * step, h);
    c.restore();
  }

  #ticks({ spikes, time, order, pins, colours, columns, lines }, ratio) {
    if (this.image?.width !== columns || this.image.height !== lines) {
      this.image = new ImageData(columns, lines);
      this.pixels = new Uint32Array(this.image.data.buffer);
    } else this.pixels.fill(0);
    const ink = packedHex(css('--spike')), pinned = colours.map(packedHex), row = lines / order.rows.length;
    const tall = Math.max(1, Math.round(Math.max(2, row * 0.75))), wide = Math.max(1, Math.round(1.5 * ratio));
    const last = spikes.firstAfter(time.to + 1e-9);
    for (let i = spikes.firstAfter(time.from); i < last; ++i) {
      const at = order.rowOf[spikes.n[i]];
      if (at < 0) continue;
      const x = Math.floor((spikes.t[i] - time.from) / time.seconds * columns), y = Math.max(0, Math.floor(at * row + (row - tall) / 2));
      const pin = pins.indexOf(spikes.n[i]), colour = pin < 0 ? ink : pinned[pin], end = Math.min(columns, x + wide);
      for (let dy = y; dy < Math.min(lines, y + tall); ++dy) this.pixels.fill(colour, dy * columns + x, dy * columns + end);
    }
    return this.image;
  }

  #labels(c, { left, w, h, order, pins, edges }) {
    const rows = order.rows.length;
    c.fillStyle = css('--soft'); c.strokeStyle = css('--line');
    c.textAlign = 'right'; c.textBaseline = 'middle';
    c.strokeRect(left, 0.5, w, h - 1);
    if (rows === 0) { c.textAlign = 'center'; c.fillText('no spikes in this window', left + w / 2, h / 2); return; }
    if (order.edges.curved) { c.fillText('mm', left - 6, h - 2); }
    const middle = (row) => (edges[row] + edges[row + 1]) / 2 * h;
    let free = -8;
    for (let row = 0; row < rows; ++row) {
      const y = Math.max(7, middle(row));
      if (y < free + 15 || y > h - 14) continue;
      free = y;
      const away = order.distance[order.rows[row]];
      // A label that stands for many rows shows their distance instead of a number.
      c.fillText(order.edges.curved ? (Number.isFinite(away) ? (away < 9.95 ? away.toFixed(1) : away.toFixed(0)) : '–') : order.rows[row], left - 6, y);
    }
    pins.forEach((afferent, i) => {
      const row = order.rowOf[afferent];
      if (row < 0) return;
      const y = middle(row);
      c.fillStyle = kPins[i % kPins.length];
      c.beginPath(); c.moveTo(left, y); c.lineTo(left - 7, y - 5); c.lineTo(left - 7, y + 5); c.fill();
    });
  }
}

/// Shades outages and missed frames, and labels each if there is room before the next one.
export function drawSpans(c, spans, time, { left, w, h }, named) {
  const x = (t) => left + Math.max(0, Math.min(1, (t - time.from) / time.seconds)) * w;
  let free = left;
  const seen = spans.filter((span) => span.to >= time.from && span.from <= time.to).sort((a, b) => a.from - b.from);
  for (const [i, span] of seen.entries()) {
    const from = x(span.from), wide = Math.max(1.5, x(span.to) - from);
    c.fillStyle = css(`--span-${span.kind}`);
    c.fillRect(from, 0, wide, h);
    const text = c.measureText(span.label).width, next = i + 1 < seen.length ? x(seen[i + 1].from) : left + w;
    if (!named || from < free || (Math.max(from + wide, next) < from + text + 8 && span.kind !== 'mark')) continue;
    c.globalAlpha = 0.85; c.fillStyle = css('--card');    // legible over spikes
    c.fillRect(from + 2, 2, text + 4, 14);
    c.globalAlpha = 1;
    c.fillStyle = css('--ink'); c.textAlign = 'left'; c.textBaseline = 'top';
    c.fillText(span.label, from + 4, 3);
    free = from + text + 10;
  }
}

export function timeAxis(c, time, { left, w }, height) {
  c.textAlign = 'center'; c.textBaseline = 'bottom'; c.fillStyle = css('--soft');
  const step = time.seconds / 5;
  for (let t = Math.ceil(time.from / step) * step; t <= time.to + 1e-9; t += step) {
    const x = left + (t - time.from) / time.seconds * w;
    if (x > left + w - 14) c.textAlign = 'right';
    c.fillText(`${+t.toFixed(2)} s`, x, height);
  }
}
