// Chosen afferents side by side: spikes, rate, drive and potential in the window, intervals, receptive field.
import { context } from './canvas.js';
import { css, kPins } from './colours.js';
import { placeOf } from './skin_layout.js';

export const kMaxPins = 4;
const kIntervalBins = 24, kMax_ms = 240, kCaption = 13;

export class Details {
  /// \param changed  called with the chosen afferents after each change
  constructor(place, changed) {
    this.place = place;
    this.changed = changed;
    this.chosen = [];            // {afferent, pinned}
    this.cards = [];
  }

  setScene(scene, layout) {
    this.scene = scene;
    this.layout = layout;
    this.chosen = this.chosen.filter(({ afferent }) => afferent <= scene.neurons);
    this.#rebuild();
  }

  get afferents() { return this.chosen.map(({ afferent }) => afferent); }

  /// Shows an afferent in place of the last unpinned one; removes it if it is already shown.
  choose(afferent) {
    const at = this.chosen.findIndex((each) => each.afferent === afferent);
    if (at >= 0) { if (!this.chosen[at].pinned) this.chosen.splice(at, 1); } else {
      this.chosen = this.chosen.filter((each) => each.pinned);
      if (this.chosen.length === kMaxPins) this.chosen.pop();
      this.chosen.push({ afferent, pinned: false });
    }
    this.#rebuild();
  }

  #rebuild() {
    this.place.replaceChildren();
    this.cards = this.chosen.map((each, i) => this.#card(each, i));
    if (!this.chosen.length) {
      const hint = document.createElement('p');
      hint.className = 'hint';
      hint.textContent = 'Click an afferent on the skin or in the raster to see its spikes, intervals and potential.';
      this.place.append(hint);
    }
    this.changed(this.afferents);
  }

  #card(each, i) {
    const card = document.createElement('article');
    card.className = 'card';
    card.style.setProperty('--pin', kPins[i % kPins.length]);
    const head = document.createElement('header');
    const title = document.createElement('h3');
    title.textContent = `Afferent ${each.afferent}`;
    const rate = document.createElement('span');
    const button = (text, label, pressed, act) => {
      const b = document.createElement('button');
      b.textContent = text;
      b.setAttribute('aria-label', `${label} afferent ${each.afferent}`);
      b.title = label;
      if (pressed !== null) b.setAttribute('aria-pressed', pressed);
      b.addEventListener('click', act);
      return b;
    };
    const pin = button('Pin', 'Pin', each.pinned, () => { each.pinned = !each.pinned; this.#rebuild(); });
    const close = button('×', 'Close', null, () => { this.chosen.splice(this.chosen.indexOf(each), 1); this.#rebuild(); });
    head.append(title, rate, pin, close);
    const canvas = document.createElement('canvas');
    canvas.setAttribute('role', 'img');
    const field = document.createElement('p');
    field.textContent = field.title = this.#field(each.afferent);
    card.append(head, canvas, field);
    this.place.append(card);
    return { ...each, canvas, rate, colour: kPins[i % kPins.length] };
  }

  #field(afferent) {
    const placed = placeOf(this.layout, afferent);
    if (!placed) return '';
    const { patch } = placed, n = afferent - placed.first - 1, [x, y] = placed.centre(n);
    const where = patch.name ? `${patch.name}, ` : '';
    const size = placed.fields ? `radius ${patch.field_radius_mm} mm`
      : `${+(patch.length_mm / patch.columns).toFixed(2)} × ${+(patch.width_mm / patch.rows).toFixed(2)} mm`;
    const receptors = placed.patch.receptors.filter(([, , of]) => of === n + 1).length;
    const counted = patch.thinned ? '' : `, ${receptors} receptors`;
    return `Field ${where}(${x.toFixed(1)}, ${y.toFixed(1)}) mm, ${size}${counted}`;
  }

  draw(history, time) {
    for (const card of this.cards) {
      const spikes = history.spikesOf(card.afferent, time.from, time.to);
      const recent = spikes.filter((t) => t > time.now - 0.5).length / 0.5;
      card.rate.textContent = `${recent.toFixed(0)} /s`;
      card.canvas.setAttribute('aria-label', `${spikes.length} spikes in the window, ${recent.toFixed(0)} per second now`);
      this.#draw(card, spikes, history.watched.get(card.afferent), time);
    }
  }

  #draw(card, spikes, watched, time) {
    const { c, width, height } = context(card.canvas);
    const split = Math.round(width * 0.66), w = split - 8, top = Math.round(height * 0.34), ticks = 10;
    this.#rate(c, spikes, time, card.colour, { x: 0, y: 0, w, h: top });
    c.fillStyle = css('--ink');
    for (const t of spikes) c.fillRect((t - time.from) / time.seconds * w, top + 3, 1.2, ticks);
    this.#drive(c, watched, time, { x: 0, y: top + ticks + 6, w, h: height - top - ticks - 7 });
    this.#intervals(c, spikes, card.colour, { x: split, y: 0, w: width - split, h: height });
  }

  #caption(c, text, x, y, align = 'left', colour = css('--soft')) {
    c.font = '11px system-ui, sans-serif';
    c.textAlign = align; c.textBaseline = 'top'; c.fillStyle = colour;
    c.fillText(text, x, y);
  }

