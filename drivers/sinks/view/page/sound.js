// Plays spikes as clicks, of the chosen afferents or of all. Silent until switched on.

const kAhead_s = 0.08;      // delay of the sound after the page: covers the frames' jitter
const kMax_s = 0.5;     // longest frame that is played: not a burst of history

export class Sound {
  constructor() { this.on = false; this.all = true; this.volume = 0.3; this.clicks = 0; }

  /// Must be called from a click or a key press: browsers do not start sound otherwise.
  toggle() {
    this.on = !this.on;
    if (this.on && !this.audio) {
      this.audio = new AudioContext();
      this.gain = this.audio.createGain();
      this.gain.connect(this.audio.destination);
      this.click = this.#makeClick();
    }
    if (this.on) this.audio.resume(); else this.audio?.suspend();
    this.setVolume(this.volume);
  }

  setVolume(volume) {
    this.volume = volume;
    if (this.gain) this.gain.gain.value = volume * volume;
  }

  #makeClick() {
    const length = Math.round(0.002 * this.audio.sampleRate);
    return Float32Array.from({ length }, (unused, i) => Math.sin(2 * Math.PI * 1800 * i / this.audio.sampleRate) * Math.exp(-6 * i / length));
  }

  /// Plays all clicks of a frame as one buffer, so that thousands of spikes cost as much as one.
  play(frame, chosen) {
    if (!this.on || !frame.spikes.t.length || frame.t - frame.from > kMax_s) return;
    const rate = this.audio.sampleRate, length = Math.ceil((frame.t - frame.from) * rate) + this.click.length;
    const buffer = this.audio.createBuffer(1, length, rate), samples = buffer.getChannelData(0);
    const wanted = this.all ? null : new Set(chosen);
    let played = 0;
    frame.spikes.t.forEach((t, i) => {
      if (wanted && !wanted.has(frame.spikes.n[i])) return;
      const at = Math.max(0, Math.floor((t - frame.from) * rate));
      for (let k = 0; k < this.click.length && at + k < length; ++k) samples[at + k] += this.click[k];
      ++played;
    });
    if (!played) return;
    this.clicks += played;
    // Normalised, because simultaneous clicks would clip.
    const loud = samples.reduce((most, value) => Math.max(most, Math.abs(value)), 1);
    if (loud > 1) for (let i = 0; i < length; ++i) samples[i] /= loud;
    const source = this.audio.createBufferSource();
    source.buffer = buffer;
    source.connect(this.gain);
    const now = this.audio.currentTime;
    if (!this.next || this.next < now || this.next > now + 3 * kAhead_s) this.next = now + kAhead_s;
    source.start(this.next);
    this.next += frame.t - frame.from;
  }
}
