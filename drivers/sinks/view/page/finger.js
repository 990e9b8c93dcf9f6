// The finger or hand, to scale: receptive fields coloured by rate, the contact, the chosen afferents.
import { byId, context, setText, sizeOf } from './canvas.js';
import { colourOf, css, kPins, theme } from './colours.js';
import { afferentAt, layOut, placeOf } from './skin_layout.js';

const kReceptorsFrom = 14;   // pixels per mm
const kMostZoom = 40;
const kFound_px = 14;        // radius of the ring that marks a contact too small to see

export class Finger {
  constructor(canvas) {
    this.canvas = canvas;
    this.view = { zoom: 1, u: 0, v: 0 };    // centre of the view, relative to the centre of the bounds
    canvas.addEventListener('wheel', (event) => {
      if (!this.layout) return;
      this.zoomBy(event.deltaY < 0 ? 1.25 : 0.8, event.offsetX, event.offsetY);
      event.preventDefault();
    }, { passive: false });
    let dragged = null;
    canvas.addEventListener('pointerdown', (event) => { dragged = this.view.zoom > 1 ? { x: event.offsetX, y: event.offsetY } : null; });
    canvas.addEventListener('pointermove', (event) => {
      if (!dragged || !event.buttons) return;
      this.view.u -= (event.offsetX - dragged.x) / this.scale;
      this.view.v += (event.offsetY - dragged.y) / this.scale;
      dragged = { x: event.offsetX, y: event.offsetY };
      this.changed();
    });
    canvas.addEventListener('dblclick', () => this.resetZoom());
    this.changed = () => {};
  }

  setScene(scene) {
    this.scene = scene;
    this.layout = layOut(scene.patches);
    this.resetZoom();
  }

  resetZoom() { this.view = { zoom: 1, u: 0, v: 0 }; this.changed(); }

  zoomBy(factor, x = sizeOf(this.canvas).width / 2, y = sizeOf(this.canvas).height / 2) {
    const before = this.at(x, y);
    this.view.zoom = Math.min(kMostZoom, Math.max(1, this.view.zoom * factor));
    if (this.view.zoom === 1) { this.resetZoom(); return; }
    const { width, height } = sizeOf(this.canvas);
    this.#measure(width, height);
    const after = this.at(x, y);
    this.view.u += before.u - after.u;
    this.view.v += before.v - after.v;
    this.changed();
  }

