// The page: receives frames, keeps their data, and draws at most once per screen refresh.
import { byId, follow, setAttribute, setText } from './canvas.js';
import { Connection } from './connection.js';
import { Controls } from './controls.js';
import { Details } from './details.js';
import { Electrodes } from './electrodes.js';
import { drawLegend, Finger } from './finger.js';
import { readFrame } from './frames.js';
import { healthOf, Trend } from './health.js';
import { History, kKept_s } from './history.js';
import { fill, Latency, showCounters } from './more.js';
import { Numbers } from './numbers.js';
import { RowOrder } from './order.js';
import { Raster } from './raster.js';
import { Rates } from './rates.js';
import { setUpSaving } from './save.js';
import { setUpKeys, setUpTheme } from './settings.js';
import { Sound } from './sound.js';
import { Trace } from './trace.js';

const kNumbers_ms = 100;     // between new numbers: faster than anyone reads
const kLit_ms = 120;           // of the sync line's light
const kCounters_ms = 500;
const kCalm_ms = 500;        // between pictures, if the browser requests reduced motion
const kStalled_ms = 3000;    // without a frame: several periods of the slowest rate
const kTimed = 200;          // pictures whose drawing times are kept

class Page {
  constructor() {
    this.socket = 'connecting';
    this.frame = this.scene = this.paused = null;    // paused: {t, frame}
    this.trend = new Trend();
    this.dirty = true;       // the user changed the view
    this.calm = matchMedia('(prefers-reduced-motion: reduce)');
    this.drawn_ms = this.numbered_ms = this.counted_ms = 0;
    this.draws = 0;
    this.costs = new Float32Array(kTimed);
    this.finger = new Finger(byId('skin'));
    this.finger.changed = () => { this.dirty = true; };
    this.raster = new Raster(byId('raster'));
    this.trace = new Trace(byId('trace'));
    this.latency = new Latency(byId('latency'));
    this.numbers = new Numbers(() => { this.dirty = true; });
    this.electrodes = new Electrodes(byId('electrodes'), byId('lanes'));
    this.sound = new Sound();
    this.details = new Details(byId('details'), (afferents) => {
      this.connection?.send('watch', ...afferents);
      byId('side').dataset.chosen = afferents.length;
      this.dirty = true;
    });
    this.connection = new Connection({
      hello: (scene) => this.setScene(scene),
      frame: (buffer) => { if (this.scene) this.take(readFrame(buffer, this.scene)); },
      state: (socket) => { this.socket = socket; this.dirty = true; },
    });
    this.controls = new Controls((...words) => this.connection.send(...words));
    this.readings = [this.#readSkin(), this.#readTrace(), this.#readRaster(), this.#readLanes()];
    this.received_ms = performance.now();
    setInterval(() => this.#watchSilence(), 1000);
  }

  setScene(scene) {
    this.scene = scene;
    this.frame = this.paused = null;
    scene.probes.forEach((probe, i) => {
      probe.name = this.#nameOf(scene, i);
      probe.measure = probe.taxels ? { name: 'pressure', unit: 'kPa', digits: 1 } : { name: 'depth', unit: 'mm', digits: 2 };
    });
    this.history = new History(scene);
    this.rates = new Rates(scene.neurons);
    this.trend.clear();
    this.finger.setScene(scene);
    this.order = new RowOrder(scene, this.finger.layout);
    this.electrodes.setScene(scene);
    this.trace.setScene(scene);
    this.details.setScene(scene, this.finger.layout);
    this.controls.setScene(scene);
    this.numbers.setScene(scene);
    this.heldSince = scene.probes.map(() => null);
    byId('scene').textContent = scene.scene;
    document.title = `merkel: ${scene.scene}`;
    fill(byId('facts'), scene.facts);
    this.showPause();
  }

  /// A probe has the name of its patch, unless the patch has no name or several probes.
  #nameOf(scene, i) {
    const { patch } = scene.probes[i], name = scene.patches[patch].name;
    const alone = scene.probes.filter((other) => other.patch === patch).length === 1;
    if (scene.probes.length === 1) return name || 'probe';
    return name && alone ? name : `${name ? `${name}, ` : ''}probe ${i + 1}`;
  }

  take(frame) {
    this.frame = frame;
    this.received_ms = performance.now();
    if (frame.discard && this.paused) this.togglePause();
    this.history.add(frame, this.paused ? this.paused.t : frame.t);
    this.trend.add(frame);
    this.#showPulses(frame.news.filter(({ kind }) => kind === 'sync').length);
    this.electrodes.take(frame, this.paused ? this.paused.t : frame.t);
    frame.probes.forEach((probe, i) => { this.heldSince[i] = probe.state === 1 ? this.heldSince[i] ?? frame.t : null; });
    if (!this.paused) this.order.follow(frame.probes);
    if (!this.paused) this.sound.play(frame, this.details.afferents);
    if (this.paused && frame.t > this.paused.t + kKept_s) this.togglePause();
    this.controls.show(frame);
    this.#request();
  }

  /// The light of the sync line: on for a moment at each pulse.
  #showPulses(pulses) {
    if (pulses === 0) return;
    const light = byId('sync');
    this.pulses = (this.pulses ?? 0) + pulses;
    light.hidden = false;
    setAttribute(light, 'title', `${this.pulses} pulses of the sync line`);
    setAttribute(light, 'data-on', 1);
    clearTimeout(this.lit);
    this.lit = setTimeout(() => setAttribute(light, 'data-on', 0), kLit_ms);
  }

