// The stimulation command of each electrode: amplitude, frequency or pulses, and why it is off.
import { setText } from './canvas.js';

const kPulses_s = 0.5;   // pulses are counted over so long

export class Electrodes {
  constructor(place) { this.place = place; }

  setScene(scene) {
    this.scene = scene;
    this.recent = scene.electrodes.map(() => []);
    this.place.hidden = scene.electrodes.length === 0;
    this.rows = scene.electrodes.map(({ name, amplitude_uA }) => {
      const row = document.createElement('div');
      row.className = 'electrode';
      const title = document.createElement('b'), meter = document.createElement('meter'), value = document.createElement('span');
      title.textContent = title.title = name;
      meter.max = amplitude_uA[1];
      row.append(title, meter, value);
      return { row, meter, value };
    });
    this.place.replaceChildren(...this.rows.map(({ row }) => row));
  }

  /// Adds what is shown to the frame: pulses are counted while the page is paused too.
  take(frame) {
    frame.electrodes.forEach((electrode, i) => {
      const { amplitude, pulses, stop } = electrode, recent = this.recent[i];
      if (stop || frame.discard || (recent.length && frame.t < recent.at(-1).t)) recent.length = 0;
      if (pulses && !stop) recent.push({ t: frame.t, pulses, amplitude });
      while (recent.length && recent[0].t <= frame.t - kPulses_s) recent.shift();
      electrode.counted = recent.reduce((sum, each) => sum + each.pulses, 0);
      electrode.shown = electrode.counted ? recent.at(-1).amplitude : amplitude;
    });
  }

  show(frame) {
    frame.electrodes.forEach(({ shown, counted, frequency, stop }, i) => {
      const { row, meter, value } = this.rows[i];
      const on = shown > 0;
      if (meter.value !== (on ? shown : 0)) meter.value = on ? shown : 0;
      row.classList.toggle('on', on);
      row.classList.toggle('stopped', stop !== 0);
      const rate = counted ? `${(counted / kPulses_s).toFixed(0)} pulses/s` : `${frequency.toFixed(0)} Hz`;
      setText(value, stop ? `off: ${this.scene.stops[stop].replaceAll('_', ' ')}` : on ? `${shown.toFixed(1)} µA, ${rate}` : 'off');
    });
  }
}
