'use strict';
// The live page: takes frames from the program (view_frames.hpp says what is in them) and draws.

const byId = (id) => document.getElementById(id);
const kKept_s = 61;        // of history
const kRateWindow_s = 0.5;
const kSteps = [2, 5, 10, 30, 60];
const kStates = ['following', 'held', 'released', 'ended'];

let scene = null;
let last = null;           // the newest frame
let missed = 0;            // frames that this page was too slow for
let points = [];           // {t, values: depth and force of each probe}
let spikes = [];           // {t, n}, in order
let paused = false;
let pausedAt = 0;
let pausedProbes = [];
let dirty = true;
let ended = false;
let trace = null;
let latencyReading = null;
const readings = [];       // of values under the pointer or the keyboard's place

// ---- frames --------------------------------------------------------------------------------

class Reader {
  constructor(buffer) { this.view = new DataView(buffer); this.at = 0; }
  u32() { const v = this.view.getUint32(this.at, true); this.at += 4; return v; }
  f32() { const v = this.view.getFloat32(this.at, true); this.at += 4; return v; }
  f64() { const v = this.view.getFloat64(this.at, true); this.at += 8; return v; }
  list(one) { const n = this.u32(); const all = []; for (let i = 0; i < n; ++i) all.push(one()); return all; }
}

function readFrame(buffer) {
  const r = new Reader(buffer);
  missed = r.u32();
  const frame = { number: r.u32(), flags: r.u32(), t: r.f64() };
  const counters = r.list(() => r.f64());
  frame.counters = Object.fromEntries(scene.counters.map((name, i) => [name, counters[i]]));
  frame.probes = r.list(() => ({ depth: r.f32(), force: r.f32(), x: r.f32(), y: r.f32(), radius: r.f32(), state: r.u32() }));
  frame.points = r.list(() => ({ t: frame.t - r.f32(), values: frame.probes.flatMap(() => [r.f32(), r.f32()]) }));
  frame.spikes = r.list(() => ({ t: frame.t - r.f32(), n: r.u32() }));
  frame.latency = r.list(() => r.u32());
  return frame;
}

function takeFrame(frame) {
  last = frame;
  ended = (frame.flags & 1) !== 0;
  points.push(...frame.points);
  spikes.push(...frame.spikes);
  // While the picture stands still, so does what it shows.
  const old = (paused ? pausedAt : frame.t) - kKept_s;
  points.splice(0, firstAfter(points, old));
  spikes.splice(0, firstAfter(spikes, old));
  if (paused && frame.t > pausedAt + kKept_s) togglePause();
  if (ended) connection('ended', 'run over');
  dirty = true;
}

/// Index of the first of some items, ordered by t, that is not before a time.
function firstAfter(items, t) {
  let low = 0, high = items.length;
  while (low < high) {
    const middle = (low + high) >> 1;
    if (items[middle].t < t) low = middle + 1; else high = middle;
  }
  return low;
}

// ---- connection ----------------------------------------------------------------------------

let backoff_ms = 500;

function connection(state, text) {
  byId('connection').dataset.state = state;
  byId('connection').textContent = text;
}

function connect() {
  const socket = new WebSocket(`ws://${location.host}/socket`);
  socket.binaryType = 'arraybuffer';
  socket.onmessage = (message) => {
    if (typeof message.data === 'string') {
      scene = JSON.parse(message.data);
      points = []; spikes = []; last = null; ended = false; paused = false;
      showPause();
      showScene();
      connection('live', 'live');
      backoff_ms = 500;
    } else if (scene) {
      takeFrame(readFrame(message.data));
    }
  };
  socket.onclose = () => {
    if (!ended) connection('lost', 'connection lost, trying again…');
    setTimeout(connect, backoff_ms);
    backoff_ms = Math.min(backoff_ms * 1.5, 4000);
  };
}

// ---- what does not change during a run ------------------------------------------------------

function fill(list, rows) {
  list.replaceChildren(...rows.flatMap(([name, value]) => {
    const dt = document.createElement('dt');
    const dd = document.createElement('dd');
    dt.textContent = name; dd.textContent = value;
    return [dt, dd];
  }));
}

