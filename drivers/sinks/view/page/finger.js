// The finger or hand, to scale: receptive fields coloured by rate, the contact, the chosen afferents.
import { byId, context, Layer, setText, sizeOf } from './canvas.js';
import { colourOfRate, css, cssOf, kPins, theme } from './colours.js';
import { ActiveFields, drawResting, traceField } from './fields.js';
import { afferentAt, layOut, placeOf } from './skin_layout.js';

const kReceptorsFrom = 14;   // pixels per mm
const kMaxZoom = 40;
const kLegend_px = 120;      // width of the legend, beside a hand
const kFound_px = 14;        // radius of the ring that marks a contact too small to see

/// The heights of a tip as a picture, a pixel each: the lower, the more opaque, with lines in two colours at half of its height.
function pictureOf({ columns, heights }) {
  const rows = heights.length / columns, highest = Math.max(...heights), ends = (h) => (h < 0 ? Infinity : h);
  const canvas = new OffscreenCanvas(columns, rows), c = canvas.getContext('2d');
  const raised = (i, j) => i >= 0 && j >= 0 && i < columns && j < rows && ends(heights[j * columns + i]) <= highest / 2;
  heights.forEach((height, at) => {
    const i = at % columns, j = Math.floor(at / columns), here = raised(i, j);
    const rim = [[i - 1, j], [i + 1, j], [i, j - 1], [i, j + 1]].some(([x, y]) => raised(x, y) !== here);
    c.fillStyle = css(rim && !here ? '--card' : '--press');
    c.globalAlpha = rim ? 1 : height < 0 ? 0 : 0.08 + 0.3 * (1 - height / Math.max(1, highest));
    c.fillRect(i, j, 1, 1);
  });
  return canvas;
}

export class Finger {
  constructor(canvas) {
    this.canvas = canvas;
    this.view = { zoom: 1, u: 0, v: 0 };    // centre of the view, relative to the centre of the bounds
    this.skin = new Layer();                // below the active fields
    this.names = new Layer();               // above them
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
    this.active = new ActiveFields(scene.neurons);
    this.skin.key = this.names.key = null;
    this.canvas.parentElement.dataset.kind = this.layout.kind;    // the legend of a hand is at the left
    this.resetZoom();
  }

  resetZoom() { this.view = { zoom: 1, u: 0, v: 0 }; this.changed(); }

