// Spike rates over the last half second.

const kWindow_s = 0.5, kMin_s = 0.04;
const kScaleEnds = [50, 75, 100, 150, 200, 300, 400, 600, 800];    // Hz: few, so that colours keep their meaning

export class Rates {
  constructor(afferents) {
    this.counts = new Uint32Array(afferents);
    this.hz = new Float32Array(afferents);    // index 0 is afferent 1
    this.most = kScaleEnds[0];                // end of the colour scale
    this.total = this.active = 0;
  }

  update(history, now) {
    const { counts, hz } = this, seconds = Math.min(kWindow_s, Math.max(now, kMin_s));
    history.counts(now - kWindow_s, now, counts);
    let most = 0, total = 0, active = 0;
    for (let i = 0; i < counts.length; ++i) {
      const count = counts[i];
      hz[i] = count / seconds;
      total += count;
      if (count > 0) ++active;
      if (count > most) most = count;
    }
    this.most = kScaleEnds.find((end) => end >= most / seconds) ?? most / seconds;
    this.total = total / seconds;
    this.active = active;
  }
}
