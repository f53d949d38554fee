// Renderer of the relief: a square of the surface in an oblique view from the front and above.

import { colours, toRgb } from "./canvas.js";

const MAX_WIDTH = 720; // rendered pixels; a wider view is enlarged

/** Return the geometry of the oblique projection in a view of some size [px]. */
export function projectionGeometry(width, height) {
  const skew = 0.16 * width, left = 0.03 * width, across = 0.94 * width - skew;
  const maxRise = 0.1 * height, bottom = 0.97 * height - maxRise, depth = 0.97 * height - 2.3 * maxRise;
  return { skew, left, across, bottom, depth, maxRise };
}

/** Return the brightness at each height, 0 to 1, with light from the left and the front. */
function computeBrightness({ side, heights, size, exaggeration }) {
  const brightness = new Float32Array(side * side), slopeScale = exaggeration * (side - 1) / size;
  const last = side - 1;
  for (let j = 0; j < side; j++) {
    const front = Math.max(j - 1, 0), back = Math.min(j + 1, last);
    for (let i = 0; i < side; i++) {
      const left = Math.max(i - 1, 0), right = Math.min(i + 1, last);
      const sx = (heights[j * side + right] - heights[j * side + left]) / (right - left) * slopeScale;
      const sy = (heights[back * side + i] - heights[front * side + i]) / (back - front) * slopeScale;
      const value = (0.8 - 0.55 * sx - 0.25 * sy) / Math.sqrt(1 + sx * sx + sy * sy) / 1.02;
      brightness[j * side + i] = Math.min(1, Math.max(0, value));
    }
  }
  return brightness;
}

/** Return 256 colours from dark to bright, as pixels: alpha, blue, green, red. */
function makePalette() {
  const low = toRgb(colours().low), high = toRgb(colours().high);
  return Uint32Array.from({ length: 256 }, (_, k) => {
    const [r, g, b] = low.map((value, channel) => Math.round(value + k / 255 * (high[channel] - value)));
    return (255 << 24 | b << 16 | g << 8 | r) >>> 0;
  });
}

/**
 * Render heights onto a canvas for a view of some size.
 * @param relief side (number of heights along each side), heights and size [m]; lift [px/m], exaggeration
 */
export function renderRelief(canvas, relief, width, height) {
  const scale = Math.min(1, MAX_WIDTH / width);
  canvas.width = Math.round(scale * width);
  canvas.height = Math.round(scale * height);
  const context = canvas.getContext("2d"), image = context.createImageData(canvas.width, canvas.height);
  const pixels = new Uint32Array(image.data.buffer), brightness = computeBrightness(relief), palette = makePalette();
  const geometry = projectionGeometry(canvas.width, canvas.height), rowCount = Math.ceil(geometry.depth) + 1;
  for (let column = 0; column < canvas.width; column++) {
    renderColumn(pixels, canvas, column, { ...geometry, rowCount, lift: relief.lift * scale }, relief, brightness, palette);
  }
  context.putImageData(image, 0, 0);
}

/** Render one column from the front to the back; a point is visible if it is above all points before it. */
function renderColumn(pixels, canvas, column, geometry, { side, heights }, brightness, palette) {
  let top = canvas.height;
  for (let row = 0; row < geometry.rowCount; row++) {
    const v = row / (geometry.rowCount - 1), u = (column + 0.5 - geometry.left - v * geometry.skew) / geometry.across;
    if (u < 0 || u > 1) continue;
    const gridX = u * (side - 1), gridY = v * (side - 1);
    const i = Math.min(Math.floor(gridX), side - 2), j = Math.min(Math.floor(gridY), side - 2);
    const a = gridX - i, b = gridY - j, k = j * side + i;
    const w0 = (1 - a) * (1 - b), w1 = a * (1 - b), w2 = (1 - a) * b, w3 = a * b;
    const z = w0 * heights[k] + w1 * heights[k + 1] + w2 * heights[k + side] + w3 * heights[k + side + 1];
    const value = w0 * brightness[k] + w1 * brightness[k + 1] + w2 * brightness[k + side] + w3 * brightness[k + side + 1];
    const y = Math.max(0, Math.round(geometry.bottom - v * geometry.depth - geometry.lift * z));
    if (y >= top) continue;
    // The first point of a column takes one pixel; each later one extends down to the points before it.
    const colour = palette[Math.round(255 * value)], end = top === canvas.height ? y + 1 : top;
    for (let line = y; line < Math.min(end, canvas.height); line++) pixels[line * canvas.width + column] = colour;
    top = y;
  }
}
