// The receptive fields of a patch, coloured by rate.
import { colourOfRate, css, cssOf, packed, theme } from './colours.js';

const kLevels = 64;          // steps of colour and opacity
const kLargestSprite = 24;   // radius in device pixels; larger fields are few on the screen, and drawn as circles
const kLowest = 0.2, kHighest = 0.9;    // opacity: a field with a low rate does not hide the fields that it overlaps

const opacity = (share) => kLowest + (kHighest - kLowest) * share;

/// Adds the outline of field n, from 0 in the patch, to the path.
export function traceField(c, placed, n) {
  const { patch } = placed;
  c.beginPath();
  if (placed.fields) { const [x, y] = patch.centres[n]; c.arc(x, y, patch.field_radius_mm, 0, 7); return; }
  const w = patch.length_mm / patch.columns, h = patch.width_mm / patch.rows;
  c.rect((n % patch.columns) * w, Math.floor(n / patch.columns) * h, w, h);
}

/// The fields at rest: dots at their centres, or the grid. \param scale  pixels per mm
export function drawResting(c, placed, scale) {
  const { patch, count } = placed;
  c.lineWidth = 1 / scale;
  c.strokeStyle = c.fillStyle = css('--field');
  if (placed.fields) {
    const radius = Math.max(0.12, 1.1 / scale);
    c.beginPath();
    for (const [x, y] of patch.centres) { c.moveTo(x + radius, y); c.arc(x, y, radius, 0, 7); }
    c.fill();
  } else if (patch.length_mm / patch.columns * scale > 6) {
    for (let n = 0; n < count; ++n) { traceField(c, placed, n); c.stroke(); }
  } else c.strokeRect(0, 0, patch.length_mm, patch.width_mm);
}

/// Discs of one radius in all levels, side by side.
class Sprites {
  constructor(radius_px, colours) {
    this.side = 2 * Math.ceil(radius_px) + 2;
    const canvas = new OffscreenCanvas(this.side * (kLevels + 1), this.side), c = canvas.getContext('2d');
    for (let level = 0; level <= kLevels; ++level) {
      c.fillStyle = cssOf(colours[level]);
      c.globalAlpha = opacity(level / kLevels);
      c.beginPath(); c.arc((level + 0.5) * this.side, this.side / 2, radius_px, 0, 7); c.fill();
    }
    this.image = canvas.transferToImageBitmap();
  }
}

/// A picture of a grid of square fields, a pixel each.
class Grid {
  constructor({ columns, rows }) {
    this.canvas = new OffscreenCanvas(columns, rows);
    this.context = this.canvas.getContext('2d');
    this.image = new ImageData(columns, rows);
    this.pixels = new Uint32Array(this.image.data.buffer);
  }
}

/// Draws the fields that respond, the highest rates on top.
export class ActiveFields {
  constructor(afferents) {
    this.levels = new Uint8Array(afferents);
    this.sorted = new Uint32Array(afferents);
    this.starts = new Uint32Array(kLevels + 2);
    this.sprites = new Map();    // by radius
    this.grids = new Map();      // by patch
  }

  /// \param scale  pixels per mm.  \param ratio  device pixels per pixel
  draw(c, placed, { rates, most, scale, ratio }) {
    if (this.theme !== theme()) this.#makeColours();
    const active = this.#sort(rates, most, placed), radius_px = placed.patch.field_radius_mm * scale * ratio;
    if (!placed.fields) this.#drawGrid(c, placed, active);
    else if (radius_px <= kLargestSprite) this.#drawSprites(c, placed, active, radius_px);
    else this.#drawCircles(c, placed, active);
  }

  #makeColours() {
    this.theme = theme();
    this.colours = Array.from({ length: kLevels + 1 }, (unused, level) => colourOfRate(level / kLevels));
    this.shades = Uint32Array.from(this.colours, packed);
    this.sprites.clear();
  }

  /// The responding afferents of a patch, in order of their levels.
  #sort(rates, most, { first, count }) {
    const { levels, sorted, starts } = this;
    starts.fill(0);
    for (let n = 0; n < count; ++n) {
      const rate = rates[first + n];
      if (rate > 0) ++starts[(levels[n] = Math.round(rate / most * kLevels)) + 1];
    }
    for (let level = 1; level < starts.length; ++level) starts[level] += starts[level - 1];
    const all = starts[kLevels + 1];
    for (let n = 0; n < count; ++n) if (rates[first + n] > 0) sorted[starts[levels[n]]++] = n;
    return sorted.subarray(0, all);
  }

  #drawGrid(c, { patch }, active) {
    if (active.length === 0) return;
    if (!this.grids.has(patch)) this.grids.set(patch, new Grid(patch));
    const { canvas, context, image, pixels } = this.grids.get(patch);
    pixels.fill(0);
    for (const n of active) pixels[n] = this.shades[this.levels[n]];
    context.putImageData(image, 0, 0);
    c.imageSmoothingEnabled = false;
    c.drawImage(canvas, 0, 0, patch.length_mm, patch.width_mm);
  }

  #drawSprites(c, placed, active, radius_px) {
    if (this.sprites.size > 8) this.sprites.clear();
    if (!this.sprites.has(radius_px)) this.sprites.set(radius_px, new Sprites(radius_px, this.colours));
    const { image, side } = this.sprites.get(radius_px), { a, b, c: across, d, e, f } = c.getTransform();
    c.save();
    c.setTransform(1, 0, 0, 1, 0, 0);
    for (const n of active) {
      const [x, y] = placed.patch.centres[n];
      c.drawImage(image, this.levels[n] * side, 0, side, side,
        Math.round(a * x + across * y + e - side / 2), Math.round(b * x + d * y + f - side / 2), side, side);
    }
    c.restore();
  }

  #drawCircles(c, placed, active) {
    for (const n of active) {
      c.fillStyle = cssOf(this.colours[this.levels[n]]);
      c.globalAlpha = opacity(this.levels[n] / kLevels);
      traceField(c, placed, n);
      c.fill();
    }
    c.globalAlpha = 1;
  }
}