function showScene() {
  byId('scene').textContent = scene.scene;
  document.title = `merkel: ${scene.scene}`;
  fill(byId('facts'), scene.facts);
  makeTrace();
}

const css = (name) => getComputedStyle(document.documentElement).getPropertyValue(name).trim();

function makeTrace() {
  if (trace) trace.destroy();
  const dashes = [[], [6, 4], [2, 3]];
  const series = [{ label: 's', value: (u, v) => (v == null ? '–' : v.toFixed(3)) }];
  scene.probes.forEach((probe, i) => {
    const which = scene.probes.length > 1 ? ` ${i + 1}` : '';
    const value = (u, v) => (v == null ? '–' : v.toFixed(3));
    series.push({ label: `depth${which} (mm)`, scale: 'mm', stroke: () => css('--depth'), width: 1.5, dash: dashes[i % 3], value });
    series.push({ label: `force${which} (N)`, scale: 'N', stroke: () => css('--force'), width: 1.5, dash: dashes[i % 3], value });
  });
  const axis = (more) => ({ stroke: () => css('--soft'), grid: { stroke: () => css('--line'), width: 1 }, ticks: { stroke: () => css('--line') }, ...more });
  // Two ranges, so that two curves of the same shape do not lie on each other.
  const upward = (room) => (u, low, high) => [Math.min(0, low ?? 0), Math.max(high ?? 0, 0.1) * room];
  trace = new uPlot({
    width: byId('trace').clientWidth, height: 230, series,
    scales: { x: { time: false }, mm: { range: upward(1.08) }, N: { range: upward(1.4) } },
    axes: [axis({}), axis({ scale: 'mm', label: 'depth, mm', labelSize: 22, size: 44 }),
      axis({ scale: 'N', label: 'force, N', side: 1, labelSize: 22, size: 48, grid: { show: false } })],
    cursor: { drag: { x: false, y: false } },
  }, [[]].concat(scene.probes.flatMap(() => [[], []])), byId('trace'));
}

// ---- drawing --------------------------------------------------------------------------------

function span() {
  const seconds = Number(byId('window').value);
  const end = Math.max(seconds, paused ? pausedAt : (last ? last.t : 0));
  return { from: end - seconds, to: end, now: paused ? pausedAt : (last ? last.t : 0), seconds };
}

/// A canvas made as sharp as the screen, cleared.
function context(canvas) {
  const scale = window.devicePixelRatio || 1;
  const width = canvas.clientWidth, height = canvas.clientHeight;
  if (canvas.width !== Math.round(width * scale) || canvas.height !== Math.round(height * scale)) {
    canvas.width = Math.round(width * scale); canvas.height = Math.round(height * scale);
  }
  const c = canvas.getContext('2d');
  c.setTransform(scale, 0, 0, scale, 0, 0);
  c.clearRect(0, 0, width, height);
  c.font = '12px system-ui, sans-serif';
  return { c, width, height };
}

function visible(items, { from, to }) { return items.slice(firstAfter(items, from), firstAfter(items, to + 1e-9)); }

function rates({ now }) {
  const all = new Array(scene.neurons).fill(0);
  for (const spike of visible(spikes, { from: now - kRateWindow_s, to: now })) if (spike.n <= scene.neurons) ++all[spike.n - 1];
  return all.map((n) => n / kRateWindow_s);
}

function drawTrace(time) {
  const shown = visible(points, time);
  const data = [shown.map((p) => p.t)];
  for (let i = 0; i < 2 * scene.probes.length; ++i) data.push(shown.map((p) => p.values[i] * (i % 2 ? 1e-3 : 1)));
  trace.batch(() => { trace.setData(data, false); trace.setScale('x', { min: time.from, max: time.to }); });
}

/// The newest reading of each probe; while paused, that of the moment shown.
function showPress() {
  byId('trace-value').textContent = (paused ? pausedProbes : last.probes).map((p) =>
    `${p.depth.toFixed(3)} mm, ${(p.force * 1e-3).toFixed(3)} N at (${p.x.toFixed(1)}, ${p.y.toFixed(1)}) mm`).join('; ');
}

