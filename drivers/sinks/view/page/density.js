// Spike counts in cells of time and height, and their picture. Both are kept between pictures, and only new spikes are
// counted and shaded: a window of one minute costs no more than one of a second.
import { packed, packedHex, scale, theme } from './colours.js';

const kFaintest = 60;      // index in the colour scale of the lowest count, distinct from the background

export class Density {
  /// Counts the spikes of a window. Afterwards `counts` contains `width` cells per line, line by line; the first
  /// begins at `start` cells of `cell_s` seconds. Cells before column `first` are those of the last call, moved to the
  /// left by `moved` columns.
  /// \param edges  of the rows, from 0 at the top to 1
  update({ spikes, time, order, columns, lines, edges }) {
    const cell_s = time.seconds / columns, start = Math.floor(time.from / cell_s + 1e-6), width = columns + 1;
    const moved = start - this.start;
    const sameRows = this.rows === order.rows && this.edges === edges && this.lines === lines;
    const kept = sameRows && this.cell_s === cell_s && this.width === width
      && this.generation === spikes.generation && moved >= 0 && moved < width;
    if (!sameRows) this.tops = Uint32Array.from(edges, (edge) => Math.min(lines - 1, edge * lines));
    if (!kept) this.counts = new Uint16Array(width * lines);
    Object.assign(this, { rows: order.rows, edges, cell_s, width, lines, generation: spikes.generation, start, kept, moved });
    if (kept && moved > 0) this.counts.copyWithin(0, moved);
    // Recount the last two cells: the last was not full yet, and transmitted times are rounded.
    this.first = kept ? Math.max(0, Math.floor(this.newest / cell_s) - 1 - start) : 0;
    if (kept) for (let line = 0; line < lines; ++line) this.counts.fill(0, line * width + this.first, (line + 1) * width);
    this.#count(spikes, order.rowOf, (start + this.first) * cell_s, time.to);
    this.newest = Math.min(time.now, time.to);
  }

  #count(spikes, rowOf, from, to) {
    const { counts, width, start, tops } = this, { t, n } = spikes, perSecond = 1 / this.cell_s;
    for (let i = spikes.firstAfter(from), end = spikes.firstAfter(to + 1e-9); i < end; ++i) {
      const row = rowOf[n[i]], column = Math.floor(t[i] * perSecond) - start;
      if (row < 0 || column < 0 || column >= width) continue;
      for (let line = tops[row], bottom = Math.max(line + 1, tops[row + 1]); line < bottom; ++line) ++counts[line * width + column];
    }
  }
}

/// A Density in colours.
export class DensityImage {
  /// \return ImageData with a pixel per cell, valid until the next call
  shade(density, { order, pins, colours }) {
    const { counts, width, lines, tops } = density;
    let most = 1;
    for (let i = 0; i < counts.length; ++i) if (counts[i] > most) most = counts[i];
    // Steps of two, so that a new maximum seldom changes all colours.
    const bits = Math.ceil(Math.log2(1 + most)), look = `${theme()} ${bits} ${pins}`;
    const same = density.kept && this.look === look && this.density === density;
    if (!same) this.shades = this.#shades(bits);
    if (this.image?.width !== width || this.image.height !== lines) {
      this.image = new ImageData(width, lines);
      this.pixels = new Uint32Array(this.image.data.buffer);
    }
    if (same && density.moved > 0) this.pixels.copyWithin(0, density.moved);
    this.#colour(counts, this.shades, width, same ? density.first : 0);
    pins.forEach((afferent, k) => {
      const row = order.rowOf[afferent];
      if (row < 0) return;
      const end = Math.max(tops[row] + 1, tops[row + 1]) * width;
      for (let i = tops[row] * width; i < end; ++i) if (counts[i]) this.pixels[i] = packedHex(colours[k]);
    });
    this.look = look;
    this.density = density;
    return this.image;
  }

  #shades(bits) {
    const colours = scale().map(packed);
    return Uint32Array.from({ length: 2 ** bits }, (unused, k) => (k ? colours[Math.max(kFaintest, Math.round(255 * Math.log2(1 + k) / bits))] : 0));
  }

  /// Colours the cells of each line from a column on.
  #colour(counts, shades, width, from) {
    const { pixels } = this;
    for (let line = 0; line < counts.length; line += width) {
      for (let i = line + from, end = line + width; i < end; ++i) pixels[i] = shades[counts[i]];
    }
  }
}
