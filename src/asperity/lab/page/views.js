// The surface in relief, and a cut under the probe with field and curl behind it.

import { corners, paintRelief } from "./relief.js";
import { Sheet, channels, colours } from "./sheet.js";
import { quantity, roundStep } from "./words.js";

const RELIEF = 2;
const ARROW = 250; // pixels per newton, as long as that fits
const LONGEST = 130; // pixels

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
  const theme = colours();
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
  name = "relief";

  constructor(canvas) {
    this.sheet = new Sheet(canvas);
    this.drawn = document.createElement("canvas");
    this.heights = null;
  }

  take(numbers) {
    const [, side, x, y, size] = numbers;
    Object.assign(this, { side, x, y, size, heights: numbers.subarray(5) });
    this.key = "";
  }

  place(width, height) {
    const { skew, left, across, bottom, deep } = corners(width, height);
    return ([x, y, z]) => {
      const u = (x - this.x) / this.size + 0.5, v = (y - this.y) / this.size + 0.5;
      return [left + u * across + v * skew, bottom - v * deep - z * this.lift];
    };
  }

  /** Return x and y of the point of the plane z = 0 at a pixel. */
  under(px, py) {
    const { skew, left, across, bottom, deep } = corners(this.sheet.width, this.sheet.height);
    const v = (bottom - py) / deep, u = (px - left - v * skew) / across;
    return [this.x + (u - 0.5) * this.size, this.y + (v - 0.5) * this.size];
  }

  draw(state) {
    const [draw, width, height] = this.sheet.cleared();
    if (!this.heights) return;
    const key = `${width} ${height} ${colours().low}`;
    if (this.key !== key) this.paint(width, height);
    this.key = key;
    draw.drawImage(this.drawn, 0, 0, width, height);
    if (!state) return;
    // Heights are exaggerated: what is further below than the surface is high stays in the picture.
    const place = this.place(width, height), shown = ([x, y, z]) => place([x, y, Math.max(z, -this.lowest)]);
    drawProbe(draw, shown, state, ([x, y, z]) => [x + 0.2 * y, -z - 0.5 * y]);
  }

  paint(width, height) {
    const most = this.heights.reduce((most, z) => Math.max(most, Math.abs(z)), 1e-9);
    const { rise, across } = corners(width, height);
    this.lift = Math.min(rise / most, 40 * across / this.size);
    this.lowest = 1.6 * most;
    this.exaggeration = this.lift * this.size / across;
    paintRelief(this.drawn, this, width, height);
  }
}

export class Cut {
  name = "cut";

  constructor(canvas) {
    this.sheet = new Sheet(canvas);
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
    const { width, height } = this.sheet;
    return [left + px / width * (right - left), top - py / height * (top - bottom)];
  }

  draw(state, wanted) {
    const [draw, width, height] = this.sheet.cleared(), [left, right, bottom, top] = wanted;
    const place = ([x, , z]) => [(x - left) / (right - left) * width, (top - z) / (top - bottom) * height];
    const key = [width, height, colours().plus, ...wanted].join();
    if (this.key !== key) this.paintStill(width, height, place, right - left);
    this.key = key;
    draw.drawImage(this.still, 0, 0, width, height);
    if (state) drawProbe(draw, place, state, ([x, , z]) => [x, -z]);
  }

  paintStill(width, height, place, span) {
    const { canvas, ratio } = this.sheet;
    Object.assign(this.still, { width: canvas.width, height: canvas.height });
    const draw = this.still.getContext("2d");
    draw.scale(ratio, ratio);
    draw.fillStyle = colours().ground;
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
    draw.fillStyle = colours().solid;
    draw.fill();
    draw.restore();
    draw.imageSmoothingEnabled = true;
    draw.globalAlpha = 0.75;
    draw.drawImage(this.field, x0, y0, x1 - x0, y1 - y0);
    draw.globalAlpha = 1;
    this.drawArrows(draw, place);
    outline();
    draw.strokeStyle = colours().ink;
    draw.lineWidth = 2;
    draw.stroke();
  }

  drawArrows(draw, place) {
    if (this.strongest < 1e-6) return;
    const [left, right, bottom, top] = this.box, scale = 16 / this.strongest;
    draw.strokeStyle = colours().blue;
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
    const [plus, minus] = [channels(colours().plus), channels(colours().minus)];
    this.curl.forEach((curl, k) => {
      const row = this.deep - 1 - Math.floor(k / this.across), at = 4 * (row * this.across + k % this.across);
      const share = this.most > 1e-6 * this.strongest ? Math.min(1, 2 * Math.abs(curl) / this.most) : 0;
      image.data.set([...(curl > 0 ? plus : minus), 215 * share], at);
    });
    draw.putImageData(image, 0, 0);
  }

  drawScale(draw, width, height, span) {
    const step = roundStep(span, 6), length = step / span * width;
    draw.strokeStyle = draw.fillStyle = colours().ink;
    draw.lineWidth = 2;
    draw.beginPath();
    draw.moveTo(12, height - 12); draw.lineTo(12 + length, height - 12);
    draw.stroke();
    draw.font = "12px system-ui, sans-serif";
    draw.fillText(quantity(step, "m"), 14, height - 18);
  }
}

export const isRelief = numbers => numbers[0] === RELIEF;
