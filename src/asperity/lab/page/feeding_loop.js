// The loop of the hand that gains most energy from the curl of the field in a section.

const RADII = [1, 0.5, 0.25]; // relative to the greatest radius along x
const STEPS = Array.from({ length: 15 }, (_, k) => (k - 7) / 7.5);
const DISC = STEPS.flatMap(u => STEPS.map(v => [u, v])).filter(([u, v]) => u * u + v * v <= 1); // points of the unit disc
const EQUAL_SHARE = 0.6; // of the greatest gain: best loops of their flanks that gain more than this are equally good

/**
 * Return the integral of the curl over an ellipse of the x-z plane [N].
 *
 * The points are the ellipse's own, each with the curl of the nearest one of the picture, whose rows may be farther
 * apart than the ellipse is high.
 */
function integrateCurl({ box: [left, right, bottom, top], columns, rows, curl }, x, z, radiusX, radiusZ) {
  const dx = (right - left) / (columns - 1), dz = (top - bottom) / (rows - 1);
  let sum = 0;
  for (const [u, v] of DISC) {
    const i = Math.round((x + u * radiusX - left) / dx), j = Math.round((z + v * radiusZ - bottom) / dz);
    if (i >= 0 && i < columns && j >= 0 && j < rows) sum += curl[j * columns + i];
  }
  return sum * Math.PI * radiusX * radiusZ / DISC.length;
}

/**
 * Return the loop near x that gains most energy, or null where no loop gains any.
 *
 * Counterclockwise in the x-z plane (x right, z up), ∮ f·dp = -∬ (∂f_x/∂z - ∂f_z/∂x) dA: the sense is that in
 * which the field supplies energy.
 * @param section view with a current picture
 * @param loop x, centre z, radius along x and radius along z [m]
 * @returns x, radius along x [m], and sense: 1 counterclockwise, -1 clockwise
 */
export function findFeedingLoop(section, { x, z, radiusX, radiusZ }) {
  if (!section.box || !section.hasCurl) return null;
  const [left, right] = section.box, step = (right - left) / (section.columns - 1), loops = [];
  for (const radius of RADII.map(factor => factor * radiusX).filter(value => value > 1.5 * step || value === radiusX)) {
    const gains = [];
    for (let centre = left + radius; centre <= right - radius; centre += step / 2) {
      gains.push([centre, -integrateCurl(section, centre, z, radius, radiusZ)]);
    }
    const sizeAt = index => Math.abs(gains[index]?.[1] ?? 0);
    gains.forEach(([centre, gain], index) => {
      const size = sizeAt(index);
      if (size < sizeAt(index - 1) || size < sizeAt(index + 1)) return; // not the best of its flank
      loops.push({ x: centre, radiusX: radius, gain: size, sense: Math.sign(gain) });
    });
  }
  const most = Math.max(0, ...loops.map(({ gain }) => gain));
  if (!(most > 0)) return null;
  const [nearest] = loops.filter(({ gain }) => gain >= EQUAL_SHARE * most).sort((a, b) => Math.abs(a.x - x) - Math.abs(b.x - x));
  return nearest;
}
