// What happened in the last seconds: bands from the least to the greatest of each frame, and a spectrum.

import { colours, fitted } from "./views.js";
import { quantity } from "./words.js";

const SECONDS = 5;
const FRAMES = 1100; // of SECONDS, at 200 per second
const STRIPS = [
  ["position", "m", [["x", "blue"], ["z", "orange"]]],
  ["force", "N", [["applied x", "blue"], ["applied z", "orange"]]],
  ["energy", "J", [["supplied", "green"]]],
];

export class Traces {
  constructor(canvas) {
    this.canvas = canvas;
    this.frames = [];
  }

  take(frame, columns) {
    const bands = STRIPS.flatMap(([, , lines]) => lines).map(([name]) => {
      const at = columns[name];
      return [frame.least[at], frame.greatest[at]];
    });
    this.frames.push([frame.newest[0], bands]);
    if (this.frames.length > FRAMES) this.frames.splice(0, this.frames.length - FRAMES);
  }

  draw(base) {
    const [draw, width, height] = fitted(this.canvas), shown = colours();
    draw.clearRect(0, 0, width, height);
    if (!this.frames.length) return;
    const now = this.frames.at(-1)[0], first = this.frames.findIndex(([time]) => time > now - SECONDS);
    const frames = this.frames.slice(Math.max(first, 0)), high = height / STRIPS.length;
    const x = time => width - (now - time) / SECONDS * (width - 8) - 4;
    let line = 0;
    STRIPS.forEach(([name, unit, lines], strip) => {
      const shift = unit === "J" ? base : 0;
      const numbers = lines.map((_, k) => line + k);
      let low = Infinity, most = -Infinity;
      for (const [, bands] of frames) {
        for (const k of numbers) { low = Math.min(low, bands[k][0] - shift); most = Math.max(most, bands[k][1] - shift); }
      }
      const span = Math.max(most - low, { m: 1e-4, N: 1e-2, J: 1e-7 }[unit]), middle = (low + most) / 2;
      const top = strip * high, y = value => top + 4 + (0.5 - (value - middle) / span) * (high - 22) + 11;
      draw.strokeStyle = shown.line;
      draw.lineWidth = 1;
      draw.beginPath(); draw.moveTo(0, top); draw.lineTo(width, top);
      if (Math.abs(middle) < span / 2) { draw.moveTo(0, y(0)); draw.lineTo(width, y(0)); }
      draw.stroke();
      lines.forEach(([, colour], k) => {
        draw.fillStyle = shown[colour];
        let before = null;
        for (const [time, bands] of frames) {
          const at = x(time), [least, greatest] = bands[line + k];
          const upper = y(greatest - shift), lower = y(least - shift);
          // A band reaches back to the frame before, so that no gap opens between two.
          draw.fillRect(before ?? at, upper - 0.8, Math.max(at - (before ?? at), 1), lower - upper + 1.6);
          before = at;
        }
      });
      draw.font = "11px system-ui, sans-serif";
      draw.fillStyle = shown.soft;
      draw.fillText(`${name}, ${quantity(low, unit)} to ${quantity(most, unit)}`, 4, top + 12);
      let at = width - 4;
      for (const [label, colour] of [...lines].reverse()) {
        draw.fillStyle = shown[colour];
        const words = label.replace("applied ", "f").replace("supplied", "given to the hand");
        at -= draw.measureText(words).width;
        draw.fillText(words, at, top + 12);
        at -= 10;
      }
      line += lines.length;
    });
  }
}

const SIZE = 2048;

/** Fourier transform of real samples, in place: real and imaginary parts. */
function transform(real, imaginary) {
  const n = real.length;
  for (let i = 1, j = 0; i < n; i++) {
    let bit = n >> 1;
    for (; j & bit; bit >>= 1) j ^= bit;
    j ^= bit;
    if (i < j) [real[i], real[j]] = [real[j], real[i]];
  }
  for (let size = 2; size <= n; size <<= 1) {
    const angle = -2 * Math.PI / size;
    for (let start = 0; start < n; start += size) {
      for (let k = 0; k < size / 2; k++) {
        const c = Math.cos(angle * k), s = Math.sin(angle * k), a = start + k, b = a + size / 2;
        const re = real[b] * c - imaginary[b] * s, im = real[b] * s + imaginary[b] * c;
        real[b] = real[a] - re; imaginary[b] = imaginary[a] - im;
        real[a] += re; imaginary[a] += im;
      }
    }
  }
}

export class Spectrum {
  constructor(canvas) {
    this.canvas = canvas;
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
    const real = this.samples.map((value, k) => (value - mean) * (0.5 - 0.5 * Math.cos(2 * Math.PI * k / SIZE)));
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
    const [draw, width, height] = fitted(this.canvas), shown = colours(), peak = this.compute(rate);
    draw.clearRect(0, 0, width, height);
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
    for (let k = 1; k < SIZE / 2; k++) {
      const f = k * rate / SIZE;
      if (f >= lowest) draw.lineTo(x(f), y(this.amplitudes[k]));
    }
    draw.stroke();
    return peak;
  }
}
