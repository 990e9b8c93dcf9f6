// Force and depth (of an array: its highest pressure) against time, a lane for each probe; lanes share the scale of a
// quantity, so that their heights can be compared. The plots below use the margins of these lanes.
import { byId, context, setText, sizeOf } from './canvas.js';
import { css } from './colours.js';
import { drawSpans } from './raster.js';

const kLowest_px = 16;      // height of one of several lanes
const kSmallest = { N: 0.1, mm: 0.1, kPa: 1 };    // peak of a scale, so that noise stays small
const kShare = { force: 0.72, reading: 0.95 };    // of a lane's height at the peak: curves of the same shape do not overlap

/// About three round numbers from zero to a value.
function ticksUpTo(most) {
  const decade = 10 ** Math.floor(Math.log10(most / 3.5)), step = decade * [1, 2, 5, 10].find((n) => n * decade >= most / 3.5);
  return Array.from({ length: Math.floor(most / step + 1e-9) + 1 }, (unused, i) => +(i * step).toPrecision(6));
}

export class Trace {
  constructor(canvas) { this.canvas = canvas; }

  setScene({ probes }) {
    this.probes = probes;
    this.measures = [...new Set(probes.map(({ measure }) => measure.name))].join(' and ');
    setText(byId('trace-depth'), [...new Set(probes.map(({ measure }) => `${measure.name}, ${measure.unit}`))].join('; '));
    byId('peaks').hidden = probes.length < 2;
    this.canvas.style.minHeight = probes.length > 1 ? `${kLowest_px * probes.length}px` : '';
  }

  /// The margins of the lanes, in CSS pixels.
  margins() {
    const several = this.probes.length > 1, left = several ? 60 : 46;
    return { left, width: Math.max(10, sizeOf(this.canvas).width - left - (several ? 76 : 44)) };
  }

  draw(points, time, spans) {
    const { c, height } = context(this.canvas), { left, width: w } = this.margins(), lane = height / this.probes.length;
    const rows = [points.firstAfter(time.from), points.firstAfter(time.to + 1e-9)];
    const curves = this.probes.map(({ measure }, i) => [['reading', measure.unit], ['force', 'N']].map(([name, unit]) => (
      { name, unit, column: points[`${name}${i}`], ...this.#extent(points[`${name}${i}`], rows) })));
    this.lanes = this.probes.map((probe, i) => {
      const box = { left, w, top: i * lane + 2, h: lane - 4 };
      const [reading, force] = curves[i].map((curve) => ({ ...curve, ...this.#scale(curve, curves.flat(), box) }));
      this.#axes(c, probe, { force, reading }, box);
      this.#curve(c, points, rows, time, box, reading, css('--depth'), false);
      this.#curve(c, points, rows, time, box, force, css('--force'), true);
      return { bottom: box.top + box.h, zero: force.y(0), most: { force: force.most, reading: reading.most } };
    });
    drawSpans(c, spans, time, { left, w, h: height }, false);
  }

  /// The lowest value, at most 0, and the highest of a curve in view.
  #extent(column, [first, last]) {
    let low = 0, peak = 0;
    for (let row = first; row < last; ++row) { low = Math.min(low, column[row]); peak = Math.max(peak, column[row]); }
    return { low, peak };
  }

  /// {most, y(value)}: the top of a curve's scale, that of all curves of its quantity, and the place of a value in its lane.
  #scale({ name, unit }, curves, { top, h }) {
    const same = curves.filter((curve) => curve.name === name && curve.unit === unit);
    const most = Math.max(kSmallest[unit], ...same.map(({ peak }) => peak)) / kShare[name];
    const low = Math.min(...same.map((curve) => curve.low));
    return { most, y: (value) => top + h * (most - value) / (most - low) };
  }

  /// One lane has two axes; several have the probe's name and the peaks of the curves.
  #axes(c, { name, measure }, { force, reading }, { left, w, top, h }) {
    const line = (y) => { c.beginPath(); c.moveTo(left, Math.round(y) + 0.5); c.lineTo(left + w, Math.round(y) + 0.5); c.stroke(); };
    const text = (string, x, y, align, colour) => { c.textAlign = align; c.fillStyle = css(colour); c.fillText(string, x, y); };
    c.textBaseline = 'middle';
    c.strokeStyle = css('--line');
    if (this.probes.length === 1) {
      const within = (y) => Math.min(top + h - 5, Math.max(top + 5, y));
      for (const value of ticksUpTo(force.most)) { line(force.y(value)); text(value, left - 6, within(force.y(value)), 'right', '--force'); }
      for (const value of ticksUpTo(reading.most)) text(value, left + w + 6, within(reading.y(value)), 'left', '--depth');
    } else {
      const middle = top + h / 2;
      c.fillStyle = css('--soft'); c.textAlign = 'left';
      c.fillText(name, 0, middle, left - 6);
      text(force.peak.toFixed(2), left + w + 36, middle, 'right', '--force');
      text(reading.peak.toFixed(measure.digits), left + w + 74, middle, 'right', '--depth');
    }
    c.strokeStyle = css('--zero');
    line(force.y(0));
  }

  /// Draws a curve: of each pixel the lowest and the highest value, in their order, so that no peak is lost.
  #curve(c, { t, dropped }, [first, last], time, { left, w }, { column, y }, colour, filled) {
    if (first === last) return;
    const x = (row) => left + Math.max(0, (t[row] - time.from) / time.seconds) * w;
    const size = Math.max(1, Math.ceil((last - first) / w));
    c.beginPath();
    // Groups begin at multiples of their size, so that they scroll with the curve.
    for (let from = first, to; from < last; from = to) {
      to = Math.min(last, from + size - (from + dropped) % size);
      let low = from, high = from;
      for (let row = from + 1; row < to; ++row) {
        if (column[row] < column[low]) low = row;
        if (column[row] > column[high]) high = row;
      }
      for (const row of [Math.min(low, high), Math.max(low, high)]) c.lineTo(x(row), y(column[row]));
    }
    c.strokeStyle = c.fillStyle = colour;
    c.lineWidth = this.probes.length > 1 ? 1.4 : 2;
    c.stroke();
    c.lineWidth = 1;
    if (!filled) return;
    c.lineTo(x(last - 1), y(0)); c.lineTo(x(first), y(0));
    c.globalAlpha = 0.22; c.fill(); c.globalAlpha = 1;
  }

  /// The values under a pixel, of the lane's probe; '' beside the lanes.
  describe(x, y, points, time) {
    const { left, width } = this.margins(), t = time.from + (x - left) / width * time.seconds;
    const row = points.firstAfter(t), i = Math.floor(y / sizeOf(this.canvas).height * this.probes.length);
    if (!this.probes[i] || t < time.from || row >= points.end) return '';
    const { name, measure } = this.probes[i];
    return `${points.t[row].toFixed(3)} s: ${this.probes.length > 1 ? `${name} ` : ''}${points[`force${i}`][row].toFixed(3)} N, `
      + `${points[`reading${i}`][row].toFixed(3)} ${measure.unit}`;
  }
}
