// The surface in relief, and a cut under the probe with field and curl behind it.

import { quantity, roundStep } from "./words.js";

const RELIEF = 2;
const ARROW = 250; // pixels per newton, as long as that fits
const LONGEST = 130; // pixels

/** Fit a canvas to its place on the screen; return its context, and width and height in pixels. */
export function fitted(canvas) {
  const ratio = Math.min(window.devicePixelRatio || 1, 2);
  const width = Math.round(canvas.clientWidth * ratio), height = Math.round(canvas.clientHeight * ratio);
  if (canvas.width !== width || canvas.height !== height) Object.assign(canvas, { width, height });
  const draw = canvas.getContext("2d");
  draw.setTransform(ratio, 0, 0, ratio, 0, 0);
  return [draw, canvas.clientWidth, canvas.clientHeight];
}

let theme = {};
/** Read the colours of the page; again when it turns dark. */
export function readTheme() {
  const style = getComputedStyle(document.documentElement);
  const names = ["ground", "card", "ink", "soft", "line", "blue", "orange", "green", "red", "low", "high", "plus",
    "minus", "solid"];
  theme = Object.fromEntries(names.map(name => [name, style.getPropertyValue(`--${name}`).trim()]));
  return theme;
}
export const colours = () => theme;

const channels = colour => [1, 3, 5].map(at => parseInt(colour.slice(at, at + 2), 16));
const mixed = (one, other, share) => one.map((value, k) => Math.round(value + share * (other[k] - value)));

function dot(draw, x, y, radius, fill, line) {
  draw.beginPath();
  draw.arc(x, y, radius, 0, 2 * Math.PI);
  if (fill) { draw.fillStyle = fill; draw.fill(); }
  if (line) { draw.strokeStyle = line; draw.lineWidth = 2.5; draw.stroke(); }
}

function arrow(draw, x, y, dx, dy, colour) {
  const length = Math.hypot(dx, dy);
  if (length < 2) return;
  const [ux, uy] = [dx / length, dy / length], tip = Math.min(12, 0.5 * length);
  draw.strokeStyle = draw.fillStyle = colour;
  draw.lineWidth = 4;
  draw.beginPath();
  draw.moveTo(x, y);
  draw.lineTo(x + dx - tip * ux, y + dy - tip * uy);
  draw.stroke();
  draw.beginPath();
  draw.moveTo(x + dx, y + dy);
  draw.lineTo(x + dx - tip * ux - 0.5 * tip * uy, y + dy - tip * uy + 0.5 * tip * ux);
  draw.lineTo(x + dx - tip * ux + 0.5 * tip * uy, y + dy - tip * uy - 0.5 * tip * ux);
  draw.fill();
}

function cross(draw, x, y, colour) {
  draw.strokeStyle = colour;
  draw.lineWidth = 2;
  draw.beginPath();
  draw.moveTo(x - 7, y); draw.lineTo(x + 7, y); draw.moveTo(x, y - 7); draw.lineTo(x, y + 7);
  draw.stroke();
}

/** A force as it is drawn: in proportion, but never longer than fits. */
function drawnForce(force) {
  const size = Math.hypot(...force);
  return size === 0 ? 0 : Math.min(ARROW, LONGEST / size);
}

function drawProbe(draw, place, state, up) {
  const { probe, god, hand, force, inside } = state;
  const at = place(probe), held = place(hand);
  draw.strokeStyle = theme.soft;
  draw.lineWidth = 1.5;
  draw.setLineDash([4, 4]);
  draw.beginPath(); draw.moveTo(...at); draw.lineTo(...held); draw.stroke();
  draw.setLineDash([]);
  cross(draw, ...held, theme.soft);
  if (inside && god.every(Number.isFinite)) dot(draw, ...place(god), 5, theme.green, theme.card);
  dot(draw, ...at, 8, theme.card, theme.ink);
  const scale = drawnForce(force);
  arrow(draw, ...at, ...up(force).map(value => value * scale), theme.red);
}

export class Relief {
  constructor(canvas) {
    this.canvas = canvas;
    this.drawn = document.createElement("canvas");
    this.heights = null;
  }

  take(numbers) {
    const [, side, x, y, size] = numbers;
    Object.assign(this, { side, x, y, size, heights: numbers.subarray(5) });
    this.key = "";
  }

