// The page: receives frames, keeps their data, and draws at most once per screen refresh.
import { byId, follow, setText } from './canvas.js';
import { Connection } from './connection.js';
import { Controls } from './controls.js';
import { Details } from './details.js';
import { Electrodes } from './electrodes.js';
import { drawLegend, Finger } from './finger.js';
import { readFrame } from './frames.js';
import { healthOf, Trend } from './health.js';
import { History, kKept_s } from './history.js';
import { fill, Latency, quantile_us, showCounters } from './more.js';
import { Numbers } from './numbers.js';
import { RowOrder } from './order.js';
import { Raster } from './raster.js';
import { setUpSaving } from './save.js';
import { setUpKeys, setUpTheme } from './settings.js';
import { Sound } from './sound.js';
import { Trace } from './trace.js';

const kRateWindow_s = 0.5, kLeastScale = 50, kCounters_ms = 500;
const kCalm_ms = 500;    // between pictures, if the browser requests reduced motion

class Page {
  constructor() {
    this.socket = 'connecting';
    this.frame = this.scene = this.paused = null;    // paused: {t, frame}
    this.trend = new Trend();
    this.dirty = true;       // the user changed the view
    this.newer = false;      // new data arrived
    this.calm = matchMedia('(prefers-reduced-motion: reduce)');
    this.drawn_ms = 0;
    this.finger = new Finger(byId('skin'));
    this.finger.changed = () => { this.dirty = true; };
    this.raster = new Raster(byId('raster'));
    this.trace = new Trace(byId('trace'));
    this.latency = new Latency(byId('latency'));
    this.numbers = new Numbers();
    this.electrodes = new Electrodes(byId('electrodes'));
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
    this.readings = [this.#readSkin(), this.#readRaster()];
    this.worst_ms = this.counted_ms = 0;
  }

  setScene(scene) {
    this.scene = scene;
    this.frame = this.paused = null;
    scene.probes.forEach((probe, i) => { probe.name = this.#nameOf(scene, i); });
    this.history = new History(scene);
    this.trend.clear();
    this.finger.setScene(scene);
    this.order = new RowOrder(scene, this.finger.layout);
    this.trace.setScene(scene);
    this.details.setScene(scene, this.finger.layout);
    this.controls.setScene(scene);
    this.numbers.setScene(scene);
    this.electrodes.setScene(scene);
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
    if (frame.forget && this.paused) this.togglePause();
    this.history.add(frame, this.paused ? this.paused.t : frame.t);
    this.trend.add(frame);
    this.electrodes.take(frame);
    frame.probes.forEach((probe, i) => { this.heldSince[i] = probe.state === 1 ? this.heldSince[i] ?? frame.t : null; });
    if (!this.paused) this.sound.play(frame, this.details.afferents);
    if (this.paused && frame.t > this.paused.t + kKept_s) this.togglePause();
    this.controls.show(frame);
    this.newer = true;
  }

  time() {
    const seconds = Number(byId('window').value), now = this.paused ? this.paused.t : this.frame?.t ?? 0;
    const to = Math.max(seconds, now);
    return { from: to - seconds, to, now, seconds };
  }

  shown() { return this.paused?.frame ?? this.frame; }

  draw() {
    requestAnimationFrame(() => this.draw());
    const started = performance.now();
    const due = started - this.drawn_ms >= (this.calm.matches ? kCalm_ms : 0);
    if (!this.dirty && !(this.newer && due)) return;
    this.dirty = this.newer = false;
    this.drawn_ms = started;
    this.#drawBanner();
    if (!this.scene || !this.frame) return;
    const frame = this.shown(), time = this.time();
    const counts = this.history.counts(time.now - kRateWindow_s, time.now);
    const seconds = Math.min(kRateWindow_s, Math.max(time.now, 0.04));
    this.rates = Float32Array.from(counts, (n) => n / seconds);
    this.most = this.rates.reduce((a, b) => Math.max(a, b), kLeastScale);
    const total = counts.reduce((a, b) => a + b, 0) / seconds, active = counts.reduce((sum, n) => sum + (n > 0), 0);
    const latency = this.trend.latency(2);
    this.numbers.show(frame, { total, active, latency_us: quantile_us(latency, 0.99) });
    this.electrodes.show(frame);
    const hideSilent = byId('hide-silent').checked;
    const inWindow = hideSilent ? this.history.counts(time.from, time.to) : counts;
    this.order.update({ by: byId('order').value, hideSilent, counts: inWindow, probes: frame.probes, now: time.now });
    const pins = this.details.afferents;
    this.finger.draw({ rates: this.rates, most: this.most, probes: frame.probes, pins });
    drawLegend(this.most);
    this.trace.draw(this.history.points, time, this.history.spans);
    document.body.dataset.raster = this.raster.draw({
      spikes: this.history.spikes, time, order: this.order, margins: this.trace.margins(), spans: this.history.spans, pins,
    });
    this.details.draw(this.history, time);
    this.readings.forEach((reading) => reading.tell());
    if (started - this.counted_ms > kCounters_ms || frame.over) {
      this.counted_ms = started;
      showCounters(this.frame, this.trend, this.scene);
      this.latency.draw(this.frame.latency);
      byId('clock').textContent = frame.t.toFixed(1);
      byId('spikes').textContent = String(this.frame.counters.spikes);
    }
    this.#measure(performance.now() - started);
  }

  /// Records the drawing time, for the console and for tests.
  #measure(ms) {
    (this.costs ??= []).push(ms);
    if (this.costs.length > 200) this.costs.shift();
    const sorted = [...this.costs].sort((a, b) => a - b);
    document.body.dataset.draws = Number(document.body.dataset.draws ?? 0) + 1;
    document.body.dataset.drawMs = sorted[sorted.length >> 1].toFixed(2);
    document.body.dataset.drawMs99 = sorted[Math.floor(0.99 * (sorted.length - 1))].toFixed(2);
  }

  #drawBanner() {
    const heldFor_s = (this.heldSince ?? []).map((since) => (since === null ? 0 : this.frame.t - since));
    this.health = healthOf({ socket: this.socket, scene: this.scene, frame: this.frame, trend: this.trend, heldFor_s });
    const banner = byId('banner');
    banner.dataset.level = this.health.level;
    setText(byId('state'), this.health.title);
    setText(byId('advice'), this.health.advice);
  }

  #describe(afferent) {
    const away = this.order.distance[afferent];
    const distance = Number.isFinite(away) ? `, ${away.toFixed(1)} mm from the press` : '';
    return `afferent ${afferent}: ${(this.rates?.[afferent - 1] ?? 0).toFixed(0)} /s${distance}`;
  }

