// Force and depth against time, drawn by uPlot; the raster below uses the margins of this plot.
import { byId } from './canvas.js';
import { css } from './colours.js';
import { drawSpans } from './raster.js';

const kDashes = [[], [6, 4], [2, 3], [8, 3, 2, 3], [1, 4], [10, 6]];
const kMaxPoints = 2400;    // for all curves together

/// A line as in the plot, and the name of its probe.
function curveOf(probe, i) {
  const item = document.createElement('span'), line = document.createElementNS('http://www.w3.org/2000/svg', 'svg');
  line.setAttribute('viewBox', '0 0 26 4');
  line.setAttribute('aria-hidden', 'true');
  line.innerHTML = `<path d="M0 2h26" stroke="currentColor" stroke-width="2" fill="none" stroke-dasharray="${kDashes[i % kDashes.length].join(' ')}"/>`;
  item.append(line, probe.name);
  return item;
}

export class Trace {
  constructor(place) { this.place = place; this.arrays = []; }

  setScene(scene) { this.scene = scene; this.make(); }

  make() {
    if (!this.scene) return;
    if (this.plot) this.plot.destroy();
    byId('curves').replaceChildren(...(this.scene.probes.length > 1 ? this.scene.probes.map((probe, i) => curveOf(probe, i)) : []));
    const value = (u, v) => (v == null ? '–' : v.toFixed(3));
    const series = [{ label: 'time, s', value }];
    this.scene.probes.forEach((probe, i) => {
      const which = this.scene.probes.length > 1 ? `${probe.name} ` : '';
      const look = { width: 2, dash: kDashes[i % kDashes.length], value, points: { show: false } };
      series.push({ ...look, label: `${which}depth, mm`, scale: 'mm', stroke: () => css('--depth') });
      series.push({ ...look, label: `${which}force, N`, scale: 'N', stroke: () => css('--force') });
    });
    const axis = (more) => ({ stroke: () => css('--soft'), grid: { stroke: () => css('--line'), width: 1 }, ticks: { show: false }, ...more });
    // Two ranges, so that curves of the same shape do not overlap.
    const upward = (room) => (u, low, high) => [Math.min(0, low ?? 0), Math.max(high ?? 0, 0.1) * room];
    this.plot = new uPlot({
      ...this.#size(), series, legend: { show: false }, padding: [6, 0, 8, 0],
      scales: { x: { time: false }, mm: { range: upward(1.08) }, N: { range: upward(1.4) } },
      axes: [axis({ show: false }),
        axis({ scale: 'N', size: 46, stroke: () => css('--force'), values: (u, all) => all.map((v) => +v.toFixed(2)), space: 26 }),
        axis({ scale: 'mm', side: 1, size: 40, stroke: () => css('--depth'), values: (u, all) => all.map((v) => +v.toFixed(2)), grid: { show: false }, space: 26 })],
      cursor: { drag: { x: false, y: false }, y: false },
      hooks: { drawClear: [(u) => this.#shade(u)], setCursor: [(u) => this.#read(u)] },
    }, [[]].concat(this.scene.probes.flatMap(() => [[], []])), this.place);
  }

  #size() { return { width: this.place.clientWidth, height: this.place.clientHeight || 120 }; }
  resize() { if (this.plot) this.plot.setSize(this.#size()); }

  /// The margins of the plot area, in CSS pixels.
  margins() {
    const ratio = window.devicePixelRatio || 1;
    return { left: this.plot.bbox.left / ratio, width: this.plot.bbox.width / ratio };
  }

  #shade(u) {
    if (!this.spans) return;
    const { left, top, width, height } = u.bbox;
    u.ctx.save();
    u.ctx.translate(0, top);
    drawSpans(u.ctx, this.spans, this.time, { left, w: width, h: height }, false);
    u.ctx.restore();
  }

  #read(u) {
    const i = u.cursor.idx;
    byId('trace-value').textContent = i == null ? '' : `${u.data[0][i].toFixed(3)} s: ` + this.scene.probes.map((probe, k) =>
      `${this.scene.probes.length > 1 ? `${probe.name} ` : ''}${u.data[2 * k + 2][i].toFixed(3)} N, ${u.data[2 * k + 1][i].toFixed(3)} mm`).join('; ');
  }

  /// Two values for each bucket of rows: the lowest and the highest, in their order, so that no peak is lost.
  #thin(k, column, buckets) {
    const isTime = k === 0, thinned = this.#array(k, 2 * buckets.length);
    buckets.forEach(([from, to], i) => {
      let low = from, high = from;
      for (let row = from + 1; row < to; ++row) {
        if (column[row] < column[low]) low = row;
        if (column[row] > column[high]) high = row;
      }
      if (isTime) [low, high] = [from, (from + to) >> 1];
      thinned[2 * i] = column[Math.min(low, high)];
      thinned[2 * i + 1] = column[Math.max(low, high)];
    });
    return thinned;
  }

  /// An array of a length, from one that is kept for the next picture.
  #array(k, length) {
    if (!(this.arrays[k]?.length >= length)) this.arrays[k] = new Float64Array(2 * length);
    return this.arrays[k].subarray(0, length);
  }

  draw(points, time, spans) {
    this.spans = spans;
    this.time = time;
    // The columns of the points have the order of the series: time, then depth and force of each probe.
    const first = points.firstAfter(time.from), last = points.firstAfter(time.to + 1e-9);
    const curves = 2 * this.scene.probes.length;
    const size = Math.ceil(2 * (last - first) * curves / kMaxPoints);    // rows per bucket
    const buckets = [];
    // Buckets begin at multiples of their size, so that they scroll with the curves.
    for (let from = first, to; size > 2 && from < last; from = to) {
      to = Math.min(last, from + size - (from + points.dropped) % size);
      buckets.push([from, to]);
    }
    const data = points.names.map((name, k) => (size > 2 ? this.#thin(k, points[name], buckets) : points[name].subarray(first, last)));
    this.plot.batch(() => { this.plot.setData(data, false); this.plot.setScale('x', { min: time.from, max: time.to }); });
  }
}
