// The stimulation command of each electrode: amplitude, frequency or pulses, why it is off, and its course in time.
import { context, setAttribute, setText } from './canvas.js';
import { css } from './colours.js';
import { Columns, kKept_s } from './history.js';

const kPulses_s = 0.5;   // pulses are counted over so long
const kLane = { least: 5, most: 14, all: 84 };    // heights in CSS pixels
const kLegible = 11;     // height of a lane with room for its name
const kMax_s = 0.2;  // an amplitude without a frame is not drawn for longer
const kMaxSteps = 500;  // of a lane in one picture

export class Electrodes {
  /// \param lanes  canvas of the courses; its figure is hidden without electrodes
  constructor(place, lanes) { this.place = place; this.lanes = lanes; }

  setScene(scene) {
    this.scene = scene;
    this.recent = scene.electrodes.map(() => []);
    this.course = new Columns({ t: Float64Array, ...Object.fromEntries(scene.electrodes.map((unused, i) => [`a${i}`, Float32Array])) });
    this.place.hidden = this.lanes.parentElement.hidden = scene.electrodes.length === 0;
    this.lane = Math.min(kLane.most, Math.max(kLane.least, kLane.all / Math.max(1, scene.electrodes.length)));
    this.lanes.style.height = `${Math.round(this.lane * scene.electrodes.length)}px`;
    this.rows = scene.electrodes.map(({ name, amplitude_uA }) => {
      const row = document.createElement('div');
      row.className = 'electrode';
      const title = document.createElement('b'), meter = document.createElement('meter'), value = document.createElement('span');
      title.textContent = title.title = name;
      meter.max = amplitude_uA[1];
      setAttribute(meter, 'aria-label', `${name}, amplitude in µA`);
      row.append(title, meter, value);
      return { row, meter, value };
    });
    this.place.replaceChildren(...this.rows.map(({ row }) => row));
  }

  /// Adds what is shown to the frame: pulses are counted while the page is paused too. \param keepFrom  as for the history
  take(frame, keepFrom) {
    if (!frame.electrodes.length) return;
    if (frame.discard || (this.course.length && frame.t < this.course.t[this.course.end - 1])) this.course.clear();
    const row = { t: frame.t };
    frame.electrodes.forEach((electrode, i) => {
      const { amplitude, pulses, stop } = electrode, recent = this.recent[i];
      if (stop || frame.discard || (recent.length && frame.t < recent.at(-1).t)) recent.length = 0;
      if (pulses && !stop) recent.push({ t: frame.t, pulses, amplitude });
      while (recent.length && recent[0].t <= frame.t - kPulses_s) recent.shift();
      electrode.counted = recent.reduce((sum, each) => sum + each.pulses, 0);
      electrode.shown = electrode.counted ? recent.at(-1).amplitude : amplitude;
      row[`a${i}`] = stop ? -1 : pulses ? amplitude : electrode.counted ? 0 : amplitude;
    });
    this.course.push(row);
    this.course.discardBefore(Math.min(keepFrom, frame.t) - kKept_s);
  }

  show(frame) {
    frame.electrodes.forEach(({ shown, counted, frequency, stop }, i) => {
      const { row, meter, value } = this.rows[i];
      const on = shown > 0;
      if (meter.value !== (on ? shown : 0)) meter.value = on ? shown : 0;
      row.classList.toggle('on', on);
      row.classList.toggle('stopped', stop !== 0);
      const rate = counted ? `${(counted / kPulses_s).toFixed(0)} pulses/s` : `${frequency.toFixed(0)} Hz`;
      setText(value, stop ? `off: ${this.scene.stops[stop].replaceAll('_', ' ')}` : on ? `${shown.toFixed(shown < 10 ? 1 : 0)} µA, ${rate}` : 'off');
    });
  }

  /// One lane an electrode: the darker, the larger the amplitude; red: switched off. \param margins  of the trace above
  draw(time, margins) {
    if (!this.rows.length) return;
    const { course, lane } = this, { c, width } = context(this.lanes);
    const left = margins.left, w = Math.max(10, Math.min(margins.width, width - left));
    const first = course.firstAfter(time.from), last = course.firstAfter(time.to + 1e-9);
    const stride = Math.max(1, Math.ceil((last - first) / kMaxSteps));
    const x = (t) => left + Math.max(0, (t - time.from) / time.seconds) * w;
    const bar = css('--bar'), bad = css('--bad');
    this.scene.electrodes.forEach(({ name, amplitude_uA }, i) => {
      const y = i * lane, amplitudes = course[`a${i}`];
      for (let k = first; k < last; k += stride) {
        let most = 0, off = false;
        for (let j = k; j < Math.min(k + stride, last); ++j) { most = Math.max(most, amplitudes[j]); off ||= amplitudes[j] < 0; }
        if (most <= 0 && !off) continue;
        const before = k > course.begin ? Math.max(course.t[k - 1], course.t[k] - kMax_s) : course.t[k];
        const from = Math.round(x(before)), to = Math.round(x(course.t[Math.min(k + stride, last) - 1]));
        c.globalAlpha = off && most <= 0 ? 1 : 0.15 + 0.85 * Math.min(1, most / amplitude_uA[1]);
        c.fillStyle = off && most <= 0 ? bad : bar;
        c.fillRect(from, y + 0.5, Math.max(1, to - from), off && most <= 0 ? 2 : lane - 1);
      }
      c.globalAlpha = 1;
      if (lane < kLegible) return;
      c.font = '11px system-ui, sans-serif';
      c.fillStyle = css('--soft'); c.textAlign = 'left'; c.textBaseline = 'middle';
      c.fillText(name, 0, y + lane / 2, left - 4);
    });
    c.strokeStyle = css('--line');
    c.strokeRect(left, 0.5, w, lane * this.rows.length - 1);
  }

  /// The electrode and its amplitude under a pixel of the lanes; '' beside them.
  describe(x, y, time, margins) {
    const i = Math.floor(y / this.lane), t = time.from + (x - margins.left) / margins.width * time.seconds;
    const at = this.course.firstAfter(t);
    if (!this.rows[i] || t < time.from || at >= this.course.end) return '';
    const amplitude = this.course[`a${i}`][at];
    return `${this.scene.electrodes[i].name}, ${t.toFixed(2)} s: ${amplitude < 0 ? 'off' : `${amplitude.toFixed(1)} µA`}`;
  }
}
