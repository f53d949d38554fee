// What happened in the last seconds: bands from the least to the greatest of each frame, and a spectrum.

import { Sheet, colours } from "./canvas.js";
import { quantity } from "./format.js";

const SECONDS = 5, BINS = 400; // of time: what a band is wide
const STRIPS = [
  ["position", "m", [["x", "blue"], ["z", "orange"]]],
  ["force", "N", [["applied x", "blue"], ["applied z", "orange"]]],
  ["energy", "J", [["supplied", "green"]]],
];
const LINES = STRIPS.flatMap(([, , lines]) => lines.map(([name]) => name));
const LEAST_SPAN = { m: 1e-4, N: 1e-2, J: 1e-7 };

export class Traces {
  constructor(canvas) {
    this.sheet = new Sheet(canvas);
    this.least = LINES.map(() => new Float64Array(BINS));
    this.greatest = LINES.map(() => new Float64Array(BINS));
    this.newest = -1; // bin, counted from the loop's beginning
    this.count = 0; // of bins that hold something
  }

  take(frame, columns) {
    const bin = Math.floor(frame.newest[0] / SECONDS * BINS);
    if (bin < this.newest) this.count = 0; // another loop
    // A frame reaches back to the one before, so that no gap opens between two.
    const from = this.count ? Math.max(this.newest + 1, bin - BINS + 1) : bin;
    this.count = Math.min(this.count + bin - from + 1, BINS);
    LINES.forEach((name, line) => {
      const low = frame.least[columns[name]], high = frame.greatest[columns[name]];
      const least = this.least[line], greatest = this.greatest[line], at = bin % BINS;
      for (let k = from; k <= bin; k++) { least[k % BINS] = low; greatest[k % BINS] = high; }
      least[at] = Math.min(least[at], low);
      greatest[at] = Math.max(greatest[at], high);
    });
    this.newest = bin;
  }

  /** Forget what was: the clock of another loop begins anew. */
  clear() { this.count = 0; this.newest = -1; }

  draw(base) {
    const [draw, width, height] = this.sheet.cleared();
    if (!this.count) return;
    const high = height / STRIPS.length;
    let line = 0;
    STRIPS.forEach(([name, unit, lines], strip) => {
      const shift = unit === "J" ? base : 0, numbers = lines.map((_, k) => line + k);
      const [low, most] = this.extremes(numbers).map(value => value - shift);
      const span = Math.max(most - low, LEAST_SPAN[unit]), middle = (low + most) / 2, top = strip * high;
      const y = value => top + 4 + (0.5 - (value - shift - middle) / span) * (high - 22) + 11;
      draw.strokeStyle = colours().line;
      draw.lineWidth = 1;
      draw.beginPath(); draw.moveTo(0, top); draw.lineTo(width, top);
      if (Math.abs(middle) < span / 2) { draw.moveTo(0, y(shift)); draw.lineTo(width, y(shift)); }
      draw.stroke();
      numbers.forEach((number, k) => this.drawBand(draw, width, number, y, colours()[lines[k][1]]));
      drawWords(draw, width, top + 12, `${name}, ${quantity(low, unit)} to ${quantity(most, unit)}`, lines);
      line += lines.length;
    });
  }

  /** Return the least and the greatest value of some lines. */
  extremes(numbers) {
    let low = Infinity, most = -Infinity;
    for (const line of numbers) {
      for (let k = this.newest - this.count + 1; k <= this.newest; k++) {
        low = Math.min(low, this.least[line][k % BINS]);
        most = Math.max(most, this.greatest[line][k % BINS]);
      }
    }
    return [low, most];
  }

  drawBand(draw, width, line, y, colour) {
    const wide = (width - 8) / BINS, first = this.newest - this.count + 1;
    draw.fillStyle = colour;
    for (let k = first; k <= this.newest; k++) {
      const upper = y(this.greatest[line][k % BINS]), lower = y(this.least[line][k % BINS]);
      draw.fillRect(width - 4 - (this.newest + 1 - k) * wide, upper - 0.8, wide + 0.3, lower - upper + 1.6);
    }
  }
}

function drawWords(draw, width, y, words, lines) {
  draw.font = "11px system-ui, sans-serif";
  draw.fillStyle = colours().soft;
  draw.fillText(words, 4, y);
  let at = width - 4;
  for (const [label, colour] of [...lines].reverse()) {
    draw.fillStyle = colours()[colour];
    const name = label.replace("applied ", "f").replace("supplied", "given to the hand");
    at -= draw.measureText(name).width;
    draw.fillText(name, at, y);
    at -= 10;
  }
}

