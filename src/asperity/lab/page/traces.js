// Plots of the last seconds: traces (the middle of each moment over its range) of position, force and energy, and the spectrum of the normal force.

import { ScaledCanvas, colours } from "./canvas.js";
import { formatQuantity } from "./format.js";

const DURATION = 5, BINS = 400; // s, and bins of that time, each drawn as a band from minimum to maximum
const STRIPS = [
  ["position", "m", [["x", "blue"], ["z", "orange"]]],
  ["force", "N", [["applied x", "blue"], ["applied z", "orange"]]],
  ["energy", "J", [["supplied", "green"]]],
];
const TRACES = STRIPS.flatMap(([, , traces]) => traces.map(([name]) => name));
const MIN_SPAN = { m: 1e-4, N: 1e-2, J: 1e-7 };

export class TracePlot {
  constructor(element) {
    this.scaledCanvas = new ScaledCanvas(element);
    this.minima = TRACES.map(() => new Float64Array(BINS));
    this.maxima = TRACES.map(() => new Float64Array(BINS));
    this.newestBin = -1; // counted from the start of the loop
    this.binCount = 0; // bins with data
    this.label = ""; // of the lane, if there are two
  }

  addFrame(frame, columns) {
    const bin = Math.floor(frame.newest[0] / DURATION * BINS);
    if (bin < this.newestBin) this.binCount = 0; // the loop was restarted
    // Bins between two frames are filled, so that the traces have no gaps.
    const firstBin = this.binCount ? Math.max(this.newestBin + 1, bin - BINS + 1) : bin;
    this.binCount = Math.min(this.binCount + bin - firstBin + 1, BINS);
    TRACES.forEach((name, trace) => {
      const low = frame.minima[columns[name]], high = frame.maxima[columns[name]];
      const minima = this.minima[trace], maxima = this.maxima[trace], index = bin % BINS;
      for (let k = firstBin; k <= bin; k++) { minima[k % BINS] = low; maxima[k % BINS] = high; }
      minima[index] = Math.min(minima[index], low);
      maxima[index] = Math.max(maxima[index], high);
    });
    this.newestBin = bin;
  }

  /** Discard all data: the time of another loop starts at zero. */
  clear() { this.binCount = 0; this.newestBin = -1; }

  /**
   * Draw the traces, the energy relative to an offset [J].
   * @param other plot and energy offset whose values are within the scales, too; null for none
   */
  draw(energyOffset, other = null) {
    const [context, width, height] = this.scaledCanvas.clear();
    if (!this.binCount) return;
    const stripHeight = height / STRIPS.length;
    let firstTrace = 0;
    STRIPS.forEach(([name, unit, traces], strip) => {
      const offset = unit === "J" ? energyOffset : 0, indices = traces.map((_, k) => firstTrace + k);
      const others = other?.plot.range(indices).map(value => value - (unit === "J" ? other.offset : 0)) ?? [Infinity, -Infinity];
      const own = this.range(indices).map(value => value - offset), [low, high] = [Math.min(own[0], others[0]), Math.max(own[1], others[1])];
      const span = Math.max(high - low, MIN_SPAN[unit]), middle = (low + high) / 2, top = strip * stripHeight;
      const y = value => top + 4 + (0.5 - (value - offset - middle) / span) * (stripHeight - 22) + 11;
      context.strokeStyle = colours().line;
      context.lineWidth = 1;
      context.beginPath(); context.moveTo(0, top); context.lineTo(width, top);
      if (Math.abs(middle) < span / 2) { context.moveTo(0, y(offset)); context.lineTo(width, y(offset)); }
      context.stroke();
      indices.forEach((index, k) => this.drawTrace(context, width, index, y, colours()[traces[k][1]]));
      drawLabels(context, width, top + 12, `${this.label && `${this.label}: `}${name}, ${formatQuantity(low, unit)} to ${formatQuantity(high, unit)}`, traces);
      firstTrace += traces.length;
    });
  }

  /** Return the least and the greatest value of some traces. */
  range(indices) {
    let low = Infinity, high = -Infinity;
    for (const trace of indices) {
      for (let k = this.newestBin - this.binCount + 1; k <= this.newestBin; k++) {
        low = Math.min(low, this.minima[trace][k % BINS]);
        high = Math.max(high, this.maxima[trace][k % BINS]);
      }
    }
    return [low, high];
  }

  drawTrace(context, width, trace, y, colour) {
    const binWidth = (width - 8) / BINS, firstBin = this.newestBin - this.binCount + 1;
    context.fillStyle = context.strokeStyle = colour;
    context.lineWidth = 1.4;
    context.beginPath();
    context.globalAlpha = 0.3;
    for (let k = firstBin; k <= this.newestBin; k++) {
      const upper = y(this.maxima[trace][k % BINS]), lower = y(this.minima[trace][k % BINS]);
      const x = width - 4 - (this.newestBin + 1 - k) * binWidth;
      context.fillRect(x, upper - 0.8, binWidth, lower - upper + 1.6);
      context.lineTo(x + binWidth / 2, (upper + lower) / 2);
    }
    context.globalAlpha = 1;
    context.stroke();
  }
}

