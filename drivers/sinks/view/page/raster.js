// The spikes of all afferents, one row each; if the rows are too thin for the screen, their density.
import { context, sizeOf } from './canvas.js';
import { css, kPins, packed, packedHex, scale } from './colours.js';
import { Density } from './density.js';

const kFoot = 18;
const kThinnest = 2;     // device pixels per row, below which the density is drawn
const kCell = 2;         // device pixels per side of a density cell

export class Raster {
  constructor(canvas) { this.canvas = canvas; this.density = new Density(); }

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
    const { c, height, ratio } = context(this.canvas);
    const { left, w, h } = this.frame(margins);
    const columns = Math.round(w * ratio), lines = Math.round(h * ratio), rows = order.rows.length;
    drawSpans(c, spans, time, { left, w, h }, true);
    const mode = lines / Math.max(rows, 1) >= kThinnest ? 'ticks' : 'density';
    const edges = order.edgesFor(mode === 'density');
    if (rows > 0) {
      // A density is counted in cells and enlarged.
      const cell = mode === 'ticks' ? 1 : kCell;
      const size = { columns: Math.ceil(columns / cell), lines: Math.ceil(lines / cell) };
      if (mode === 'density') this.density.update({ spikes, time, order, edges, ...size });
      const image = this.#blank(mode === 'ticks' ? size.columns : this.density.width, size.lines);
      const pixels = new Uint32Array(image.data.buffer);
      const colours = pins.map((unused, i) => packedHex(kPins[i % kPins.length]));
      if (mode === 'ticks') this.#ticks(pixels, { spikes, time, order, pins, colours, ...size }, ratio);
      else this.#density(pixels, { order, pins, colours, edges });
      this.scratch ??= document.createElement('canvas');
      if (this.scratch.width !== image.width) this.scratch.width = image.width;
      if (this.scratch.height !== image.height) this.scratch.height = image.height;
      this.scratch.getContext('2d').putImageData(image, 0, 0);
      c.imageSmoothingEnabled = false;
      c.save();
      c.beginPath(); c.rect(left, 0, w, h); c.clip();
      // Cells start at multiples of their length, so that they scroll without a recount.
      const step = w / size.columns, shift = mode === 'ticks' ? 0 : time.from / this.density.cell_s - this.density.start;
      c.drawImage(this.scratch, left - Math.round(shift * step * ratio) / ratio, 0, image.width * step, h);
      c.restore();
    }
    this.#labels(c, { left, w, h, order, pins, edges });
    timeAxis(c, time, { left, w }, height);
    return mode;
  }

  /// An empty image; the last one, if it has the size.
  #blank(width, height) {
    if (this.image?.width !== width || this.image?.height !== height) this.image = new ImageData(width, height);
    else this.image.data.fill(0);
    return this.image;
  }

  #ticks(pixels, { spikes, time, order, columns, lines, pins, colours }, ratio) {
    const ink = packedHex(css('--spike')), row = lines / order.rows.length;
    const tall = Math.max(1, Math.round(Math.max(2, row * 0.75))), wide = Math.max(1, Math.round(1.5 * ratio));
    const last = spikes.firstAfter(time.to + 1e-9);
    for (let i = spikes.firstAfter(time.from); i < last; ++i) {
      const at = order.rowOf[spikes.n[i]];
      if (at < 0) continue;
      const x = Math.floor((spikes.t[i] - time.from) / time.seconds * columns), y = Math.floor(at * row + (row - tall) / 2);
      const pin = pins.indexOf(spikes.n[i]);
      const colour = pin < 0 ? ink : colours[pin];
      for (let dy = Math.max(0, y); dy < Math.min(lines, Math.max(0, y) + tall); ++dy) {
        for (let dx = x; dx < Math.min(columns, x + wide); ++dx) pixels[dy * columns + dx] = colour;
      }
    }
  }

  #density(pixels, { order, pins, colours, edges }) {
    const { counts, width, lines } = this.density, { rowOf } = order;
    let most = 1;
    for (let i = 0; i < counts.length; ++i) if (counts[i] > most) most = counts[i];
    const log = 255 / Math.log2(1 + most), shades = scale().map(packed);
    const shadeOf = Uint32Array.from({ length: Math.min(most, 4096) + 1 }, (unused, k) => (k ? shades[Math.max(60, Math.round(log * Math.log2(1 + k)))] : 0));
    for (let i = 0; i < counts.length; ++i) if (counts[i]) pixels[i] = shadeOf[Math.min(counts[i], 4096)];
    const top = (row) => Math.min(lines - 1, Math.floor(edges[row] * lines));
    pins.forEach((afferent, k) => {
      const row = rowOf[afferent];
      if (row < 0) return;
      const end = Math.max(top(row) + 1, top(row + 1)) * width;
      for (let i = top(row) * width; i < end; ++i) if (counts[i]) pixels[i] = colours[k];
    });
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