  #measure(width, height) {
    const { u0, u1, v0, v1 } = this.layout.bounds;
    this.fit = Math.min(width / (u1 - u0), height / (v1 - v0));
    this.scale = this.fit * this.view.zoom;
    this.left = width / 2 - ((u0 + u1) / 2 + this.view.u) * this.scale;
    this.top = height / 2 + ((v0 + v1) / 2 + this.view.v) * this.scale;
  }

  px(u, v) { return { x: this.left + u * this.scale, y: this.top - v * this.scale }; }
  at(x, y) { return { u: (x - this.left) / this.scale, v: (this.top - y) / this.scale }; }

  /// {placed, x, y, afferent} under a pixel, or null.
  hit(px, py) {
    if (!this.layout || !this.scale) return null;
    const { u, v } = this.at(px, py);
    for (const placed of [...this.layout.placed].reverse()) {
      const { x, y } = placed.from(u, v);
      const afferent = afferentAt(placed, x, y);
      if (afferent) return { placed, x, y, afferent };
    }
    return null;
  }

  /// \param rates  per afferent, Hz.  \param pins  chosen afferents, in order
  draw({ rates, most, probes, pins }) {
    const { c, width, height } = context(this.canvas);
    this.#measure(width, height);
    c.save();
    c.translate(this.left, this.top);
    c.scale(this.scale, -this.scale);
    this.#drawOutlines(c);
    for (const placed of this.layout.placed) {
      c.save();
      c.transform(placed.cos, placed.sin, -placed.sin, placed.cos, placed.u0, placed.v0);
      this.#drawFields(c, placed, rates, most);
      if (this.scale >= kReceptorsFrom && this.view.zoom > 1) this.#drawReceptors(c, placed, () => true, css('--soft'), 1.2);
      c.restore();
    }
    pins.forEach((afferent, i) => this.#drawPin(c, afferent, kPins[i % kPins.length]));
    probes.forEach((probe, i) => { if (probe.depth > 0) this.#drawContact(c, probe, this.scene.probes[i]); });
    c.restore();
    this.#label(c, probes, pins);
    this.#scaleBar(c, height);
  }

  #drawOutlines(c) {
    const each = (draw) => this.layout.outlines.forEach(({ path, u0, v0, angle }) => {
      c.save(); c.translate(u0, v0); c.rotate(angle); draw(path); c.restore();
    });
    c.lineWidth = 3 / this.scale; c.strokeStyle = css('--outline');
    each((path) => c.stroke(path));
    c.fillStyle = css('--skin');
    each((path) => c.fill(path));
  }

  #field(c, placed, n) {
    const { patch } = placed;
    c.beginPath();
    if (placed.fields) { const [x, y] = patch.centres[n]; c.arc(x, y, patch.field_radius_mm, 0, 7); return; }
    const w = patch.length_mm / patch.columns, h = patch.width_mm / patch.rows;
    c.rect((n % patch.columns) * w, Math.floor(n / patch.columns) * h, w, h);
  }

  #drawFields(c, placed, rates, most) {
    const { patch, first, count } = placed;
    const cell = placed.fields ? 2 * patch.field_radius_mm : patch.length_mm / patch.columns;
    c.lineWidth = 1 / this.scale;
    c.strokeStyle = css('--field');
    const active = [];
    for (let n = 0; n < count; ++n) if (rates[first + n] > 0) active.push(n);
    if (!placed.fields && cell * this.scale > 6) for (let n = 0; n < count; ++n) { this.#field(c, placed, n); c.stroke(); }
    else if (!placed.fields) c.strokeRect(0, 0, patch.length_mm, patch.width_mm);
    else {
      c.fillStyle = css('--field');
      c.fill(this.#dots(placed, Math.max(0.12, 1.1 / this.scale)));
    }
    active.sort((a, b) => rates[first + a] - rates[first + b]);
    for (const n of active) {
      c.fillStyle = colourOf(0.15 + 0.85 * rates[first + n] / most);
      // A field with a low rate is faint and does not hide the fields that it overlaps.
      c.globalAlpha = placed.fields ? 0.2 + 0.7 * rates[first + n] / most : 1;
      this.#field(c, placed, n);
      c.fill();
    }
    c.globalAlpha = 1;
  }

  /// A dot of a radius at the centre of each field, as one path; cached for the next picture.
  #dots(placed, radius) {
    if (placed.dots?.radius !== radius) {
      const path = new Path2D();
      for (const [x, y] of placed.patch.centres) { path.moveTo(x + radius, y); path.arc(x, y, radius, 0, 7); }
      placed.dots = { radius, path };
    }
    return placed.dots.path;
  }

  #drawReceptors(c, placed, shown, colour, radius_px) {
    c.fillStyle = colour;
    const r = radius_px / this.scale;
    for (const [x, y, n] of placed.patch.receptors) if (shown(n)) { c.beginPath(); c.arc(x, y, r, 0, 7); c.fill(); }
  }

  #drawPin(c, afferent, colour) {
    const placed = placeOf(this.layout, afferent);
    if (!placed) return;
    c.save();
    c.transform(placed.cos, placed.sin, -placed.sin, placed.cos, placed.u0, placed.v0);
    this.#drawReceptors(c, placed, (n) => n === afferent - placed.first, colour, 1.6);
    this.#field(c, placed, afferent - placed.first - 1);
    c.lineWidth = 5 / this.scale; c.strokeStyle = css('--card'); c.stroke();
    c.lineWidth = 3 / this.scale; c.strokeStyle = colour; c.stroke();
    c.restore();
  }

  #tip(c, tip, x, y) {
    c.beginPath();
    if (tip.tip === 'bars') {
      let left = x - (tip.bar_widths_mm.reduce((a, b) => a + b, 0) + tip.bar_gaps_mm.reduce((a, b) => a + b, 0)) / 2;
      tip.bar_widths_mm.forEach((w, i) => { c.rect(left, y - tip.bar_length_mm / 2, w, tip.bar_length_mm); left += w + (tip.bar_gaps_mm[i] ?? 0); });
    } else {
      const radius = tip.tip === 'pin' ? tip.diameter_mm / 2 : tip.radius_mm;
      if (radius) c.arc(x, y, radius, 0, 7);
    }
  }

  #drawContact(c, probe, tip) {
    const placed = this.layout.placed[tip.patch];
    c.save();
    c.transform(placed.cos, placed.sin, -placed.sin, placed.cos, placed.u0, placed.v0);
    c.strokeStyle = c.fillStyle = css('--press');
    if (tip.tip === 'sphere') {
      c.lineWidth = 1.5 / this.scale; c.setLineDash([4 / this.scale, 4 / this.scale]);
      this.#tip(c, tip, probe.x, probe.y); c.stroke(); c.setLineDash([]);
      c.beginPath(); c.arc(probe.x, probe.y, Math.max(2 / this.scale, probe.radius), 0, 7);
    } else this.#tip(c, tip, probe.x, probe.y);
    c.globalAlpha = 0.15; c.fill(); c.globalAlpha = 1;
    c.lineWidth = 5 / this.scale; c.strokeStyle = css('--card'); c.stroke();
    c.lineWidth = 3 / this.scale; c.strokeStyle = css('--press'); c.stroke();
    if ((tip.radius_mm ?? probe.radius) * this.scale < kFound_px - 4) {
      c.beginPath(); c.arc(probe.x, probe.y, kFound_px / this.scale, 0, 7); c.stroke();
    }
    c.restore();
  }

  #label(c, probes, pins) {
    c.textAlign = 'center'; c.textBaseline = 'middle'; c.fillStyle = css('--soft');
    c.font = '600 14px system-ui, sans-serif';
    if (this.layout.placed.length > 1) {
      for (const placed of this.layout.placed) {
        const { length_mm, width_mm } = placed.patch;
        const beyond = this.layout.kind === 'hand' && placed.patch.name !== 'palm';
        const { u, v } = beyond ? placed.to(length_mm + 14, width_mm / 2) : placed.to(length_mm / 2, placed.patch.name === 'palm' ? width_mm - 6 : -4);
        const { x, y } = this.px(u, v);
        c.fillText(placed.patch.name || `patch ${placed.index + 1}`, x, y);
      }
    }
    c.font = '600 12px system-ui, sans-serif';
    this.scene.probes.forEach((tip, i) => {
      if (!(probes[i]?.depth > 0) || this.scene.probes.filter((other) => other.patch === tip.patch).length < 2) return;
      const { u, v } = this.layout.placed[tip.patch].to(probes[i].x, probes[i].y);
      const { x, y } = this.px(u, v);
      c.fillStyle = css('--press');
      c.fillText(tip.name, x, y - this.scale * (tip.radius_mm ?? 2) - 8);
    });
    pins.forEach((afferent) => {
      const placed = placeOf(this.layout, afferent);
      const [mx, my] = placed.centre(afferent - placed.first - 1);
      const { u, v } = placed.to(mx, my), { x, y } = this.px(u, v);
      c.lineWidth = 3; c.strokeStyle = css('--card'); c.fillStyle = css('--ink');
      c.strokeText(afferent, x, y); c.fillText(afferent, x, y);
    });
  }

  #scaleBar(c, height) {
    const mm = [1, 2, 5, 10, 20, 50].find((n) => n * this.scale >= 40) ?? 50;
    c.font = '12px system-ui, sans-serif';
    c.fillStyle = c.strokeStyle = css('--soft'); c.lineWidth = 2;
    c.beginPath(); c.moveTo(8, height - 8); c.lineTo(8 + mm * this.scale, height - 8); c.stroke();
    c.textAlign = 'left'; c.textBaseline = 'bottom';
    c.fillText(`${mm} mm`, 8, height - 11);
  }
}

/// The legend of the rates' colours.
export function drawLegend(most) {
  setText(byId('legend-most'), `${most.toFixed(0)} /s`);
  const canvas = byId('legend'), look = `${theme()} ${sizeOf(canvas).width}`;
  if (canvas.dataset.look === look) return;
  canvas.dataset.look = look;
  const { c, width, height } = context(canvas);
  for (let x = 0; x < width; ++x) { c.fillStyle = colourOf(0.15 + 0.85 * x / width); c.fillRect(x, 0, 1, height); }
}
