// Views of the surface: the relief, and the section below the probe with the force field and its curl.

import { ProbeOverlay } from "./probe_overlay.js";
import { projectionGeometry, renderRelief } from "./relief_renderer.js";
import { ScaledCanvas, colours, toRgb } from "./canvas.js";
import { formatQuantity, roundStep } from "./format.js";

const RELIEF = 2, BESIDE_SECTION = 4; // first numbers of a picture of the relief, and of the section of the second lane
const SECTION_HEADER = 9; // numbers before the heights of a section
const ARROW_LENGTH = 16; // of the greatest force [px]
const MAX_LIFT = 40; // greatest exaggeration of heights
const CURL_TOLERANCE = 1e-6; // relative to the greatest force of a section

export class ReliefView {
  kind = "relief";

  constructor(element) {
    this.scaledCanvas = new ScaledCanvas(element);
    this.overlay = new ProbeOverlay(this.scaledCanvas);
    this.image = document.createElement("canvas");
    this.heights = null;
  }

  setPicture(numbers) {
    const [, side, x, y, size] = numbers;
    Object.assign(this, { side, x, y, size, heights: numbers.subarray(5) });
    this.paintKey = "";
  }

  /** Return a function that maps a point to pixels of a view of some size. */
  projection(width, height) {
    const { skew, left, across, bottom, depth } = projectionGeometry(width, height);
    return ([x, y, z]) => {
      const u = (x - this.x) / this.size + 0.5, v = (y - this.y) / this.size + 0.5;
      return [left + u * across + v * skew, bottom - v * depth - z * this.lift];
    };
  }

  /** Return x and y of the point of the plane z = 0 at a pixel of the page. */
  pointAt(px, py) {
    const { width, height, unit } = this.scaledCanvas;
    const { skew, left, across, bottom, depth } = projectionGeometry(width, height);
    const v = (bottom - py / unit) / depth, u = (px / unit - left - v * skew) / across;
    return [this.x + (u - 0.5) * this.size, this.y + (v - 0.5) * this.size];
  }

  /** Draw the probe, and the relief if it has changed. */
  draw(probeState) {
    if (!this.heights) return;
    const { width, height, needsRepaint } = this.scaledCanvas;
    if (needsRepaint || this.paintKey !== colours().low) this.paint();
    if (!probeState) return;
    // Heights are exaggerated, so a low point would be outside the view.
    const project = this.projection(width, height), projectVisible = ([x, y, z]) => project([x, y, Math.max(z, -this.maxDepth)]);
    this.overlay.draw(projectVisible, probeState, ([x, y, z]) => [x + 0.2 * y, -z - 0.5 * y]);
  }

  paint() {
    const [context, width, height] = this.scaledCanvas.clear();
    this.paintKey = colours().low;
    const maxHeight = this.heights.reduce((maximum, z) => Math.max(maximum, Math.abs(z)), 1e-9);
    const { maxRise, across } = projectionGeometry(width, height);
    this.lift = Math.min(maxRise / maxHeight, MAX_LIFT * across / this.size);
    this.maxDepth = 1.6 * maxHeight;
    this.exaggeration = this.lift * this.size / across;
    renderRelief(this.image, this, width, height);
    context.drawImage(this.image, 0, 0, width, height);
  }
}

export class SectionView {
  kind = "section";

  constructor(element) {
    this.scaledCanvas = new ScaledCanvas(element);
    this.overlay = new ProbeOverlay(this.scaledCanvas);
    this.curlImage = document.createElement("canvas");
    this.box = null; // of the picture: left, right, bottom, top [m]
    this.label = ""; // of the lane, if there are two
  }

  setPicture(numbers) {
    const [, points, columns, rows, y, ...box] = numbers.subarray(0, SECTION_HEADER);
    const fieldStart = SECTION_HEADER + points, cells = columns * rows;
    const part = (start, count) => numbers.subarray(start, start + count);
    Object.assign(this, {
      y, columns, rows, box, heights: part(SECTION_HEADER, points),
      fx: part(fieldStart, cells), fz: part(fieldStart + cells, cells),
      curl: part(fieldStart + 2 * cells, cells), paintKey: "",
    });
    this.maxCurl = this.curl.reduce((maximum, value) => Math.max(maximum, Math.abs(value)), 0);
    this.maxForce = this.fx.reduce((maximum, value, k) => Math.max(maximum, Math.hypot(value, this.fz[k])), 0);
  }

  get hasCurl() { return this.maxCurl > CURL_TOLERANCE * (this.maxForce ?? 1); }

  /** Whether the picture contains a box. */
  covers([left, right, bottom, top]) {
    const { box } = this, margin = 1e-9;
    return Boolean(box) && box[0] <= left + margin && box[1] >= right - margin && box[2] <= bottom + margin && box[3] >= top - margin;
  }

  /** Return x and z at a pixel of the page, for the box shown. */
  pointAt(px, py, [left, right, bottom, top]) {
    const { width, height, unit } = this.scaledCanvas;
    return [left + px / unit / width * (right - left), top - py / unit / height * (top - bottom)];
  }