  /** Where things stand: a square that is seen from the front and above. */
  frame(width, height) {
    const skew = 0.16 * width, left = 0.03 * width, across = 0.94 * width - skew;
    const rise = 0.1 * height, bottom = 0.97 * height - rise, deep = 0.97 * height - 2.3 * rise;
    return { skew, left, across, bottom, deep, rise };
  }

  place(width, height) {
    const { skew, left, across, bottom, deep } = this.frame(width, height);
    return ([x, y, z]) => {
      const u = (x - this.x) / this.size + 0.5, v = (y - this.y) / this.size + 0.5;
      return [left + u * across + v * skew, bottom - v * deep - z * this.lift];
    };
  }

  /** Return x and y of the point of the plane z = 0 at a pixel. */
  under(px, py) {
    const { skew, left, across, bottom, deep } = this.frame(this.canvas.clientWidth, this.canvas.clientHeight);
    const v = (bottom - py) / deep, u = (px - left - v * skew) / across;
    return [this.x + (u - 0.5) * this.size, this.y + (v - 0.5) * this.size];
  }

  draw(state) {
    const [draw, width, height] = fitted(this.canvas);
    draw.clearRect(0, 0, width, height);
    if (!this.heights) return;
    const key = `${width} ${height} ${theme.low}`;
    if (this.key !== key) this.paint(width, height);
    this.key = key;
    draw.drawImage(this.drawn, 0, 0, width, height);
    if (!state) return;
    // Heights are exaggerated: what is further below than the surface is high stays in the picture.
    const place = this.place(width, height), shown = ([x, y, z]) => place([x, y, Math.max(z, -this.lowest)]);
    drawProbe(draw, shown, state, ([x, y, z]) => [x + 0.2 * y, -z - 0.5 * y]);
  }

  paint(width, height) {
    const { side, heights, size } = this, step = size / (side - 1);
    let most = 1e-9;
    for (const z of heights) most = Math.max(most, Math.abs(z));
    const { rise, across } = this.frame(width, height);
    this.lift = Math.min(rise / most, 40 * across / size);
    this.lowest = 1.6 * most;
    this.exaggeration = this.lift * size / across;
    const ratio = this.canvas.width / width;
    Object.assign(this.drawn, { width: this.canvas.width, height: this.canvas.height });
    const draw = this.drawn.getContext("2d"), place = this.place(width, height);
    draw.scale(ratio, ratio);
    const [low, high] = [channels(theme.low), channels(theme.high)];
    const z = (i, j) => heights[j * side + i];
    const point = (i, j) => place([this.x + (i / (side - 1) - 0.5) * size, this.y + (j / (side - 1) - 0.5) * size, z(i, j)]);
    for (let j = side - 2; j >= 0; j--) {
      for (let i = 0; i < side - 1; i++) {
        const sx = (z(i + 1, j) - z(i, j)) / step * this.exaggeration, sy = (z(i, j + 1) - z(i, j)) / step * this.exaggeration;
        const shade = (0.55 * -sx + 0.25 * -sy + 0.8) / Math.hypot(sx, sy, 1) / 1.02;
        draw.fillStyle = draw.strokeStyle = `rgb(${mixed(low, high, Math.min(1, Math.max(0, shade)))})`;
        draw.lineWidth = 0.7;
        draw.beginPath();
        draw.moveTo(...point(i, j)); draw.lineTo(...point(i + 1, j));
        draw.lineTo(...point(i + 1, j + 1)); draw.lineTo(...point(i, j + 1));
        draw.closePath(); draw.fill(); draw.stroke();
      }
    }
  }
}

export class Cut {
  constructor(canvas) {
    this.canvas = canvas;
    this.field = document.createElement("canvas");
    this.still = document.createElement("canvas"); // all but probe, hand and force
    this.box = null;
  }

  take(numbers) {
    const [, line, across, deep, y, left, right, bottom, top] = numbers;
    const after = 9, cells = across * deep;
    const part = (from, count) => numbers.subarray(from, from + count);
    Object.assign(this, {
      y, across, deep, box: [left, right, bottom, top], heights: part(after, line),
      fx: part(after + line, cells), fz: part(after + line + cells, cells),
      curl: part(after + line + 2 * cells, cells), key: "",
    });
    this.most = this.curl.reduce((most, value) => Math.max(most, Math.abs(value)), 0);
    this.strongest = this.fx.reduce((most, value, k) => Math.max(most, Math.hypot(value, this.fz[k])), 0);
  }