  #rate(c, spikes, time, colour, { x, y, w, h }) {
    const bins = 40, span = time.seconds / bins, counts = new Array(bins).fill(0);
    for (const t of spikes) ++counts[Math.min(bins - 1, Math.floor((t - time.from) / span))];
    const most = Math.max(10, ...counts.map((n) => n / span));
    c.fillStyle = colour;
    counts.forEach((n, i) => { const tall = n / span / most * (h - kCaption); c.fillRect(x + i / bins * w, y + h - tall, w / bins + 0.5, tall); });
    c.strokeStyle = css('--line'); c.strokeRect(x + 0.5, y + 0.5, w, h);
    this.#caption(c, `rate, up to ${most.toFixed(0)} /s`, x + 3, y + 1);
  }

  #drive(c, watched, time, { x, y, w, h }) {
    c.strokeStyle = css('--line'); c.strokeRect(x + 0.5, y + 0.5, w, h - 1);
    if (!watched?.length) { this.#caption(c, 'drive, potential: waiting for data', x + 3, y + 1); return; }
    const first = watched.firstAfter(time.from), last = watched.firstAfter(time.to);
    const hasPotential = first < last && Number.isFinite(watched.potential[last - 1]);
    const curve = (column, colour) => {
      let low = Infinity, high = -Infinity;
      for (let i = first; i < last; ++i) { low = Math.min(low, column[i]); high = Math.max(high, column[i]); }
      if (!(high > low)) high = low + 1;
      c.strokeStyle = colour; c.lineWidth = 1.2; c.beginPath();
      const stride = Math.max(1, Math.floor((last - first) / (3 * w)));
      for (let i = first; i < last; i += stride) {
        c.lineTo(x + (watched.t[i] - time.from) / time.seconds * w, y + h - 2 - (column[i] - low) / (high - low) * (h - 2 * kCaption - 2));
      }
      c.stroke();
      c.lineWidth = 1;
      return [low, high];
    };
    const [low, high] = curve(watched.drive, css('--force'));
    this.#caption(c, `drive ${low.toPrecision(2)} to ${high.toPrecision(2)} ${this.scene.drive_unit}`, x + 3, y + 1, 'left', css('--force'));
    if (!hasPotential) return;
    const [rest, peak] = curve(watched.potential, css('--depth'));
    this.#caption(c, `${this.scene.potential_name} ${rest.toFixed(this.scene.potential_unit ? 0 : 2)} to ${peak.toFixed(this.scene.potential_unit ? 0 : 2)} ${this.scene.potential_unit}`, x + 3, y + 1 + kCaption, 'left', css('--depth'));
  }

  #intervals(c, spikes, colour, { x, y, w, h }) {
    const bins = new Array(kIntervalBins).fill(0), all = [];
    for (let i = 1; i < spikes.length; ++i) {
      const ms = (spikes[i] - spikes[i - 1]) * 1e3;
      all.push(ms);
      if (ms < kMax_ms) ++bins[Math.floor(ms / kMax_ms * kIntervalBins)];
    }
    const most = Math.max(1, ...bins), foot = 13;
    c.fillStyle = colour;
    bins.forEach((n, i) => { const tall = n / most * (h - foot - 14); c.fillRect(x + i / kIntervalBins * w + 0.5, y + h - foot - tall, w / kIntervalBins - 1, tall); });
    c.strokeStyle = css('--line'); c.beginPath(); c.moveTo(x, y + h - foot + 0.5); c.lineTo(x + w, y + h - foot + 0.5); c.stroke();
    all.sort((a, b) => a - b);
    this.#caption(c, all.length ? `median ${all[all.length >> 1].toFixed(0)} ms` : 'intervals', x, y + 2);
    this.#caption(c, '0', x, y + h - foot + 2);
    this.#caption(c, `${kMax_ms} ms`, x + w, y + h - foot + 2, 'right');
  }
}
