// Theme and keyboard shortcuts.
import { byId } from './canvas.js';

const kThemes = ['auto', 'light', 'dark'];
const dark = matchMedia('(prefers-color-scheme: dark)');
let chosen = localStorage.getItem('theme') ?? 'auto';

export function setUpTheme(changed) {
  const show = () => {
    const isDark = chosen === 'dark' || (chosen === 'auto' && dark.matches);
    document.documentElement.dataset.theme = isDark ? 'dark' : 'light';
    byId('theme').textContent = `Theme: ${chosen}`;
    changed();
  };
  byId('theme').addEventListener('click', () => {
    chosen = kThemes[(kThemes.indexOf(chosen) + 1) % kThemes.length];
    localStorage.setItem('theme', chosen);
    show();
  });
  dark.addEventListener('change', show);
  show();
}

function stepWindow(by) {
  const list = byId('window');
  list.selectedIndex = Math.max(0, Math.min(list.options.length - 1, list.selectedIndex + by));
}

export function setUpKeys(page) {
  const redraw = () => { page.dirty = true; };
  const sound = () => {
    page.sound.toggle();
    byId('sound').setAttribute('aria-pressed', page.sound.on);
    byId('sound').textContent = page.sound.on ? 'Sound on' : 'Sound off';
    byId('sound-settings').hidden = !page.sound.on;
  };
  byId('pause').addEventListener('click', () => page.togglePause());
  byId('sound').addEventListener('click', sound);
  byId('sound-of').addEventListener('change', (event) => { page.sound.all = event.target.value === 'all'; });
  byId('volume').addEventListener('input', (event) => page.sound.setVolume(Number(event.target.value)));
  byId('zoom-in').addEventListener('click', () => page.finger.zoomBy(1.5));
  byId('zoom-out').addEventListener('click', () => page.finger.zoomBy(1 / 1.5));
  for (const id of ['window', 'order', 'hide-silent']) byId(id).addEventListener('change', redraw);
  const keys = {
    ' ': () => page.togglePause(), '+': () => stepWindow(1), '=': () => stepWindow(1), '-': () => stepWindow(-1),
    t: () => byId('theme').click(), s: sound, h: () => byId('hide-silent').click(),
    z: () => page.finger.zoomBy(1.5), x: () => page.finger.zoomBy(1 / 1.5),
  };
  addEventListener('keydown', (event) => {
    if (event.ctrlKey || event.metaKey || event.altKey) return;
    const tag = event.target.tagName;
    if (tag === 'INPUT' || tag === 'SELECT' || (event.key === ' ' && ['BUTTON', 'SUMMARY', 'A'].includes(tag))) return;
    const act = keys[event.key] ?? keys[event.key.toLowerCase()];
    if (!act) return;
    act();
    redraw();
    event.preventDefault();
  });
}
