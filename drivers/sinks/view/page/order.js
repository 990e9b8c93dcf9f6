// The order of the afferents in the raster.

const kAgain_s = 0.5, kMoved_mm = 0.5;
let orders = 0;

/// Rows of the raster: row → afferent, from the top, and afferent → row (−1: not shown).
export class RowOrder {
  constructor(scene, layout) {
    this.scene = scene;
    this.layout = layout;
    this.last = scene.probes.map(() => null);    // last position of each probe's press
    this.places = null;
    this.key = '';
    this.rows = new Uint32Array(0);
    this.number = 0;    // differs after each change
    this.rowOf = new Int32Array(scene.neurons + 1);
    this.edges = { rows: null, all: new Float32Array(1) };
    this.distance = new Float32Array(scene.neurons + 1).fill(Infinity);
  }

  /// Notes where the probes of a frame press.
  follow(probes) {
    probes.forEach((probe, i) => { if (probe.touching) this.last[i] = { x: probe.x, y: probe.y, depth: probe.depth }; });
  }

  /// \param by  'distance' or 'number'.  \param counts  spikes of each afferent in view
  update({ by, hideSilent, counts, now }) {
    const moved = this.#moved();
    const silent = hideSilent ? counts.reduce((sum, n) => sum + (n === 0), 0) : 0;
    const key = `${by} ${hideSilent} ${silent}`;
    if (!moved && key === this.key) return;
    if (by === 'distance' && key === this.key && now - this.updated < kAgain_s && now >= this.updated) return;
    this.key = key;
    this.by = by;
    this.updated = now;
    if (moved) this.#measure();
    let all = Array.from({ length: this.scene.neurons }, (unused, i) => i + 1);
    if (hideSilent) all = all.filter((n) => counts[n - 1] > 0);
    if (by === 'distance') all.sort((a, b) => (this.distance[a] - this.distance[b]) || a - b);
    this.rows = Uint32Array.from(all);
    this.number = ++orders;
    this.rowOf.fill(-1);
    this.rows.forEach((afferent, row) => { this.rowOf[afferent] = row; });
  }

  /// The start of each row, from 0 at the top to 1. If there are too many rows for the screen, rows sorted
  /// by distance get thinner with the square root of their number; height is then roughly to scale in mm.
  edgesFor(dense) {
    const { rows } = this, curved = dense && this.by === 'distance';
    if (this.edges.rows !== rows || this.edges.curved !== curved) {
      const all = Float32Array.from({ length: rows.length + 1 }, (unused, i) => (curved ? Math.sqrt(i / rows.length) : i / rows.length));
      this.edges = { rows, curved, all };
    }
    return this.edges.all;
  }

  /// The row at a height from 0 to 1.
  rowAt(height) { return Math.floor((this.edges.curved ? height * height : height) * this.rows.length); }

  /// True if a probe presses at a new position. Between presses its last position counts; otherwise the
  /// rows would change with every tap.
  #moved() {
    return !this.places || this.last.some((place, i) => {
      const before = this.places[i];
      return !place !== !before || (place && Math.hypot(place.x - before.x, place.y - before.y) > kMoved_mm);
    });
  }

  #measure() {
    this.places = this.last.map((place) => place && { ...place });
    this.distance.fill(Infinity);
    for (const placed of this.layout.placed) {
      const presses = this.places.filter((place, i) => place && this.scene.probes[i].patch === placed.index);
      for (let n = 0; n < placed.count && presses.length; ++n) {
        const [x, y] = placed.centre(n);
        this.distance[placed.first + n + 1] = Math.min(...presses.map((place) => Math.hypot(place.x - x, place.y - y)));
      }
    }
  }
}
