// The surface in relief: a square that is seen from the front and above, pixel by pixel.

import { channels, colours } from "./canvas.js";

const WIDEST = 720; // pixels that are computed across; a wider place is filled by stretching

/** Return where things stand in a picture of some size [px]. */
export function corners(width, height) {
  const skew = 0.16 * width, left = 0.03 * width, across = 0.94 * width - skew;
  const rise = 0.1 * height, bottom = 0.97 * height - rise, deep = 0.97 * height - 2.3 * rise;
  return { skew, left, across, bottom, deep, rise };
}

/** Return how bright the surface is at each height, 0 to 1: light comes from the left and the front. */
function brightness({ side, heights, size }, exaggeration) {
  const shade = new Float32Array(side * side), slope = exaggeration * (side - 1) / size;
  const last = side - 1;
  for (let j = 0; j < side; j++) {
    const below = Math.max(j - 1, 0), above = Math.min(j + 1, last);
    for (let i = 0; i < side; i++) {
      const before = Math.max(i - 1, 0), after = Math.min(i + 1, last);
      const sx = (heights[j * side + after] - heights[j * side + before]) / (after - before) * slope;
      const sy = (heights[above * side + i] - heights[below * side + i]) / (above - below) * slope;
      const share = (0.8 - 0.55 * sx - 0.25 * sy) / Math.sqrt(1 + sx * sx + sy * sy) / 1.02;
      shade[j * side + i] = Math.min(1, Math.max(0, share));
    }
  }
  return shade;
}

/** Return the 256 colours from low to high, as pixels hold them: alpha, blue, green, red. */
function ramp() {
  const low = channels(colours().low), high = channels(colours().high);
  return Uint32Array.from({ length: 256 }, (_, k) => {
    const [r, g, b] = low.map((value, at) => Math.round(value + k / 255 * (high[at] - value)));
    return (255 << 24 | b << 16 | g << 8 | r) >>> 0;
  });
}

/**
 * Paint heights onto a canvas that fills a place of some size.
 * @param seen side (heights along each side), heights, size [m]; lift [px/m], exaggeration
 */
export function paintRelief(canvas, seen, width, height) {
  const scale = Math.min(1, WIDEST / width);
  canvas.width = Math.round(scale * width);
  canvas.height = Math.round(scale * height);
  const draw = canvas.getContext("2d"), image = draw.createImageData(canvas.width, canvas.height);
  const pixels = new Uint32Array(image.data.buffer), shades = brightness(seen, seen.exaggeration), palette = ramp();
  const place = corners(canvas.width, canvas.height), rows = Math.ceil(place.deep) + 1;
  for (let column = 0; column < canvas.width; column++) {
    paintColumn(pixels, canvas, column, { ...place, rows, lift: seen.lift * scale }, seen, shades, palette);
  }
  draw.putImageData(image, 0, 0);
}

/** Paint one column from the front to the back: what is behind shows where it stands higher. */
function paintColumn(pixels, canvas, column, at, { side, heights }, shades, palette) {
  let top = canvas.height;
  for (let row = 0; row < at.rows; row++) {
    const v = row / (at.rows - 1), u = (column + 0.5 - at.left - v * at.skew) / at.across;
    if (u < 0 || u > 1) continue;
    const across = u * (side - 1), along = v * (side - 1);
    const i = Math.min(Math.floor(across), side - 2), j = Math.min(Math.floor(along), side - 2);
    const a = across - i, b = along - j, k = j * side + i;
    const w0 = (1 - a) * (1 - b), w1 = a * (1 - b), w2 = (1 - a) * b, w3 = a * b;
    const z = w0 * heights[k] + w1 * heights[k + 1] + w2 * heights[k + side] + w3 * heights[k + side + 1];
    const shade = w0 * shades[k] + w1 * shades[k + 1] + w2 * shades[k + side] + w3 * shades[k + side + 1];
    const y = Math.max(0, Math.round(at.bottom - v * at.deep - at.lift * z));
    if (y >= top) continue;
    // The front edge begins with its first point; later ones reach down to what is before them.
    const colour = palette[Math.round(255 * shade)], down = top === canvas.height ? y + 1 : top;
    for (let line = y; line < Math.min(down, canvas.height); line++) pixels[line * canvas.width + column] = colour;
    top = y;
  }
}