  #readSkin() {
    return follow(byId('skin'), byId('skin-value'), {
      describe: (x, y) => { const hit = this.finger.hit(x, y); return hit ? `(${hit.x.toFixed(1)}, ${hit.y.toFixed(1)}) mm, ${this.#describe(hit.afferent)}` : ''; },
      choose: (x, y) => { const hit = this.finger.hit(x, y); if (hit) this.details.choose(hit.afferent); },
    });
  }

  #readRaster() {
    const hit = (x, y) => (this.frame ? this.raster.hit(x, y, this.trace.margins(), this.time(), this.order) : null);
    return follow(byId('raster'), byId('raster-value'), {
      describe: (x, y) => { const at = hit(x, y); return at ? `${at.t.toFixed(3)} s, ${this.#describe(at.afferent)}` : ''; },
      choose: (x, y) => { const at = hit(x, y); if (at) this.details.choose(at.afferent); },
    });
  }

  togglePause() {
    this.paused = this.paused || !this.frame ? null : { t: this.frame.t, frame: this.frame };
    this.showPause();
  }
  showPause() {
    byId('pause').setAttribute('aria-pressed', this.paused !== null);
    byId('pause').textContent = this.paused ? 'Resume' : 'Pause';
    this.dirty = true;
  }
}

const page = new Page();
setUpTheme(() => { page.trace.make(); page.dirty = true; });
setUpKeys(page);
setUpSaving(page);
new ResizeObserver(() => { page.trace.resize(); page.dirty = true; }).observe(document.querySelector('main'));
document.addEventListener('canvas-resized', () => { page.dirty = true; });
globalThis.merkel = page;    // for the console and for tests
page.draw();
