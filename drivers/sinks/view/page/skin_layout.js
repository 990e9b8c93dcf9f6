// The position of each patch of skin in the picture, in mm (u to the right, v up), and its outline.
// A single patch is a finger that points to the left. Patches named after the parts of a hand form a
// right hand in palmar view, with the fingers to the left. Other patches are placed side by side.

const kHand = {
  thumb: { at: [0, 105], angle: -0.78, length: 76 },
  index: { at: [-75, 56], angle: 0, length: 95 },
  middle: { at: [-84, 34.5], angle: 0, length: 104 },
  ring: { at: [-77, 13], angle: 0, length: 97 },
  little: { at: [-57, -8.5], angle: 0, length: 77 },
};
const kPalm = { u: 0, v: -6, length: 100, width: 80 };
const kFingerWidth = 20;

const unit = (angle) => ({ cos: Math.cos(angle), sin: Math.sin(angle) });

/// A finger's outline from its tip, for patches of this `width`: a blunt, open curve.
function fingerPath(width, length) {
  const path = new Path2D();
  const half = width / 2, b = 1.2 * half, a = half + 5, steps = 40;
  path.moveTo(length, half - b);
  for (let i = 0; i <= steps; ++i) {
    const angle = -Math.PI / 2 - Math.PI * i / steps;
    const c = Math.cos(angle), s = Math.sin(angle);
    path.lineTo(half + a * Math.sign(c) * Math.abs(c) ** (2 / 3), half + b * Math.sign(s) * Math.abs(s) ** (2 / 3));
  }
  path.lineTo(length, half + b);
  return path;
}

function palmPath({ u, v, length, width }) {
  const path = new Path2D(), r = 22, m = 4;
  path.roundRect(u - m, v - m, length + 2 * m, width + 2 * m, [r / 2, r, r, r / 2]);
  return path;
}

/// A patch placed in the picture. to(x, y) gives {u, v}; from(u, v) gives {x, y}, both in mm.
function place(patch, index, first, u0, v0, angle = 0) {
  const { cos, sin } = unit(angle);
  const fields = patch.field_radius_mm > 0;
  const count = patch.centres.length;
  return {
    patch, index, first, count, fields, u0, v0, angle, cos, sin,
    to: (x, y) => ({ u: u0 + x * cos - y * sin, v: v0 + x * sin + y * cos }),
    from: (u, v) => ({ x: (u - u0) * cos + (v - v0) * sin, y: -(u - u0) * sin + (v - v0) * cos }),
    /// Centre of an afferent's receptive field; n counts from 0 in the patch.
    centre: (n) => patch.centres[n],
  };
}

function layHand(patches, firsts) {
  const outlines = Object.values(kHand).map(({ at, angle, length }) => ({
    path: fingerPath(kFingerWidth, length), u0: at[0], v0: at[1], angle,
  }));
  outlines.push({ path: palmPath(kPalm), u0: 0, v0: 0, angle: 0 });
  const placed = patches.map((patch, i) => {
    const finger = kHand[patch.name];
    if (!finger) return place(patch, i, firsts[i], kPalm.u, kPalm.v);
    return place(patch, i, firsts[i], finger.at[0], finger.at[1], finger.angle);
  });
  return { placed, outlines, bounds: { u0: -91, u1: 106, v0: -15, v1: 127 }, kind: 'hand' };
}

function laySideBySide(patches, firsts) {
  const placed = [], outlines = [];
  let u = 0, tall = 0;
  patches.forEach((patch, i) => {
    placed.push(place(patch, i, firsts[i], u, 0));
    // A single finger extends beyond the picture.
    const reach = patch.length_mm + (patches.length === 1 ? 1000 : 5);
    outlines.push({ path: fingerPath(patch.width_mm, reach), u0: u, v0: 0, angle: 0 });
    u += patch.length_mm + patch.width_mm * 0.3 + 12;
    tall = Math.max(tall, patch.width_mm);
  });
  const bounds = { u0: -6, u1: u - 9 - 0.3 * patches.at(-1).width_mm, v0: -0.12 * tall, v1: 1.12 * tall };
  return { placed, outlines, bounds, kind: 'fingers' };
}

export function layOut(patches) {
  const firsts = [];
  let next = 0;
  for (const patch of patches) {
    firsts.push(next);
    next += patch.centres.length;
  }
  const isHand = patches.length > 1 && patches.every((p) => p.name in kHand || p.name === 'palm');
  return isHand ? layHand(patches, firsts) : laySideBySide(patches, firsts);
}

/// The patch of an afferent; afferents are numbered from 1 through all patches.
export function placeOf(layout, afferent) {
  return layout.placed.find((p) => afferent > p.first && afferent <= p.first + p.count);
}

/// The afferent whose field contains a position in a patch, numbered from 1 through all patches; 0: none.
export function afferentAt(placed, x, y) {
  const { patch, count, first } = placed;
  if (!placed.fields) {
    if (x < 0 || y < 0 || x >= patch.length_mm || y >= patch.width_mm) return 0;
    return first + 1 + Math.floor(y / patch.width_mm * patch.rows) * patch.columns + Math.floor(x / patch.length_mm * patch.columns);
  }
  let nearest = 0, least = patch.field_radius_mm;
  for (let n = 0; n < count; ++n) {
    const away = Math.hypot(patch.centres[n][0] - x, patch.centres[n][1] - y);
    if (away < least) { least = away; nearest = first + n + 1; }
  }
  return nearest;
}