  time() {
    const seconds = Number(byId('window').value), now = this.paused ? this.paused.t : this.frame?.t ?? 0;
    const to = Math.max(seconds, now);
    return { from: to - seconds, to, now, seconds };
  }

  shown() { return this.paused?.frame ?? this.frame; }

  get dirty() { return this.changed; }
  set dirty(changed) {
    this.changed = changed;
    if (changed) this.#request();
  }

  /// Draws at the next screen refresh, or later for a browser that requests reduced motion.
  #request() {
    if (this.requested) return;
    const left_ms = this.calm?.matches && !this.dirty ? this.drawn_ms + kCalm_ms - performance.now() : 0;
    if (left_ms > 0) { this.timer ??= setTimeout(() => { this.timer = undefined; this.#request(); }, left_ms); return; }
    this.requested = true;
    requestAnimationFrame(() => { this.requested = false; this.draw(); });
  }

  draw() {
    const started = performance.now(), asked = this.dirty;
    this.changed = false;
    this.drawn_ms = started;
    if (!this.scene || !this.frame) { this.#drawBanner(); return; }
    const frame = this.shown(), time = this.time();
    this.rates.update(this.history, time.now);
    const due = (last_ms, every_ms) => asked || frame.over || started - last_ms >= every_ms;
    const states = frame.probes.map((p) => `${p.touching} ${p.state} ${p.link}`).join();
    if (states !== this.states || due(this.numbered_ms, kNumbers_ms)) {
      this.numbered_ms = started;
      this.states = states;
      this.#drawBanner();
      this.numbers.show(frame, this.rates, this.trend.latency(2));
      this.electrodes.show(frame);
    }
    this.#drawPictures(frame, time);
    this.readings.forEach((reading) => reading.update());
    if (due(this.counted_ms, kCounters_ms)) {
      this.counted_ms = started;
      this.#showCounters();
    }
    this.costs[this.draws++ % kTimed] = performance.now() - started;
  }

  #drawPictures(frame, time) {
    const hideSilent = byId('hide-silent').checked, { hz, most } = this.rates, pins = this.details.afferents;
    this.order.update({ by: byId('order').value, hideSilent, counts: this.history.fired, now: time.now });
    this.finger.draw({ rates: hz, most, probes: frame.probes, pins });
    drawLegend(most);
    this.trace.draw(this.history.points, time, this.history.spans);
    this.electrodes.draw(time, this.trace.margins());
    this.mode = this.raster.draw({
      spikes: this.history.spikes, time, order: this.order, margins: this.trace.margins(), spans: this.history.spans, pins,
    });
    this.details.draw(this.history, time);
  }

  #showCounters() {
    const { frame } = this;
    showCounters(frame, this.trend, this.scene);
    this.latency.draw(frame.latency);
    setText(byId('clock'), frame.t.toFixed(1));
    setText(byId('spikes'), String(frame.counters.spikes));
    this.#describePlots();
  }

  /// What the plots show, for screen readers.
  #describePlots() {
    const { scene, rates } = this, frame = this.shown();
    const presses = frame.probes.map((p, i) => `${scene.probes[i].name} ${p.force.toFixed(2)} N, ${p.reading.toFixed(2)} ${scene.probes[i].measure.unit}`).join('; ');
    const firing = `${rates.active} of ${scene.neurons} afferents fire, ${rates.total.toFixed(0)} spikes per second`;
    setAttribute(byId('trace'), 'aria-label', `Force and ${this.trace.measures} against time. Now: ${presses}`);
    setAttribute(byId('raster'), 'aria-label', `Spike raster of ${this.order.rows.length} afferents. Now: ${firing}`);
    setAttribute(byId('skin'), 'aria-label', `Receptive fields on the skin, coloured by rate, and the contact. Now: ${firing}`);
  }