  /** Draw the probe, and the section if it or the box shown has changed. */
  draw(probeState, shownBox) {
    const { width, height, needsRepaint } = this.scaledCanvas, [left, right, bottom, top] = shownBox;
    const project = ([x, , z]) => [(x - left) / (right - left) * width, (top - z) / (top - bottom) * height];
    const paintKey = [this.label, colours().plus, ...shownBox].join();
    if (needsRepaint || this.paintKey !== paintKey) this.paint(project, shownBox);
    this.paintKey = paintKey;
    if (probeState) this.overlay.draw(project, probeState, ([x, , z]) => [x, -z]);
  }

  paint(project, shownBox) {
    const [context, width, height] = this.scaledCanvas.clear(), span = shownBox[1] - shownBox[0];
    context.fillStyle = colours().ground;
    context.fillRect(0, 0, width, height);
    if (this.box) this.drawSection(context, project);
    this.drawScaleBar(context, width, height, span);
    if (!this.covers(shownBox)) context.fillText("computing …", 12, this.label ? 42 : 22); // what is blank
    context.font = "bold 15px system-ui, sans-serif";
    if (this.label) context.fillText(this.label, 12, 22);
  }

  drawSection(context, project) {
    this.paintCurl();
    const [left, right, bottom, top] = this.box, count = this.heights.length;
    const [x0, y0] = project([left, 0, top]), [x1, y1] = project([right, 0, bottom]);
    const traceProfile = () => {
      context.beginPath();
      this.heights.forEach((z, k) => context.lineTo(...project([left + k / (count - 1) * (right - left), 0, z])));
    };
    context.save();
    traceProfile();
    context.lineTo(x1, y1); context.lineTo(x0, y1); context.closePath();
    context.fillStyle = colours().solid;
    context.fill();
    context.restore();
    context.imageSmoothingEnabled = true;
    context.globalAlpha = 0.75;
    context.drawImage(this.curlImage, x0, y0, x1 - x0, y1 - y0);
    context.globalAlpha = 1;
    this.drawForces(context, project);
    traceProfile();
    context.strokeStyle = colours().ink;
    context.lineWidth = 2;
    context.stroke();
  }

  /** Draw the force field as arrows, at every third grid point. */
  drawForces(context, project) {
    if (this.maxForce < 1e-6) return;
    const [left, right, bottom, top] = this.box, scale = ARROW_LENGTH / this.maxForce;
    context.strokeStyle = colours().blue;
    context.globalAlpha = 0.65;
    context.lineWidth = 1.2;
    context.beginPath();
    for (let j = 1; j < this.rows; j += 3) {
      for (let i = 1; i < this.columns; i += 3) {
        const k = j * this.columns + i, dx = this.fx[k] * scale, dy = -this.fz[k] * scale;
        if (Math.hypot(dx, dy) < 0.7) continue;
        const [x, y] = project([left + i / (this.columns - 1) * (right - left), 0, bottom + j / (this.rows - 1) * (top - bottom)]);
        context.moveTo(x, y); context.lineTo(x + dx, y + dy);
        context.moveTo(x + 1.5, y); context.arc(x, y, 1.5, 0, 6.3);
      }
    }
    context.stroke();
    context.globalAlpha = 1;
  }

  /** Paint the curl as an image of one pixel for each grid point: colour by sign, opacity by magnitude. */
  paintCurl() {
    Object.assign(this.curlImage, { width: this.columns, height: this.rows });
    const context = this.curlImage.getContext("2d"), image = context.createImageData(this.columns, this.rows);
    const [positive, negative] = [toRgb(colours().plus), toRgb(colours().minus)], { hasCurl } = this;
    this.curl.forEach((curl, k) => {
      const row = this.rows - 1 - Math.floor(k / this.columns), offset = 4 * (row * this.columns + k % this.columns);
      const opacity = hasCurl ? Math.min(1, 2 * Math.abs(curl) / this.maxCurl) : 0;
      image.data.set([...(curl > 0 ? positive : negative), 215 * opacity], offset);
    });
    context.putImageData(image, 0, 0);
  }

  drawScaleBar(context, width, height, span) {
    const step = roundStep(span, 6), length = step / span * width;
    context.strokeStyle = context.fillStyle = colours().ink;
    context.lineWidth = 2;
    context.beginPath();
    context.moveTo(12, height - 12); context.lineTo(12 + length, height - 12);
    context.stroke();
    context.font = "12px system-ui, sans-serif";
    context.fillText(formatQuantity(step, "m"), 14, height - 18);
  }
}

/** Return the law of the picture of a view; without a picture, the law that it will be of. */
export const pictureLabel = ({ settings }, law) => `law ${settings?.law ?? law}`;
export const isRelief = numbers => numbers[0] === RELIEF;
export const isBeside = numbers => numbers[0] === BESIDE_SECTION;
