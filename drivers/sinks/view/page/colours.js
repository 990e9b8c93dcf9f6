// Colours of values, distinguishable with any colour vision: seaborn's "mako", uniform in lightness.

const kMako = ['#0b0405', '#2e1e3c', '#413d7b', '#37659e', '#348fa7', '#40b7ad', '#8ad9b1', '#def5e5'];
/// Colours of pinned afferents: Okabe and Ito's palette.
export const kPins = ['#e69f00', '#56b4e9', '#d55e00', '#cc79a7'];

const channels = (hex) => [1, 3, 5].map((at) => parseInt(hex.slice(at, at + 2), 16));

/// 256 colours from zero to the largest value: from pale to dark in the light theme, reversed in the dark one.
function makeScale(isDark) {
  const stops = (isDark ? kMako.slice(2) : kMako.slice(1).reverse()).map(channels);
  return Array.from({ length: 256 }, (unused, i) => {
    const place = i / 255 * (stops.length - 1), low = Math.min(Math.floor(place), stops.length - 2);
    return stops[low].map((value, k) => Math.round(value + (stops[low + 1][k] - value) * (place - low)));
  });
}

const scales = { light: makeScale(false), dark: makeScale(true) };

export const theme = () => document.documentElement.dataset.theme ?? 'light';
export const scale = () => scales[theme()];
/// Colour of a rate, as a share of the largest one: [r, g, b]. Even a low rate stands out from the background.
export const colourOfRate = (share) => scale()[Math.min(255, Math.round(255 * (0.15 + 0.85 * share)))];
export const cssOf = ([r, g, b]) => `rgb(${r},${g},${b})`;
/// A colour for ImageData: 0xAABBGGRR.
export const packed = ([r, g, b]) => (255 << 24 | b << 16 | g << 8 | r) >>> 0;
export const packedHex = (hex) => packed(channels(hex));

let cached = {}, cachedTheme = '';
/// A colour of page.css by its name.
export function css(name) {
  if (cachedTheme !== theme()) { cached = {}; cachedTheme = theme(); }
  return cached[name] ??= getComputedStyle(document.documentElement).getPropertyValue(name).trim();
}