/// Margins of the raster: its time axis lies under that of the trace.
function rasterFrame(width, height) {
  const { left, width: plot } = trace.bbox;
  const scale = window.devicePixelRatio || 1;
  return { left: left / scale, w: Math.min(plot, (width * scale) - left) / scale, h: height - 18 };
}

function drawRaster(time) {
  const { c, width, height } = context(byId('raster'));
  const { left, w, h } = rasterFrame(width, height);
  const row = h / scene.neurons;
  c.fillStyle = css('--soft'); c.strokeStyle = css('--line');
  c.textAlign = 'right'; c.textBaseline = 'middle';
  const every = Math.max(1, Math.ceil(scene.neurons / Math.max(2, Math.floor(h / 18))));
  for (let n = 1; n <= scene.neurons; n += every) {
    const y = h - (n - 0.5) * row;
    c.fillText(n, left - 6, y);
    c.beginPath(); c.moveTo(left, y); c.lineTo(left + w, y); c.stroke();
  }
  c.textAlign = 'center'; c.textBaseline = 'bottom';
  const step = time.seconds / 5;
  for (let t = Math.ceil(time.from / step) * step; t <= time.to; t += step) {
    c.fillText(`${+t.toFixed(2)} s`, left + (t - time.from) / time.seconds * w, height);
  }
  c.fillStyle = css('--spike');
  const tall = Math.max(2, row * 0.7);
  for (const spike of visible(spikes, time)) {
    c.fillRect(left + (spike.t - time.from) / time.seconds * w - 0.75, h - (spike.n - 0.5) * row - tall / 2, 1.5, tall);
  }
}

/// Where each patch of skin is in its picture: side by side, all to the same scale.
function skinFrames(width, height) {
  const gap = 16, patches = scene.patches;
  const length = patches.reduce((sum, p) => sum + p.length_mm, 0);
  const scale = Math.min((width - gap * (patches.length + 1)) / length, (height - 34) / Math.max(...patches.map((p) => p.width_mm)));
  let left = (width - scale * length - gap * (patches.length - 1)) / 2, first = 0;
  return patches.map((patch) => {
    const at = left, from = first;
    left += patch.length_mm * scale + gap;
    first += patch.field_radius_mm > 0 ? patch.centres.length : patch.columns * patch.rows;
    return { patch, scale, first: from, count: first - from, x: (mm) => at + mm * scale, y: (mm) => 6 + (patch.width_mm - mm) * scale };
  });
}

/// The afferent at a place of a patch, from 0 in the patch; -1 for none.
function afferentAt({ patch, count }, x, y) {
  if (x < 0 || y < 0 || x >= patch.length_mm || y >= patch.width_mm) return -1;
  if (!(patch.field_radius_mm > 0)) return Math.floor(y / patch.width_mm * patch.rows) * patch.columns + Math.floor(x / patch.length_mm * patch.columns);
  let nearest = -1, least = patch.field_radius_mm;
  for (let n = 0; n < count; ++n) {
    const away = Math.hypot(patch.centres[n][0] - x, patch.centres[n][1] - y);
    if (away < least) { least = away; nearest = n; }
  }
  return nearest;
}