  /// Drawing times of the last pictures, ms, in increasing order; for the console and for measurements.
  drawingTimes() { return [...this.costs.subarray(0, Math.min(this.draws, kTimed))].sort((a, b) => a - b); }

  /// Without frames nothing draws, and the last banner would stand.
  #watchSilence() {
    const stalled = this.socket === 'live' && this.frame !== null && performance.now() - this.received_ms > kStalled_ms;
    if (stalled !== Boolean(this.stalled)) { this.stalled = stalled; this.dirty = true; }
  }

  #drawBanner() {
    const heldFor_s = (this.heldSince ?? []).map((since) => (since === null ? 0 : this.frame.t - since));
    const socket = this.stalled ? 'stalled' : this.socket;
    this.health = healthOf({ socket, scene: this.scene, frame: this.frame, trend: this.trend, heldFor_s });
    const banner = byId('banner');
    banner.dataset.level = this.health.level;
    setText(byId('state'), this.health.title);
    setText(byId('advice'), this.health.advice);
  }

  #describe(afferent) {
    const away = this.order.distance[afferent];
    const distance = Number.isFinite(away) ? `, ${away.toFixed(1)} mm from the press` : '';
    return `afferent ${afferent}: ${(this.rates?.hz[afferent - 1] ?? 0).toFixed(0)} /s${distance}`;
  }

  #readSkin() {
    return follow(byId('skin'), byId('skin-value'), {
      describe: (x, y) => { const hit = this.finger.hit(x, y); return hit ? `(${hit.x.toFixed(1)}, ${hit.y.toFixed(1)}) mm, ${this.#describe(hit.afferent)}` : ''; },
      choose: (x, y) => { const hit = this.finger.hit(x, y); if (hit) this.details.choose(hit.afferent); },
    });
  }

  #readTrace() {
    return follow(byId('trace'), byId('trace-value'), {
      describe: (x, y) => (this.frame ? this.trace.describe(x, y, this.history.points, this.time()) : ''),
    });
  }

  #readRaster() {
    const hit = (x, y) => (this.frame ? this.raster.hit(x, y, this.trace.margins(), this.time(), this.order) : null);
    return follow(byId('raster'), byId('raster-value'), {
      describe: (x, y) => { const at = hit(x, y); return at ? `${at.t.toFixed(3)} s, ${this.#describe(at.afferent)}` : ''; },
      choose: (x, y) => { const at = hit(x, y); if (at) this.details.choose(at.afferent); },
    });
  }

  #readLanes() {
    return follow(byId('lanes'), byId('courses-value'), {
      describe: (x, y) => (this.scene ? this.electrodes.describe(x, y, this.time(), this.trace.margins()) : ''),
    });
  }

  togglePause() {
    this.paused = this.paused || !this.frame ? null : { t: this.frame.t, frame: this.frame };
    this.showPause();
  }
  showPause() {
    byId('pause').setAttribute('aria-pressed', this.paused !== null);
    byId('pause').textContent = this.paused ? 'Resume view' : 'Pause view';
    this.dirty = true;
  }
}

const page = new Page();
setUpTheme(() => { page.dirty = true; });
setUpKeys(page);
setUpSaving(page);
document.addEventListener('canvas-resized', () => { page.dirty = true; });
globalThis.merkel = page;    // for the console and for tests
