// The big numbers, and a line for each probe where there are several.
import { byId } from './canvas.js';
import { kStateNames } from './health.js';

const milliseconds = (us) => (us < 1e4 ? (us / 1e3).toFixed(2) : (us / 1e3).toFixed(0));

export class Numbers {
  constructor() { this.selected = null; }

  setScene(scene) {
    this.scene = scene;
    this.selected = null;
    byId('probes').hidden = scene.probes.length < 2;
    this.rows = scene.probes.length < 2 ? [] : scene.probes.map((probe, i) => {
      const row = document.createElement('button');
      row.addEventListener('click', () => { this.selected = this.selected === i ? null : i; });
      return row;
    });
    byId('probes').replaceChildren(...this.rows);
  }

  /// The probe whose numbers are big: the chosen one, else the one that presses hardest.
  #shown(probes) {
    if (this.selected !== null) return this.selected;
    return probes.reduce((best, p, i) => (p.force > probes[best].force ? i : best), 0);
  }

  show(frame, { total, active, latency_us }) {
    const at = this.#shown(frame.probes), probe = frame.probes[at];
    const many = frame.probes.length > 1;
    byId('force').textContent = probe.force.toFixed(2);
    byId('depth').textContent = probe.depth.toFixed(2);
    byId('rate').textContent = total.toFixed(0);
    byId('latency-now').textContent = Number.isFinite(latency_us) ? milliseconds(latency_us) : '–';
    byId('force-of').textContent = many ? `${this.scene.probes[at].name}${this.selected === null ? ', hardest' : ''}` : '';
    byId('depth-of').textContent = probe.depth > 0 ? `at (${probe.x.toFixed(1)}, ${probe.y.toFixed(1)}) mm` : 'no contact';
    byId('rate-of').textContent = `${active} of ${this.scene.neurons} afferents fire`;
    this.rows.forEach((row, i) => {
      const p = frame.probes[i];
      row.setAttribute('aria-pressed', this.selected === i);
      row.textContent = `${this.scene.probes[i].name} ${p.force.toFixed(2)} N${p.state ? ` ${kStateNames[p.state]}` : ''}`;
      row.classList.toggle('touching', p.depth > 0);
    });
  }
}
