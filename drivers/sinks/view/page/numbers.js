// The large numbers, and a line for each probe if there are several.
import { byId, setAttribute, setText } from './canvas.js';
import { isBlind, kStateNames } from './health.js';
import { quantile_us } from './more.js';

const milliseconds = (us) => (us < 1e4 ? (us / 1e3).toFixed(2) : (us / 1e3).toFixed(0));

export class Numbers {
  /// \param changed  called when the user selects a probe
  constructor(changed) { this.selected = null; this.changed = changed; }

  setScene(scene) {
    this.scene = scene;
    this.selected = null;
    byId('probes').hidden = scene.probes.length < 2;
    setText(byId('latency-to'), `Touch to ${scene.electrodes.length > 0 ? 'commands' : 'spikes'}, ms`);
    this.rows = scene.probes.length < 2 ? [] : scene.probes.map((probe, i) => {
      const row = document.createElement('button');
      row.addEventListener('click', () => { this.selected = this.selected === i ? null : i; this.changed(); });
      return row;
    });
    byId('probes').replaceChildren(...this.rows);
  }

  /// The probe shown by the large numbers: the selected one, else the one that presses hardest.
  #shown(probes) {
    if (this.selected !== null) return this.selected;
    return probes.reduce((best, p, i) => (p.force > probes[best].force ? i : best), 0);
  }

  /// \param latency  ticks per bin
  show(frame, { total, active }, latency) {
    const at = this.#shown(frame.probes), probe = frame.probes[at];
    const many = frame.probes.length > 1;
    const blind = isBlind(probe), latency_us = quantile_us(latency, 0.5);
    setText(byId('force'), blind ? '–' : probe.force.toFixed(2));
    const { name, unit, digits } = this.scene.probes[at].measure, array = probe.taxels.length > 0;
    setText(byId('depth-to'), `${name[0].toUpperCase()}${name.slice(1)}, ${unit}`);
    setText(byId('depth'), blind ? '–' : probe.reading.toFixed(digits));
    setText(byId('rate'), total.toFixed(0));
    setText(byId('latency-now'), Number.isFinite(latency_us) ? milliseconds(latency_us) : '–');
    setText(byId('latency-of'), Number.isFinite(latency_us) ? `median; 99 %: ${milliseconds(quantile_us(latency, 0.99))}` : '');
    setText(byId('force-of'), many ? `${this.scene.probes[at].name}${this.selected === null ? ', hardest' : ''}` : '');
    const place = `(${probe.x.toFixed(1)}, ${probe.y.toFixed(1)}) mm`;
    // Under force control the model computes the depth; a gauge that measures depth may differ.
    const gauge = this.scene.probes[at].control === 'force' && probe.gauge_depth !== 0 ? `by the model; gauge ${probe.gauge_depth.toFixed(2)}` : '';
    setText(byId('depth-of'), blind ? 'no data' : array ? `highest of ${probe.taxels.length} taxels` : gauge || (probe.touching ? place : 'no contact'));
    setAttribute(byId('depth-of'), 'title', gauge ? `The model computes ${probe.depth.toFixed(2)} mm from the force; the gauge measures ${probe.gauge_depth.toFixed(2)} mm. ${place}` : place);
    setText(byId('rate-of'), `${active} of ${this.scene.neurons} fire`);
    this.rows.forEach((row, i) => {
      const p = frame.probes[i];
      setAttribute(row, 'aria-pressed', this.selected === i);
      setText(row, `${this.scene.probes[i].name} ${isBlind(p) ? '–' : p.force.toFixed(2)} N${p.state ? ` ${kStateNames[p.state]}` : ''}`);
      row.classList.toggle('touching', p.touching);
    });
  }
}