function drawPatch(c, f, rate, most) {
  const { patch } = f;
  const colour = (r) => `rgba(${css('--map')}, ${0.75 * r / most})`;
  c.strokeStyle = css('--line');
  c.textAlign = 'left'; c.textBaseline = 'top';
  if (patch.field_radius_mm > 0) {
    c.strokeRect(f.x(0), f.y(patch.width_mm), patch.length_mm * f.scale, patch.width_mm * f.scale);
    for (let n = 0; n < f.count; ++n) {
      if (!rate[f.first + n]) continue;
      c.fillStyle = colour(rate[f.first + n]);
      c.beginPath(); c.arc(f.x(patch.centres[n][0]), f.y(patch.centres[n][1]), patch.field_radius_mm * f.scale, 0, 7); c.fill();
    }
  } else {
    const w = patch.length_mm / patch.columns, h = patch.width_mm / patch.rows;
    for (let n = 0; n < f.count; ++n) {
      const x = f.x((n % patch.columns) * w), y = f.y((Math.floor(n / patch.columns) + 1) * h);
      c.fillStyle = colour(rate[f.first + n]);
      c.fillRect(x, y, w * f.scale, h * f.scale);
      c.strokeRect(x, y, w * f.scale, h * f.scale);
      c.fillStyle = css('--soft');
      if (w * f.scale > 24) c.fillText(f.first + n + 1, x + 3, y + 3);
    }
  }
  c.fillStyle = css('--soft');
  for (const [x, y] of patch.receptors) { c.beginPath(); c.arc(f.x(x), f.y(y), 1.2, 0, 7); c.fill(); }
  const where = scene.patches.length > 1 && patch.name ? `${patch.name}, ` : '';
  c.textAlign = 'right';
  c.fillText(`${where}${patch.length_mm} mm from the fingertip`, f.x(patch.length_mm), f.y(0) + 5);
  c.textAlign = 'left';
  if (!where) c.fillText('0', f.x(0), f.y(0) + 5);
}

function drawSkin(time) {
  const { c, width, height } = context(byId('skin'));
  const frames = skinFrames(width, height);
  const rate = rates(time);
  const most = rate.reduce((a, b) => Math.max(a, b), 50);
  byId('skin-scale').textContent = `0 to ${most.toFixed(0)}`;
  for (const frame of frames) drawPatch(c, frame, rate, most);
  c.strokeStyle = c.fillStyle = css('--press');
  c.lineWidth = 2;
  (paused ? pausedProbes : last.probes).forEach((probe, i) => {
    if (!(probe.depth > 0)) return;
    const tip = scene.probes[i], f = frames[tip.patch];
    const x = f.x(probe.x), y = f.y(probe.y);
    c.beginPath(); c.arc(x, y, Math.max(2, probe.radius * f.scale), 0, 7); c.stroke();
    c.globalAlpha = 0.18; c.fill(); c.globalAlpha = 1;
    c.setLineDash([3, 3]); c.beginPath();
    if (tip.tip === 'sphere' && tip.radius_mm) c.arc(x, y, tip.radius_mm * f.scale, 0, 7);
    else { c.moveTo(x - 8, y); c.lineTo(x + 8, y); c.moveTo(x, y - 8); c.lineTo(x, y + 8); }
    c.stroke(); c.setLineDash([]);
  });
  c.lineWidth = 1;
}

function drawRates(time) {
  const { c, width, height } = context(byId('rates'));
  const rate = rates(time);
  const most = rate.reduce((a, b) => Math.max(a, b), 50), h = height - 18, w = (width - 34) / rate.length;
  c.fillStyle = css('--bar');
  rate.forEach((r, i) => c.fillRect(34 + i * w + w * 0.1, h - r / most * (h - 14), w * 0.8, r / most * (h - 14)));
  c.fillStyle = css('--soft'); c.strokeStyle = css('--line');
  c.textAlign = 'right'; c.textBaseline = 'middle';
  c.fillText(`${most.toFixed(0)}`, 30, 14); c.fillText('0', 30, h);
  c.fillText('1/s', 30, 30);
  c.beginPath(); c.moveTo(34, h + 0.5); c.lineTo(width, h + 0.5); c.moveTo(34, 14.5); c.lineTo(width, 14.5); c.stroke();
  c.textAlign = 'center'; c.textBaseline = 'bottom';
  const every = Math.max(1, Math.ceil(rate.length / Math.max(2, width / 34)));
  for (let i = 0; i < rate.length; i += every) c.fillText(i + 1, 34 + (i + 0.5) * w, height);
}

const latencyEdge_us = (bin) => 10 ** (bin / 8);

