// The surface in relief, and a cut under the probe with field and curl behind it.

import { Marker } from "./probe_overlay.js";
import { corners, paintRelief } from "./relief_renderer.js";
import { Sheet, channels, colours } from "./canvas.js";
import { quantity, roundStep } from "./format.js";

const RELIEF = 2;

export class Relief {
  name = "relief";

  constructor(canvas) {
    this.sheet = new Sheet(canvas);
    this.marker = new Marker(this.sheet);
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

  /** Return x and y of the point of the plane z = 0 at a pixel of the page. */
  under(px, py) {
    const { width, height, unit } = this.sheet, { skew, left, across, bottom, deep } = corners(width, height);
    const v = (bottom - py / unit) / deep, u = (px / unit - left - v * skew) / across;
    return [this.x + (u - 0.5) * this.size, this.y + (v - 0.5) * this.size];
  }

  draw(state) {
    if (!this.heights) return;
    const { width, height } = this.sheet;
    if (this.sheet.blank || this.key !== colours().low) this.paint();
    if (!state) return;
    // Heights are exaggerated: what is further below than the surface is high stays in the picture.
    const place = this.place(width, height), shown = ([x, y, z]) => place([x, y, Math.max(z, -this.lowest)]);
    this.marker.show(shown, state, ([x, y, z]) => [x + 0.2 * y, -z - 0.5 * y]);
  }

  paint() {
    const [draw, width, height] = this.sheet.cleared();
    this.key = colours().low;
    const most = this.heights.reduce((most, z) => Math.max(most, Math.abs(z)), 1e-9);
    const { rise, across } = corners(width, height);
    this.lift = Math.min(rise / most, 40 * across / this.size);
    this.lowest = 1.6 * most;
    this.exaggeration = this.lift * this.size / across;
    paintRelief(this.drawn, this, width, height);
    draw.drawImage(this.drawn, 0, 0, width, height);
  }
}

export class Cut {
  name = "cut";

  constructor(canvas) {
    this.sheet = new Sheet(canvas);
    this.marker = new Marker(this.sheet);
    this.field = document.createElement("canvas");
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

  /** Return x and z at a pixel of the page, of the box that is wanted. */
  under(px, py, [left, right, bottom, top]) {
    const { width, height, unit } = this.sheet;
    return [left + px / unit / width * (right - left), top - py / unit / height * (top - bottom)];
  }

  draw(state, wanted) {
    const { width, height } = this.sheet, [left, right, bottom, top] = wanted;
    const place = ([x, , z]) => [(x - left) / (right - left) * width, (top - z) / (top - bottom) * height];
    const key = [colours().plus, ...wanted].join();
    if (this.sheet.blank || this.key !== key) this.paint(place, right - left);
    this.key = key;
    if (state) this.marker.show(place, state, ([x, , z]) => [x, -z]);
  }

  paint(place, span) {
    const [draw, width, height] = this.sheet.cleared();
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
