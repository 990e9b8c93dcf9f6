// Below the first screen: latency, counters, scene and machine.
import { byId, context, follow, setText } from './canvas.js';
import { css } from './colours.js';
import { kStateNames } from './health.js';

const edge_us = (bin) => 10 ** (bin / 8);
const short = (v) => (v < 10 ? v.toFixed(1) : v.toFixed(0));
export const duration = (us) => (us < 1000 ? `${short(us)} µs` : `${short(us / 1000)} ms`);

/// The upper edge of the bin that contains a quantile, µs; NaN without ticks.
export function quantile_us(bins, q) {
  const all = bins.reduce((a, b) => a + b, 0);
  let sum = 0;
  return all ? edge_us(bins.findIndex((n) => (sum += n) >= q * all) + 1) : NaN;
}

export function fill(list, rows) {
  if (list.children.length !== 2 * rows.length) {
    list.replaceChildren(...rows.flatMap(() => [document.createElement('dt'), document.createElement('dd')]));
  }
  rows.forEach(([name, value, bad, meaning = ''], i) => {
    const dt = list.children[2 * i], dd = list.children[2 * i + 1];
    setText(dt, name);
    setText(dd, value);
    dd.classList.toggle('bad', Boolean(bad));
    if (dt.title !== meaning) dt.title = meaning;
  });
}

export function showCounters(frame, trend, scene) {
  const number = (v) => (Number.isInteger(v) ? v.toLocaleString('en').replaceAll(',', '\u2009') : v.toFixed(3));
  // A fault is coloured as soon as it happens; overruns, which occur on every host, only while they persist.
  const bad = ({ name, fault }) => (name === 'overruns' ? trend.lasts(name, 0.02) : fault && frame.counters[name] > 0);
  const rows = scene.counters.map((each) => {
    const value = frame.counters[each.name], ns = each.unit === 'ns';
    return [each.name.replaceAll('_', ' ').replace(/ ns$/, ', ms'), number(ns ? value * 1e-6 : value), bad(each), each.meaning];
  });
  rows.push(['frames missed by this page', number(frame.missed)]);
  rows.push(['probes', frame.probes.map((p, i) => `${scene.probes[i].name}: ${kStateNames[p.state]}`).join(', ')]);
  fill(byId('counters'), rows);
}

export class Latency {
  constructor(canvas) {
    this.canvas = canvas;
    this.bins = [];
    this.reading = follow(canvas, byId('latency-value'), { describe: (x) => this.#describe(x) });
  }
  #describe(x) {
    const bin = Math.min(this.bins.length - 1, Math.max(0, Math.floor(x / this.canvas.clientWidth * this.bins.length)));
    return bin < 0 ? '' : `${duration(edge_us(bin))} to ${duration(edge_us(bin + 1))}: ${this.bins[bin]} ticks`;
  }
  draw(bins) {
    this.bins = bins;
    const { c, width, height } = context(this.canvas);
    const most = Math.log10(Math.max(10, ...bins) + 1), h = height - 18, w = width / bins.length;
    c.fillStyle = css('--bar');
    bins.forEach((n, i) => { if (n > 0) { const tall = Math.max(2, Math.log10(n + 1) / most * (h - 4)); c.fillRect(i * w + 1, h - tall, w - 2, tall); } });
    c.fillStyle = css('--soft'); c.textBaseline = 'bottom'; c.textAlign = 'left';
    ['1 µs', '10 µs', '100 µs', '1 ms', '10 ms'].forEach((text, i) => c.fillText(text, i * 8 * w, height));
    if (this.reading.place()) { this.reading.update(); return; }
    const all = bins.some((n) => n > 0);
    byId('latency-value').textContent = all ? `median ${duration(quantile_us(bins, 0.5))}, 99th percentile ${duration(quantile_us(bins, 0.99))}` : '';
  }
}
