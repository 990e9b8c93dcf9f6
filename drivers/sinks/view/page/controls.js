// The controls of the run, if permitted, and the slider of a replayed session.
import { byId, setAttribute, setText } from './canvas.js';

const kNotice_ms = 6000;

export class Controls {
  constructor(send) {
    this.send = send;
    this.recording = false;
    this.dragging = false;
    byId('tare').addEventListener('click', () => send('tare', byId('tare-probe').value));
    byId('mark').addEventListener('submit', (event) => {
      event.preventDefault();
      const label = byId('mark-label').value.trim();
      send('mark', label || 'mark');
      byId('mark-label').value = '';
    });
    byId('record').addEventListener('click', () => send('record', this.recording ? 'stop' : 'start'));
    byId('stop').addEventListener('click', () => send('stop'));
    byId('start').addEventListener('click', () => send('start'));
    byId('play').addEventListener('click', () => send(this.still ? 'play' : 'pause'));
    const slider = byId('seek');
    slider.addEventListener('input', () => { this.dragging = true; this.#showPlace(Number(slider.value)); });
    slider.addEventListener('change', () => { this.dragging = false; send('seek', slider.value); });
  }

  setScene(scene) {
    this.scene = scene;
    byId('controls').hidden = !scene.control;
    byId('session').hidden = !scene.session;
    byId('stimulation').hidden = !scene.electrodes.length;
    byId('tare-probe').replaceChildren(...scene.probes.map((probe, i) => new Option(probe.name, i)));
    if (scene.probes.length > 1) byId('tare-probe').append(new Option('all probes', 'all'));
    byId('tare-probe').hidden = scene.probes.length < 2;
    if (scene.session) byId('seek').max = scene.session.length_s;
  }

  show(frame) {
    this.recording = frame.recording;
    this.still = frame.still;
    setAttribute(byId('record'), 'aria-pressed', frame.recording);
    setText(byId('record'), frame.recording ? 'Stop recording' : 'Record');
    byId('stop').disabled = frame.stopped;
    setText(byId('stop'), frame.stopped ? 'Stimulation stopped' : 'Stop stimulation');
    byId('start').hidden = !(frame.stopped && this.scene.control);
    setText(byId('play'), frame.still ? 'Play' : 'Pause replay');
    for (const item of frame.news) if (item.kind === 'notice') this.#notice(item.label);
    if (this.scene.session && !this.dragging) { byId('seek').value = frame.t; this.#showPlace(frame.t); }
  }

  #showPlace(t) { setText(byId('seek-value'), `${t.toFixed(1)} of ${this.scene.session.length_s.toFixed(1)} s`); }

  #notice(text) {
    byId('notice').textContent = text;
    byId('notice').hidden = false;
    clearTimeout(this.timer);
    this.timer = setTimeout(() => { byId('notice').hidden = true; }, kNotice_ms);
  }
}
