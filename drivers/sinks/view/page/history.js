// The data that the page has received and kept, ordered by time.

export const kKept_s = 61;
const kMaxRows = 1 << 22;

/// Columns of numbers; the first one, t, never decreases. Old rows are dropped from the front.
export class Columns {
  /// \param types  name to typed array, as in {t: Float64Array, n: Uint32Array}
  constructor(types) {
    this.names = Object.keys(types);
    for (const name of this.names) this[name] = new types[name](1024);
    this.begin = 0;
    this.end = 0;
    this.dropped = 0;       // rows moved out of the arrays: index + dropped numbers a row for good
    this.generation = 0;    // increases when the history is cleared
  }
  get length() { return this.end - this.begin; }
  clear() { this.begin = this.end = 0; ++this.generation; }
  push(row) {
    if (this.end === this.t.length) this.#makeRoom(1);
    for (const name of this.names) this[name][this.end] = row[name];
    ++this.end;
  }
  /// Appends a typed array to each column; at most a quarter of the rows that are kept.
  append(columns) {
    const count = columns.t.length;
    while (this.end + count > this.t.length) this.#makeRoom(count);
    for (const name of this.names) this[name].set(columns[name], this.end);
    this.end += count;
  }
  /// Index of the first row at or after a time.
  firstAfter(t) {
    let low = this.begin, high = this.end;
    while (low < high) {
      const middle = (low + high) >> 1;
      if (this.t[middle] < t) low = middle + 1; else high = middle;
    }
    return low;
  }
  discardBefore(t) { this.begin = this.firstAfter(t); }
  #makeRoom(count) {
    if (this.length + count > kMaxRows) this.begin += kMaxRows >> 2;
    const grow = this.begin < this.t.length / 2 && this.t.length < kMaxRows;
    for (const name of this.names) {
      const kept = this[name].subarray(this.begin, this.end);
      if (grow) { const more = new this[name].constructor(2 * this.t.length); more.set(kept); this[`${name}_`] = more; }
      else this[name].copyWithin(0, this.begin, this.end);
    }
    if (grow) for (const name of this.names) { this[name] = this[`${name}_`]; delete this[`${name}_`]; }
    this.dropped += this.begin;
    this.end = this.length;
    this.begin = 0;
  }
}

/// The received data, and spans of time with a cause: held, released, skipped ticks, missed frames, marks.
export class History {
  constructor(scene) {
    this.scene = scene;
    const columns = { t: Float64Array };
    for (let i = 0; i < scene.probes.length; ++i) { columns[`reading${i}`] = Float32Array; columns[`force${i}`] = Float32Array; }
    this.points = new Columns(columns);
    this.spikes = new Columns({ t: Float64Array, n: Uint32Array });
    this.watched = new Map();   // afferent → Columns of t, drive, potential
    this.clear();
  }

  clear() {
    this.points.clear();
    this.spikes.clear();
    this.watched.clear();
    this.spans = [];            // {from, to, kind, probe, label}
    this.open = this.scene.probes.map(() => null);
    this.fired = new Uint32Array(this.scene.neurons);    // spikes of each afferent since the beginning
    this.number = 0;
    this.t = 0;
    this.started = false;
  }

  /// Takes a frame. \param keepFrom  start of the data to keep while the page is paused
  add(frame, keepFrom = frame.t) {
    if (frame.discard || (this.started && frame.t < this.t)) this.clear();
    if (this.started && frame.from > this.t + 1e-9) {
      const lost = frame.number - this.number - 1;
      this.spans.push({ from: this.t, to: frame.from, kind: 'missed', label: `${lost} frame${lost > 1 ? 's' : ''} missed by this page` });
    }
    this.number = frame.number;
    this.started = true;
    this.t = frame.t;
    for (const point of frame.points) this.#addPoint(point);
    this.spikes.append(frame.spikes);
    for (const n of frame.spikes.n) ++this.fired[n - 1];
    for (const { n: afferent, samples } of frame.watched) {
      if (!this.watched.has(afferent)) this.watched.set(afferent, new Columns({ t: Float64Array, drive: Float32Array, potential: Float32Array }));
      for (const sample of samples) this.watched.get(afferent).push(sample);
    }
    for (const item of frame.news) this.#addNews(item);
    const old = Math.min(keepFrom, frame.t) - kKept_s;
    this.points.discardBefore(old);
    this.spikes.discardBefore(old);
    for (const columns of this.watched.values()) columns.discardBefore(old);
    this.spans = this.spans.filter((span) => span.to >= old);
  }

  #addPoint(point) {
    const row = { t: point.t };
    point.values.forEach((value, i) => { row[`${i % 2 ? 'force' : 'reading'}${i >> 1}`] = value; });
    this.points.push(row);
    this.scene.probes.forEach((probe, i) => {
      if (i >= 16) return;
      const state = (point.state >> (2 * i)) & 3;
      const open = this.open[i];
      if (open && open.state === state) { open.to = point.t; return; }
      this.open[i] = null;
      if (state === 0 || state === 3) return;
      const kind = state === 1 ? 'held' : 'released';
      const span = { from: point.t, to: point.t, kind, state, probe: i, label: `${probe.name}: ${kind === 'held' ? 'sample late, last one kept' : 'no samples, taken off the skin'}` };
      this.open[i] = span;
      this.spans.push(span);
    });
  }

  #addNews(item) {
    if (item.kind === 'gap') this.spans.push({ from: item.t, to: item.t + item.length_s, kind: 'gap', label: 'ticks skipped' });
    if (item.kind === 'mark') this.spans.push({ from: item.t, to: item.t, kind: 'mark', label: item.label });
    if (item.kind === 'zero_uncertain') {
      const label = `${this.scene.probes[item.subject].name}: zero uncertain, stimulation suspended`;
      this.spans.push({ from: item.t, to: item.t, kind: 'mark', label });
    }
    if (item.kind === 'neuron_reset') this.spans.push({ from: item.t, to: item.t, kind: 'mark', label: `afferent ${item.subject} reset` });
  }

  /// Counts the spikes of each afferent in a span of time; index 0 is afferent 1.
  counts(from, to, all = new Uint32Array(this.scene.neurons)) {
    all.fill(0);
    const last = this.spikes.firstAfter(to + 1e-9);
    for (let i = this.spikes.firstAfter(from); i < last; ++i) ++all[this.spikes.n[i] - 1];
    return all;
  }

  /// Times of one afferent's spikes.
  spikesOf(afferent, from, to) {
    const times = [];
    const last = this.spikes.firstAfter(to + 1e-9);
    for (let i = this.spikes.firstAfter(from); i < last; ++i) if (this.spikes.n[i] === afferent) times.push(this.spikes.t[i]);
    return times;
  }
}