  /** Return x and z at a pixel, of the box that is wanted. */
  under(px, py, [left, right, bottom, top]) {
    const share = py / this.canvas.clientHeight;
    return [left + px / this.canvas.clientWidth * (right - left), top - share * (top - bottom)];
  }

  draw(state, wanted) {
    const [draw, width, height] = fitted(this.canvas), [left, right, bottom, top] = wanted;
    const place = ([x, , z]) => [(x - left) / (right - left) * width, (top - z) / (top - bottom) * height];
    const key = [width, height, theme.plus, ...wanted].join();
    if (this.key !== key) this.paintStill(width, height, place, right - left);
    this.key = key;
    draw.drawImage(this.still, 0, 0, width, height);
    if (state) drawProbe(draw, place, state, ([x, , z]) => [x, -z]);
  }

  paintStill(width, height, place, span) {
    Object.assign(this.still, { width: this.canvas.width, height: this.canvas.height });
    const draw = this.still.getContext("2d");
    draw.scale(this.canvas.width / width, this.canvas.width / width);
    draw.fillStyle = theme.ground;
    draw.fillRect(0, 0, width, height);
    if (this.box) this.drawField(draw, place);
    this.drawScale(draw, width, height, span);
  }

  drawField(draw, place) {
    this.paintField();
    const [left, right, bottom, top] = this.box, count = this.heights.length;
    const [x0, y0] = place([left, 0, top]), [x1, y1] = place([right, 0, bottom]);
    const outline = () => {
      draw.beginPath();
      this.heights.forEach((z, k) => draw.lineTo(...place([left + k / (count - 1) * (right - left), 0, z])));
    };
    draw.save();
    outline();
    draw.lineTo(x1, y1); draw.lineTo(x0, y1); draw.closePath();
    draw.fillStyle = theme.solid;
    draw.fill();
    draw.restore();
    draw.imageSmoothingEnabled = true;
    draw.globalAlpha = 0.75;
    draw.drawImage(this.field, x0, y0, x1 - x0, y1 - y0);
    draw.globalAlpha = 1;
    this.drawArrows(draw, place);
    outline();
    draw.strokeStyle = theme.ink;
    draw.lineWidth = 2;
    draw.stroke();
  }

  drawArrows(draw, place) {
    if (this.strongest < 1e-6) return;
    const [left, right, bottom, top] = this.box, scale = 16 / this.strongest;
    draw.strokeStyle = theme.blue;
    draw.globalAlpha = 0.65;
    draw.lineWidth = 1.2;
    draw.beginPath();
    for (let j = 1; j < this.deep; j += 3) {
      for (let i = 1; i < this.across; i += 3) {
        const k = j * this.across + i, dx = this.fx[k] * scale, dy = -this.fz[k] * scale;
        if (Math.hypot(dx, dy) < 0.7) continue;
        const [x, y] = place([left + i / (this.across - 1) * (right - left), 0, bottom + j / (this.deep - 1) * (top - bottom)]);
        draw.moveTo(x, y); draw.lineTo(x + dx, y + dy);
        draw.moveTo(x + 1.5, y); draw.arc(x, y, 1.5, 0, 6.3);
      }
    }
    draw.stroke();
    draw.globalAlpha = 1;
  }

  paintField() {
    Object.assign(this.field, { width: this.across, height: this.deep });
    const draw = this.field.getContext("2d"), image = draw.createImageData(this.across, this.deep);
    const [plus, minus] = [channels(theme.plus), channels(theme.minus)];
    this.curl.forEach((curl, k) => {
      const row = this.deep - 1 - Math.floor(k / this.across), at = 4 * (row * this.across + k % this.across);
      const share = this.most > 1e-6 * this.strongest ? Math.min(1, 2 * Math.abs(curl) / this.most) : 0;
      image.data.set([...(curl > 0 ? plus : minus), 215 * share], at);
    });
    draw.putImageData(image, 0, 0);
  }

  drawScale(draw, width, height, span) {
    const step = roundStep(span, 6), length = step / span * width;
    draw.strokeStyle = draw.fillStyle = theme.ink;
    draw.lineWidth = 2;
    draw.beginPath();
    draw.moveTo(12, height - 12); draw.lineTo(12 + length, height - 12);
    draw.stroke();
    draw.font = "12px system-ui, sans-serif";
    draw.fillText(quantity(step, "m"), 14, height - 18);
  }
}

export const isRelief = numbers => numbers[0] === RELIEF;