function drawLatency() {
  const { c, width, height } = context(byId('latency'));
  const bins = last.latency;
  const most = Math.log10(Math.max(10, ...bins) + 1), h = height - 18, w = width / bins.length;
  c.fillStyle = css('--bar');
  bins.forEach((n, i) => { if (n > 0) { const y = Math.max(2, Math.log10(n + 1) / most * (h - 4)); c.fillRect(i * w + 1, h - y, w - 2, y); } });
  c.fillStyle = css('--soft'); c.textBaseline = 'bottom'; c.textAlign = 'left';
  ['1 µs', '10 µs', '100 µs', '1 ms', '10 ms'].forEach((text, i) => c.fillText(text, i * 8 * w, height));
  const all = bins.reduce((a, b) => a + b, 0);
  const quantile = (q) => { let sum = 0; const i = bins.findIndex((n) => (sum += n) >= q * all); return latencyEdge_us(i + 1); };
  const short = (v) => (v < 10 ? v.toFixed(1) : v.toFixed(0));
  const text = (us) => (us < 1000 ? `${short(us)} µs` : `${short(us / 1000)} ms`);
  if (latencyReading.active()) return;
  byId('latency-value').textContent = all ? `half below ${text(quantile(0.5))}, 99 % below ${text(quantile(0.99))}` : '';
}

const kCounterNames = {
  ticks: 'ticks', overruns: 'overruns', longest_overrun_ms: 'longest overrun, ms', catch_up_ticks: 'ticks caught up',
  gaps: 'gaps', skipped_ticks: 'ticks left out', samples: 'samples in', samples_late: 'samples late',
  samples_dropped: 'samples dropped', held_ticks: 'ticks held', released_ticks: 'ticks released',
  spikes_dropped: 'spikes dropped by sinks', page_lost: 'spikes and ticks not sent to the page', neuron_resets: 'neurons reset',
};
const kBad = ['overruns', 'gaps', 'skipped_ticks', 'samples_late', 'samples_dropped', 'spikes_dropped', 'page_lost', 'neuron_resets'];

function showCounters() {
  const counters = last.counters;
  const number = (v) => (Number.isInteger(v) ? v.toLocaleString('en').replaceAll(',', '\u2009') : v.toFixed(3));
  const rows = Object.entries(kCounterNames).map(([key, name]) => [name, number(counters[key])]);
  rows.push(['frames missed by this page', number(missed)]);
  rows.push(['probes', last.probes.map((p) => kStates[p.state]).join(', ')]);
  fill(byId('counters'), rows);
  const values = byId('counters').querySelectorAll('dd');
  Object.keys(kCounterNames).forEach((key, i) => values[i].classList.toggle('bad', kBad.includes(key) && counters[key] > 0));
  byId('clock').textContent = last.t.toFixed(1);
  byId('spikes').textContent = String(counters.spikes);
  byId('rate').textContent = rates(span()).reduce((a, b) => a + b, 0).toFixed(0);
}

function draw() {
  requestAnimationFrame(draw);
  if (!dirty || !scene || !last) return;
  dirty = false;
  const time = span();
  readings.forEach((reading) => reading.say());
  drawTrace(time); showPress(); drawRaster(time); drawSkin(time); drawRates(time); drawLatency(); showCounters();
  document.body.dataset.frames = last.number;
}

// ---- controls -------------------------------------------------------------------------------

function showPause() {
  byId('pause').setAttribute('aria-pressed', paused);
  byId('pause').textContent = paused ? 'Go on' : 'Pause';
}

function togglePause() {
  paused = !paused;
  pausedAt = last ? last.t : 0;
  pausedProbes = last ? last.probes : [];
  showPause();
  dirty = true;
}

function stepWindow(by) {
  const at = kSteps.indexOf(Number(byId('window').value)) + by;
  byId('window').value = kSteps[Math.max(0, Math.min(kSteps.length - 1, at))];
  dirty = true;
}

const dark = matchMedia('(prefers-color-scheme: dark)');
const themes = ['auto', 'light', 'dark'];
let theme = 'auto';

function showTheme() {
  const isDark = theme === 'dark' || (theme === 'auto' && dark.matches);
  document.documentElement.dataset.theme = isDark ? 'dark' : 'light';
  byId('theme').textContent = `Theme: ${theme}`;
  if (scene) makeTrace();
  dirty = true;
}

