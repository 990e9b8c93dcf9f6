// The banner: the most severe current problem and its remedy.

const kFollowing = 0, kHeld = 1, kReleased = 2, kEnded = 3;
const kUnplugged = 2;

/// Whether a probe delivers no data. Showing its force as 0 would look like a probe in the air.
export const isBlind = (probe) => probe.state === kReleased || probe.link === kUnplugged;
const kSpan_s = 5;

/// Keeps the counters of the last seconds, to distinguish lasting problems from single events.
export class Trend {
  constructor() { this.rows = []; }
  clear() { this.rows = []; }
  add(frame) {
    if (this.rows.length && frame.t < this.rows.at(-1).t) this.clear();
    this.rows.push({ t: frame.t, counters: frame.counters, latency: frame.latency });
    while (this.rows.length > 2 && this.rows[1].t <= frame.t - kSpan_s) this.rows.shift();
  }
  #row(ago) {
    const newest = this.rows.at(-1);
    return this.rows.find((row) => row.t >= newest.t - ago) ?? newest;
  }
  /// The increase of a counter between two times, in seconds before the newest frame.
  rise(name, from_ago, to_ago = 0) { return this.#row(to_ago).counters[name] - this.#row(from_ago).counters[name]; }
  /// True if a counter rose by more than a share of the ticks in both halves of the last seconds.
  lasts(name, share) {
    if (this.rows.length < 3) return false;
    return [[kSpan_s, kSpan_s / 2], [kSpan_s / 2, 0]].every(([from, to]) => {
      const ticks = this.rise('ticks', from, to);
      return ticks > 0 && this.rise(name, from, to) > share * ticks;
    });
  }
  /// Ticks per latency bin over the last seconds.
  latency(seconds) {
    if (!this.rows.length) return [];
    const before = this.#row(seconds).latency, now = this.rows.at(-1).latency;
    const bins = now.map((n, i) => n - before[i]);
    return bins.some((n) => n > 0) ? bins : now;
  }
}

const quoted = (names) => (names.length > 3 ? `${names.length} probes` : names.join(', '));

function ofProbes(scene, frame, heldFor_s) {
  const named = (test) => scene.probes.filter((probe, i) => test(frame.probes[i], i)).map((probe) => probe.name);
  const unplugged = named((p) => p.link === kUnplugged);
  if (unplugged.length) {
    return { level: 'bad', title: `Unplugged: ${quoted(unplugged)}`, advice: 'Reconnecting. Plug the cable in again; the run continues automatically.' };
  }
  const released = named((p) => p.state === kReleased);
  if (released.length) {
    return { level: 'bad', title: `No samples: ${quoted(released)}`, advice: 'Its press is taken off the skin until samples arrive. Check the device and its cable.' };
  }
  const silent = named((p, i) => p.state === kHeld && heldFor_s[i] > 0.02);
  if (silent.length) {
    return { level: 'warn', title: `Late: ${quoted(silent)}`, advice: 'The next sample has not arrived, so the last one is kept. If none follows, the press is taken off the skin.' };
  }
  return null;
}

function ofMachine(trend) {
  if (trend.rows.length < 2) return null;
  const skipped = trend.rise('skipped_ticks', kSpan_s);
  if (skipped > 0) {
    return { level: 'warn', title: `Too slow: ${skipped} ticks skipped`, advice: 'Close other programs, or simplify the scene: merkel plan shows the cost of its parts.' };
  }
  if (trend.lasts('overruns', 0.02)) {
    return { level: 'warn', title: 'Repeated overruns', advice: 'Spikes are late. Find the cause with merkel doctor.' };
  }
  const dropped = trend.rise('samples_dropped', kSpan_s) + trend.rise('spikes_dropped', kSpan_s);
  if (dropped > 0) return { level: 'warn', title: `Dropped: ${dropped} samples or spikes`, advice: 'A queue was full. Remove slow sinks, or make their receivers faster.' };
  const late = trend.rise('samples_late', kSpan_s), samples = trend.rise('samples', kSpan_s);
  if (late > 0 && late > 0.005 * samples) {
    const share = samples > 0 ? `: ${(100 * late / samples).toFixed(late < 0.1 * samples ? 1 : 0)} %` : '';
    return { level: 'warn', title: `Late samples${share}`, advice: 'Increase delay_ms of the probe in the scene, or reduce the latency timer of the port.' };
  }
  return null;
}

/// The present {level, title, advice}. \param socket  'connecting', 'live', 'stalled' (connected, but no frames) or 'lost'
export function healthOf({ socket, scene, frame, trend, heldFor_s }) {
  if (frame?.over) return { level: 'over', title: 'Run ended', advice: 'The page keeps the last picture. If merkel starts again, the page reconnects.' };
  if (socket === 'lost') return { level: 'bad', title: 'Connection lost', advice: 'Reconnecting. Check in the terminal that merkel is running.' };
  if (socket === 'stalled') return { level: 'bad', title: 'No data from merkel', advice: 'The program has stopped, or the network is too slow. Everything shown is old.' };
  if (socket === 'connecting' || !frame) return { level: 'warn', title: 'Connecting', advice: 'Waiting for the first data.' };
  const problem = ofProbes(scene, frame, heldFor_s) ?? ofMachine(trend);
  if (problem) return problem;
  if (frame.stopped) return { level: 'warn', title: 'Stimulation stopped', advice: 'All electrodes are off until it is started again.' };
  const uncertain = scene.probes.filter((probe, i) => frame.probes[i].uncertain);
  if (uncertain.length) return { level: 'warn', title: 'Zero uncertain', advice: `The force of ${quoted(uncertain.map((p) => p.name))} may be drift, and stimulation is suspended: lift the probe, or tare it.` };
  if (frame.still) return { level: 'over', title: 'Replay paused', advice: 'Press Play to continue; drag the slider to seek.' };
  const touching = scene.probes.filter((probe, i) => frame.probes[i].touching);
  const what = scene.session ? 'Replay' : 'Connected';
  if (frame.probes.every((p) => p.state === kEnded)) return { level: 'over', title: 'Press ended', advice: 'The last sample is held.' };
  return touching.length
    ? { level: 'good', title: `${what}, pressing`, advice: scene.probes.length > 1 ? quoted(touching.map((p) => p.name)) : '' }
    : { level: 'good', title: `${what}, not touching`, advice: '' };
}

export const kStateNames = { [kFollowing]: 'following', [kHeld]: 'late', [kReleased]: 'no samples', [kEnded]: 'ended' };