const SIZE = 2048;
const COSINES = Float64Array.from({ length: SIZE / 2 }, (_, k) => Math.cos(2 * Math.PI * k / SIZE));
const SINES = Float64Array.from({ length: SIZE / 2 }, (_, k) => -Math.sin(2 * Math.PI * k / SIZE));
const WINDOW = Float64Array.from({ length: SIZE }, (_, k) => 0.5 - 0.5 * Math.cos(2 * Math.PI * k / SIZE));

/** Fourier transform of SIZE samples, in place: real and imaginary parts. */
function transform(real, imaginary) {
  const n = real.length;
  for (let i = 1, j = 0; i < n; i++) {
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) [real[i], real[j]] = [real[j], real[i]];
  }
  for (let size = 2; size <= n; size <<= 1) {
    const stride = n / size;
    for (let start = 0; start < n; start += size) {
      for (let k = 0; k < size / 2; k++) {
        const c = COSINES[k * stride], s = SINES[k * stride], a = start + k, b = a + size / 2;
        const re = real[b] * c - imaginary[b] * s, im = real[b] * s + imaginary[b] * c;
        real[b] = real[a] - re; imaginary[b] = imaginary[a] - im;
        real[a] += re; imaginary[a] += im;
      }
    }
  }
}

export class Spectrum {
  constructor(canvas) {
    this.sheet = new Sheet(canvas);
    this.samples = new Float64Array(SIZE);
    this.amplitudes = new Float64Array(SIZE / 2);
  }

  take(forces) {
    const count = Math.min(forces.length / 3, SIZE);
    this.samples.copyWithin(0, count);
    for (let k = 0; k < count; k++) this.samples[SIZE - count + k] = forces[forces.length - 3 * (count - k) + 2];
  }

  /** Compute the amplitudes of the normal force [N]; return the strongest frequency above 20 Hz, and its amplitude. */
  compute(rate) {
    const mean = this.samples.reduce((sum, value) => sum + value, 0) / SIZE;
    const real = this.samples.map((value, k) => (value - mean) * WINDOW[k]);
    const imaginary = new Float64Array(SIZE);
    transform(real, imaginary);
    let strongest = Math.ceil(20 * SIZE / rate);
    for (let k = 0; k < SIZE / 2; k++) {
      this.amplitudes[k] = 4 * Math.hypot(real[k], imaginary[k]) / SIZE;
      if (k > strongest && this.amplitudes[k] > this.amplitudes[strongest]) strongest = k;
    }
    return [strongest * rate / SIZE, this.amplitudes[strongest]];
  }

  draw(rate) {
    const [draw, width, height] = this.sheet.cleared(), shown = colours(), peak = this.compute(rate);
    const lowest = 5, x = f => Math.log(f / lowest) / Math.log(rate / 2 / lowest) * width;
    const y = amplitude => height - 18 - (Math.log10(Math.max(amplitude, 1e-6)) + 6) / 7 * (height - 22);
    draw.font = "11px system-ui, sans-serif";
    draw.strokeStyle = shown.line;
    draw.fillStyle = shown.soft;
    draw.lineWidth = 1;
    for (const f of [10, 100, 1000, 10000].filter(f => f < rate / 2)) {
      draw.beginPath(); draw.moveTo(x(f), 0); draw.lineTo(x(f), height - 16); draw.stroke();
      draw.fillText(quantity(f, "Hz").replace(".00", "").replace(".0", ""), x(f) - 14, height - 4);
    }
    for (const amplitude of [1e-4, 1e-2, 1]) {
      draw.beginPath(); draw.moveTo(0, y(amplitude)); draw.lineTo(width, y(amplitude)); draw.stroke();
      draw.fillText(quantity(amplitude, "N").replace(/\.0+/, ""), 3, y(amplitude) - 3);
    }
    draw.strokeStyle = shown.orange;
    draw.lineWidth = 1.6;
    draw.beginPath();
    // Of all frequencies that share a pixel, the strongest is shown.
    for (let k = Math.ceil(lowest * SIZE / rate), pixel = -1, most = 0; k < SIZE / 2; k++) {
      const at = Math.round(x(k * rate / SIZE));
      most = Math.max(at === pixel ? most : 0, this.amplitudes[k]);
      if (at !== Math.round(x((k + 1) * rate / SIZE))) draw.lineTo(at, y(most));
      pixel = at;
    }
    draw.stroke();
    return peak;
  }
}