function nextTheme() { theme = themes[(themes.indexOf(theme) + 1) % 3]; showTheme(); }

/// Says what lies under the pointer or, in a picture that has the focus, where the arrows lead.
function hover(canvas, output, describe) {
  let place = null;        // that is described, in pixels
  const say = () => {
    if (scene && last && place) byId(output).textContent = describe(place.x, place.y, canvas.clientWidth, canvas.clientHeight);
  };
  const point = (event) => { place = { x: event.offsetX, y: event.offsetY }; say(); };
  const leave = () => { place = null; byId(output).textContent = ''; dirty = true; };
  canvas.addEventListener('pointermove', point);
  canvas.addEventListener('pointerdown', point);
  canvas.addEventListener('pointerleave', leave);
  canvas.addEventListener('blur', leave);
  canvas.addEventListener('keydown', (event) => {
    const step = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, -1], ArrowDown: [0, 1] }[event.key];
    if (!step) return;
    const width = canvas.clientWidth, height = canvas.clientHeight, by = event.shiftKey ? 40 : 8;
    const from = place ?? { x: width / 2, y: height / 2 };
    place = { x: Math.min(width - 1, Math.max(0, from.x + step[0] * by)), y: Math.min(height - 1, Math.max(0, from.y + step[1] * by)) };
    say();
    event.preventDefault();
  });
  return { active: () => place !== null, say };
}

readings.push(hover(byId('raster'), 'raster-value', (x, y, width, height) => {
  const time = span();
  const { left, w, h } = rasterFrame(width, height);
  const n = Math.ceil((1 - y / h) * scene.neurons);
  const t = time.from + (x - left) / w * time.seconds;
  return n >= 1 && n <= scene.neurons && t >= time.from && t <= time.to ? `afferent ${n}, ${t.toFixed(3)} s` : '';
}));
readings.push(hover(byId('skin'), 'skin-value', (x, y, width, height) => {
  for (const f of skinFrames(width, height)) {
    const mm = { x: (x - f.x(0)) / f.scale, y: f.patch.width_mm - (y - 6) / f.scale };
    const n = afferentAt(f, mm.x, mm.y);
    if (n >= 0) return `(${mm.x.toFixed(1)}, ${mm.y.toFixed(1)}) mm, afferent ${f.first + n + 1}: ${rates(span())[f.first + n]} /s`;
  }
  return '';
}));
readings.push(hover(byId('rates'), 'rates-value', (x, y, width) => {
  const i = Math.floor((x - 34) / (width - 34) * scene.neurons);
  return i >= 0 && i < scene.neurons ? `afferent ${i + 1}: ${rates(span())[i]} /s` : '';
}));
latencyReading = hover(byId('latency'), 'latency-value', (x, y, width) => {
  const bin = Math.min(last.latency.length - 1, Math.max(0, Math.floor(x / width * last.latency.length)));
  return `${latencyEdge_us(bin).toPrecision(3)} to ${latencyEdge_us(bin + 1).toPrecision(3)} µs: ${last.latency[bin]} ticks`;
});
readings.push(latencyReading);

byId('pause').addEventListener('click', togglePause);
byId('theme').addEventListener('click', nextTheme);
byId('window').addEventListener('change', () => { dirty = true; });
dark.addEventListener('change', showTheme);
addEventListener('keydown', (event) => {
  if (event.ctrlKey || event.metaKey || event.altKey) return;
  const inControl = ['BUTTON', 'SELECT', 'SUMMARY', 'A'].includes(event.target.tagName);
  if (event.key === ' ' && !inControl) { togglePause(); event.preventDefault(); }
  if (event.key === '+' || event.key === '=') stepWindow(1);
  if (event.key === '-') stepWindow(-1);
  if (event.key === 't' || event.key === 'T') nextTheme();
});
addEventListener('resize', () => {
  if (trace) trace.setSize({ width: byId('trace').clientWidth, height: 230 });
  dirty = true;
});

showTheme();
draw();
connect();
