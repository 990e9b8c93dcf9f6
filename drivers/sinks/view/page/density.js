// Spike counts in cells of time and height. Counts are kept between pictures, and only new spikes are counted:
// a window of one minute costs no more than one of a second.

export class Density {
  /// Counts the spikes of a window. Afterwards `counts` contains `width` cells per line, line by line; the first
  /// begins at `start` cells of `cell_s` seconds.
  /// \param edges  of the rows, from 0 at the top to 1
  update({ spikes, time, order, columns, lines, edges }) {
    const cell_s = time.seconds / columns, start = Math.floor(time.from / cell_s + 1e-6), width = columns + 1;
    const moved = start - this.start;
    const kept = this.rows === order.rows && this.edges === edges && this.cell_s === cell_s && this.width === width
      && this.lines === lines && this.generation === spikes.generation && moved >= 0 && moved < width;
    if (!kept) this.counts = new Uint16Array(width * lines);
    Object.assign(this, { rows: order.rows, edges, cell_s, width, lines, generation: spikes.generation, start });
    if (kept && moved > 0) this.counts.copyWithin(0, moved);
    // Recount the last two cells: the last was not full yet, and transmitted times are rounded.
    const first = kept ? Math.max(0, Math.floor(this.newest / cell_s) - 1 - start) : 0;
    if (kept) for (let line = 0; line < lines; ++line) this.counts.fill(0, line * width + first, (line + 1) * width);
    this.#count(spikes, order.rowOf, (start + first) * cell_s, time.to);
    this.newest = Math.min(time.now, time.to);
  }

  #count(spikes, rowOf, from, to) {
    const { counts, width, lines, start, edges } = this, { t, n } = spikes, perSecond = 1 / this.cell_s;
    const top = Uint32Array.from(edges, (edge) => Math.min(lines - 1, edge * lines));
    for (let i = spikes.firstAfter(from), end = spikes.firstAfter(to + 1e-9); i < end; ++i) {
      const row = rowOf[n[i]], column = Math.floor(t[i] * perSecond) - start;
      if (row < 0 || column < 0 || column >= width) continue;
      for (let line = top[row], bottom = Math.max(line + 1, top[row + 1]); line < bottom; ++line) ++counts[line * width + column];
    }
  }
}