/** Draw the title of a strip at the left, and the names of its traces at the right. */
function drawLabels(context, width, y, title, traces) {
  context.font = "11px system-ui, sans-serif";
  context.fillStyle = colours().soft;
  context.fillText(title, 4, y);
  const titleEnd = 8 + context.measureText(title).width;
  let x = width - 4;
  for (const [name, colour] of [...traces].reverse()) {
    context.fillStyle = colours()[colour];
    const label = name.replace("applied ", "f").replace("supplied", "given to the hand");
    x -= context.measureText(label).width;
    if (x < titleEnd) break; // a narrow plot
    context.fillText(label, x, y);
    x -= 10;
  }
}

const SIZE = 2048; // samples of the Fourier transform
const COSINES = Float64Array.from({ length: SIZE / 2 }, (_, k) => Math.cos(2 * Math.PI * k / SIZE));
const SINES = Float64Array.from({ length: SIZE / 2 }, (_, k) => -Math.sin(2 * Math.PI * k / SIZE));
const HANN_WINDOW = Float64Array.from({ length: SIZE }, (_, k) => 0.5 - 0.5 * Math.cos(2 * Math.PI * k / SIZE));
const MIN_PEAK_FREQUENCY = 20, MIN_SHOWN_FREQUENCY = 5; // Hz

/** Compute the fast Fourier transform of SIZE samples in place: real and imaginary parts. */
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
  constructor() {
    this.samples = new Float64Array(SIZE);
    this.amplitudes = new Float64Array(SIZE / 2);
  }

  /** Add the normal components of forces (x, y, z of each row). */
  addForces(forces) {
    const count = Math.min(forces.length / 3, SIZE);
    this.samples.copyWithin(0, count);
    for (let k = 0; k < count; k++) this.samples[SIZE - count + k] = forces[forces.length - 3 * (count - k) + 2];
  }

  /** Compute the amplitudes of the normal force [N]; return frequency and amplitude of the peak. */
  compute(updateRate) {
    const mean = this.samples.reduce((sum, value) => sum + value, 0) / SIZE;
    const real = this.samples.map((value, k) => (value - mean) * HANN_WINDOW[k]);
    const imaginary = new Float64Array(SIZE);
    transform(real, imaginary);
    let peak = Math.ceil(MIN_PEAK_FREQUENCY * SIZE / updateRate);
    for (let k = 0; k < SIZE / 2; k++) {
      this.amplitudes[k] = 4 * Math.hypot(real[k], imaginary[k]) / SIZE;
      if (k > peak && this.amplitudes[k] > this.amplitudes[peak]) peak = k;
    }
    return [peak * updateRate / SIZE, this.amplitudes[peak]];
  }
}

export class SpectrumPlot extends Spectrum {
  constructor(element) {
    super();
    this.scaledCanvas = new ScaledCanvas(element);
  }

  /**
   * Draw the spectrum; return frequency and amplitude of its peak.
   * @param other spectrum of the second lane; null for none
   */
  draw(updateRate, other = null) {
    const [context, width, height] = this.scaledCanvas.clear(), theme = colours(), peak = this.compute(updateRate);
    const x = f => Math.log(f / MIN_SHOWN_FREQUENCY) / Math.log(updateRate / 2 / MIN_SHOWN_FREQUENCY) * width;
    const y = amplitude => height - 18 - (Math.log10(Math.max(amplitude, 1e-6)) + 6) / 7 * (height - 22);
    drawGrid(context, width, height, updateRate, x, y);
    context.lineWidth = 1.6;
    other?.compute(updateRate);
    if (other) drawCurve(context, other.amplitudes, theme.blue, updateRate, x, y);
    drawCurve(context, this.amplitudes, theme.orange, updateRate, x, y);
    return peak;
  }
}

/** Draw amplitudes; of the frequencies within one pixel, the greatest amplitude is drawn. */
function drawCurve(context, amplitudes, colour, updateRate, x, y) {
  context.strokeStyle = colour;
  context.beginPath();
  for (let k = Math.ceil(MIN_SHOWN_FREQUENCY * SIZE / updateRate), pixel = -1, maximum = 0; k < SIZE / 2; k++) {
    const column = Math.round(x(k * updateRate / SIZE));
    maximum = Math.max(column === pixel ? maximum : 0, amplitudes[k]);
    if (column !== Math.round(x((k + 1) * updateRate / SIZE))) context.lineTo(column, y(maximum));
    pixel = column;
  }
  context.stroke();
}

function drawGrid(context, width, height, updateRate, x, y) {
  context.font = "11px system-ui, sans-serif";
  context.strokeStyle = colours().line;
  context.fillStyle = colours().soft;
  context.lineWidth = 1;
  for (const f of [10, 100, 1000, 10000].filter(frequency => frequency < updateRate / 2)) {
    context.beginPath(); context.moveTo(x(f), 0); context.lineTo(x(f), height - 16); context.stroke();
    context.fillText(formatQuantity(f, "Hz").replace(".00", "").replace(".0", ""), x(f) - 14, height - 4);
  }
  for (const amplitude of [1e-4, 1e-2, 1]) {
    context.beginPath(); context.moveTo(0, y(amplitude)); context.lineTo(width, y(amplitude)); context.stroke();
    context.fillText(formatQuantity(amplitude, "N").replace(/\.0+/, ""), 3, y(amplitude) - 3);
  }
}
