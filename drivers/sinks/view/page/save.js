// Saves the view to files: a picture of the window, and tables of its time span.
import { byId, pixelRatio } from './canvas.js';
import { css } from './colours.js';

function download(blob, name) {
  const link = document.createElement('a');
  link.href = URL.createObjectURL(blob);
  link.download = name;
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

const stem = (scene, time) => `merkel-${scene.scene.replace(/[^A-Za-z0-9_-]+/g, '_')}-${time.from.toFixed(1)}-${time.to.toFixed(1)}s`;

/// The numbers, legends and axis labels, in the places and fonts of the page.
function drawTexts(c, main, head) {
  c.textAlign = 'left';
  for (const each of document.querySelectorAll('#numbers span, #numbers b, #numbers small, .legend span, main .caption > span, .card h3, .card header span')) {
    const box = each.getBoundingClientRect(), style = getComputedStyle(each);
    if (!box.width) continue;
    c.font = `${style.fontWeight} ${style.fontSize} ${style.fontFamily}`;
    c.fillStyle = style.color;
    c.fillText(each.textContent, box.x - main.x, box.y - main.y + head + box.height / 2);
  }
}

/// The canvases and numbers of the page, under a line that describes them.
export function drawPicture(scene, time, health) {
  const ratio = pixelRatio(), main = document.querySelector('main').getBoundingClientRect(), head = 30;
  const canvas = document.createElement('canvas');
  canvas.width = main.width * ratio;
  canvas.height = (main.height + head) * ratio;
  const c = canvas.getContext('2d');
  c.scale(ratio, ratio);
  c.fillStyle = css('--paper'); c.fillRect(0, 0, main.width, main.height + head);
  c.fillStyle = css('--ink'); c.textBaseline = 'middle';
  c.font = '600 16px system-ui, sans-serif'; c.fillText(`merkel ${scene.scene}, ${time.from.toFixed(2)} to ${time.to.toFixed(2)} s. ${health.title}`, 12, 15);
  for (const each of document.querySelectorAll('main canvas')) {
    const box = each.getBoundingClientRect();
    if (box.width && each.width) c.drawImage(each, box.x - main.x, box.y - main.y + head, box.width, box.height);
  }
  drawTexts(c, main, head);
  return canvas;
}

export function savePicture(scene, time, health) {
  drawPicture(scene, time, health).toBlob((blob) => download(blob, `${stem(scene, time)}.png`));
}

/// A table time_s,neuron in the format of merkel's spike files: times are probe time.
export function spikeTable({ spikes }, time, origin_s) {
  const lines = ['time_s,neuron'], last = spikes.firstAfter(time.to + 1e-9);
  for (let i = spikes.firstAfter(time.from); i < last; ++i) lines.push(`${(origin_s + spikes.t[i]).toFixed(9)},${spikes.n[i]}`);
  return `${lines.join('\n')}\n`;
}

/// One row per point: time, then depth or pressure, and force of each probe.
export function pressTable({ points, scene }, time, origin_s) {
  const column = (name, unit, i) => (scene.probes.length > 1 ? `${name}_${i + 1}_${unit}` : `${name}_${unit}`);
  const lines = [['time_s', ...scene.probes.flatMap((probe, i) => [column(probe.measure.name, probe.measure.unit, i), column('force', 'N', i)])].join(',')];
  const last = points.firstAfter(time.to + 1e-9);
  for (let i = points.firstAfter(time.from); i < last; ++i) {
    const values = scene.probes.flatMap((probe, k) => [points[`reading${k}`][i].toFixed(6), points[`force${k}`][i].toFixed(6)]);
    lines.push([(origin_s + points.t[i]).toFixed(9), ...values].join(','));
  }
  return `${lines.join('\n')}\n`;
}

export function saveTable(which, history, time, origin_s) {
  const text = (which === 'spikes' ? spikeTable : pressTable)(history, time, origin_s);
  download(new Blob([text], { type: 'text/csv' }), `${stem(history.scene, time)}-${which}.csv`);
}

/// Fills the menu "Save".
export function setUpSaving(page) {
  byId('save').addEventListener('change', (event) => {
    const which = event.target.value;
    event.target.value = '';
    if (!page.scene || !page.frame) return;
    if (which === 'png') savePicture(page.scene, page.time(), page.health);
    else if (which) saveTable(which, page.history, page.time(), page.frame.origin_s);
  });
}
