// Decodes a frame; view_frames.hpp describes the format.

const kOver = 1, kDiscard = 2, kRecording = 4, kStill = 8, kStopped = 16;

class Reader {
  constructor(buffer) { this.view = new DataView(buffer); this.at = 0; }
  u32() { const v = this.view.getUint32(this.at, true); this.at += 4; return v; }
  f32() { const v = this.view.getFloat32(this.at, true); this.at += 4; return v; }
  f64() { const v = this.view.getFloat64(this.at, true); this.at += 8; return v; }
  list(one) { const n = this.u32(); const all = []; for (let i = 0; i < n; ++i) all.push(one()); return all; }
  text() {
    const bytes = new Uint8Array(this.view.buffer, this.at + 4, this.u32());
    this.at += bytes.length;
    return new TextDecoder().decode(bytes);
  }
}

/// Decodes one frame. Times are seconds since the first tick; `origin_s` is the probe time of that tick.
export function readFrame(buffer, scene) {
  const r = new Reader(buffer);
  const missed = r.u32();
  const number = r.u32();
  const flags = r.u32();
  const origin_s = r.f64(), from = r.f64(), t = r.f64();
  const counters = r.list(() => r.f64());
  const probes = r.list(() => {
    const probe = { depth: r.f32(), force: r.f32() * 1e-3, x: r.f32(), y: r.f32(), radius: r.f32(), gauge_depth: r.f32(), tip: { x: r.f32(), y: r.f32() } };
    const state = r.u32();
    const taxels = r.list(() => r.f32());
    // An array measures pressures, and no depth.
    const reading = taxels.length ? Math.max(...taxels) : probe.depth;
    return { ...probe, reading, state: state & 3, uncertain: (state & 64) !== 0, touching: (state & 128) !== 0, link: state >> 8, taxels };
  });
  const points = r.list(() => ({
    t: t - r.f32(), state: r.u32(), values: probes.flatMap(() => [r.f32(), r.f32() * 1e-3]),
  }));
  const count = r.u32();
  const spikes = { t: new Float64Array(count), n: new Uint32Array(count) };
  for (let i = 0; i < count; ++i) { spikes.t[i] = t - r.f32(); spikes.n[i] = r.u32(); }
  const latency = r.list(() => r.u32());
  const watched = r.list(() => ({
    n: r.u32(), samples: r.list(() => ({ t: t - r.f32(), drive: r.f32(), potential: r.f32() })),
  }));
  const electrodes = r.list(() => ({ amplitude: r.f32(), frequency: r.f32(), stop: r.u32(), pulses: r.u32() }));
  const text = r.text();
  return {
    missed, number, origin_s, from, t, probes, points, spikes, latency, watched, electrodes,
    over: (flags & kOver) !== 0, discard: (flags & kDiscard) !== 0,
    recording: (flags & kRecording) !== 0, still: (flags & kStill) !== 0,
    stopped: (flags & kStopped) !== 0,
    counters: Object.fromEntries(scene.counters.map(({ name }, i) => [name, counters[i]])),
    news: text ? JSON.parse(text) : [],
  };
}