  zoomBy(factor, x = sizeOf(this.canvas).width / 2, y = sizeOf(this.canvas).height / 2) {
    const before = this.at(x, y);
    this.view.zoom = Math.min(kMaxZoom, Math.max(1, this.view.zoom * factor));
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
    const half = (u1 - u0) * this.fit / 2;
    const middle = this.layout.kind === 'hand' ? Math.min(width - half, Math.max(width / 2, kLegend_px + half)) : width / 2;
    this.left = middle - ((u0 + u1) / 2 + this.view.u) * this.scale;
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
    const target = context(this.canvas), { c, width, height, ratio } = target;
    this.#measure(width, height);
    const view = `${this.left} ${this.top} ${this.scale}`;
    this.skin.show(target, view, (own) => this.#inSkin(own, () => {
      this.#drawOutlines(own);
      this.#inPatches(own, (placed) => drawResting(own, placed, this.scale));
    }));
    this.#inSkin(c, () => this.#inPatches(c, (placed) => this.active.draw(c, placed, { rates, most, scale: this.scale, ratio })));
    this.names.show(target, view, (own) => {
      if (this.scale >= kReceptorsFrom && this.view.zoom > 1) {
        this.#inSkin(own, () => this.#inPatches(own, (placed) => this.#drawReceptors(own, placed, () => true, css('--soft'), 1.2)));
      }
      this.#drawNames(own);
      this.#scaleBar(own, width, height);
    });
    this.#inSkin(c, () => {
      pins.forEach((afferent, i) => this.#drawPin(c, afferent, kPins[i % kPins.length]));
      probes.forEach((probe, i) => {
        if (probe.taxels.length) this.#drawTaxels(c, probe, this.scene.probes[i]);
        else if (probe.depth > 0) this.#drawContact(c, probe, this.scene.probes[i]);
      });
    });
    this.#label(c, probes, pins);
  }

  /// Draws in the coordinates of the layout, mm.
  #inSkin(c, draw) {
    c.save();
    c.translate(this.left, this.top);
    c.scale(this.scale, -this.scale);
    draw();
    c.restore();
  }

  /// Draws each patch in its own coordinates, mm.
  #inPatches(c, draw) {
    for (const placed of this.layout.placed) {
      c.save();
      c.transform(placed.cos, placed.sin, -placed.sin, placed.cos, placed.u0, placed.v0);
      draw(placed);
      c.restore();
    }
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
    traceField(c, placed, afferent - placed.first - 1);
    c.lineWidth = 5 / this.scale; c.strokeStyle = css('--card'); c.stroke();
    c.lineWidth = 3 / this.scale; c.strokeStyle = colour; c.stroke();
    c.restore();
  }

  #drawContact(c, probe, tip) {
    const placed = this.layout.placed[tip.patch], colour = css('--press');
    c.save();
    c.transform(placed.cos, placed.sin, -placed.sin, placed.cos, placed.u0, placed.v0);
    c.strokeStyle = c.fillStyle = colour;
    let reach = probe.radius;
    if (tip.shape) reach = this.#drawShape(c, placed, tip, probe.tip);
    else {
      c.lineWidth = 1.5 / this.scale; c.setLineDash([4 / this.scale, 4 / this.scale]);
      c.beginPath(); c.arc(probe.x, probe.y, reach = tip.radius_mm ?? reach, 0, 7); c.stroke(); c.setLineDash([]);
      c.beginPath(); c.arc(probe.x, probe.y, Math.max(2 / this.scale, probe.radius), 0, 7);
      c.globalAlpha = 0.15; c.fill(); c.globalAlpha = 1;
      c.lineWidth = 5 / this.scale; c.strokeStyle = css('--card'); c.stroke();
      c.lineWidth = 3 / this.scale; c.strokeStyle = colour; c.stroke();
    }
    if (reach * this.scale < kFound_px - 4) {
      c.lineWidth = 3 / this.scale;
      c.beginPath(); c.arc(probe.x, probe.y, kFound_px / this.scale, 0, 7); c.stroke();
    }
    c.restore();
  }

  /// A tip as it lies on the skin; a surface that repeats, over the whole patch. \return half of its size, mm
  #drawShape(c, { patch }, tip, { x, y }) {
    const { shape } = tip, { width_mm, length_mm, repeats_x, repeats_y } = shape;
    if (tip.theme !== theme()) { tip.theme = theme(); tip.picture = pictureOf(shape); }
    const starts = (at, size, repeats, whole) => {
      const first = at - size / 2 - (repeats ? Math.ceil((at - size / 2) / size) * size : 0);
      return repeats ? Array.from({ length: Math.ceil((whole - first) / size) }, (unused, i) => first + i * size) : [first];
    };
    c.save();
    if (repeats_x || repeats_y) { c.beginPath(); c.rect(0, 0, patch.length_mm, patch.width_mm); c.clip(); }
    for (const left of starts(x, width_mm, repeats_x, patch.length_mm)) {
      for (const top of starts(y, length_mm, repeats_y, patch.width_mm)) c.drawImage(tip.picture, left, top, width_mm, length_mm);
    }
    c.restore();
    return Math.max(width_mm, length_mm) / 2;
  }

  /// The pressures of a tactile array: its outline, and each taxel more opaque the higher its pressure.
  #drawTaxels(c, probe, { patch, taxels }) {
    const placed = this.layout.placed[patch];
    const most = Math.max(...probe.taxels);
    const trace = ([x, y]) => {
      c.beginPath();
      if (taxels.disc) c.arc(x, y, taxels.width_mm / 2, 0, 7);
      else c.rect(x - taxels.width_mm / 2, y - taxels.length_mm / 2, taxels.width_mm, taxels.length_mm);
    };
    c.save();
    c.transform(placed.cos, placed.sin, -placed.sin, placed.cos, placed.u0, placed.v0);
    c.translate(taxels.x_mm, taxels.y_mm);
    c.rotate(taxels.orientation_deg * Math.PI / 180);
    c.fillStyle = c.strokeStyle = css('--press');
    taxels.centres.forEach((centre, i) => {
      trace(centre);
      c.globalAlpha = 0.25; c.lineWidth = 0.5 / this.scale; c.stroke();
      if (probe.taxels[i] > 0) { c.globalAlpha = 0.85 * probe.taxels[i] / most; c.fill(); }
    });
    c.restore();
  }

  /// The name of each patch: of a finger beside its tip, of a palm in it. Kept with their boxes in `labels`.
  #drawNames(c) {
    this.labels = [];
    if (this.layout.placed.length < 2) return;
    c.textBaseline = 'middle'; c.fillStyle = css('--soft');
    c.font = `600 ${this.scale < 2 ? 12 : 14}px system-ui, sans-serif`;
    for (const { patch, index, to } of this.layout.placed) {
      const { length_mm, width_mm } = patch, name = patch.name || `patch ${index + 1}`, tip = this.layout.kind === 'hand' && name !== 'palm';
      const { u, v } = tip ? to(length_mm + 2, width_mm / 2) : to(length_mm / 2, name === 'palm' ? 8 : -4);
      const { x, y } = this.px(u, v), width = c.measureText(name).width;
      c.textAlign = tip ? 'left' : 'center';
      c.fillText(name, x, y);
      this.labels.push({ name, left: tip ? x : x - width / 2, right: tip ? x + width : x + width / 2, top: y - 7, bottom: y + 7 });
    }
  }

  #label(c, probes, pins) {
    c.textAlign = 'center'; c.textBaseline = 'middle';
    c.font = '600 12px system-ui, sans-serif';
    this.scene.probes.forEach((tip, i) => {
      if (!(probes[i]?.depth > 0) || this.scene.probes.filter((other) => other.patch === tip.patch).length < 2) return;
      const { u, v } = this.layout.placed[tip.patch].to(probes[i].x, probes[i].y);
      const { x, y } = this.px(u, v);
      c.fillStyle = css('--press');
      c.fillText(tip.name, x, y - this.scale * (tip.radius_mm ?? (tip.shape?.length_mm ?? 4) / 2) - 8);
    });
    pins.forEach((afferent) => {
      const placed = placeOf(this.layout, afferent);
      const [mx, my] = placed.centre(afferent - placed.first - 1);
      const { u, v } = placed.to(mx, my), { x, y } = this.px(u, v);
      c.lineWidth = 3; c.strokeStyle = css('--card'); c.fillStyle = css('--ink');
      c.strokeText(afferent, x, y); c.fillText(afferent, x, y);
    });
  }

  #scaleBar(c, width, height) {
    const mm = [1, 2, 5, 10, 20, 50].find((n) => n * this.scale >= 40) ?? 50;
    const [x, y] = this.layout.kind === 'hand' ? [width - 8 - mm * this.scale, 24] : [8, height - 8];
    c.font = '12px system-ui, sans-serif';
    c.fillStyle = c.strokeStyle = css('--soft'); c.lineWidth = 2;
    c.beginPath(); c.moveTo(x, y); c.lineTo(x + mm * this.scale, y); c.stroke();
    c.textAlign = 'left'; c.textBaseline = 'bottom';
    c.fillText(`${mm} mm`, x, y - 3);
  }
}

/// The legend of the rates' colours.
export function drawLegend(most) {
  setText(byId('legend-most'), `${most.toFixed(0)} /s`);
  const canvas = byId('legend'), look = `${theme()} ${sizeOf(canvas).width}`;
  if (canvas.dataset.look === look) return;
  canvas.dataset.look = look;
  const { c, width, height } = context(canvas);
  for (let x = 0; x < width; ++x) { c.fillStyle = cssOf(colourOfRate(x / width)); c.fillRect(x, 0, 1, height); }
}
