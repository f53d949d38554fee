// Probe, hand and force: a small picture over a large one, which need not be drawn anew when they move.

import { colours } from "./canvas.js";

const ARROW = 250; // pixels per newton, as long as that fits
const LONGEST = 130, SHARE = 0.45; // pixels, and of what is there to the side and in height
const EDGE = 12; // pixels around what is drawn
const STEP = 64; // pixels by which the picture grows: another size takes another memory

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
function drawnForce(force, up, { width, height }) {
  const longest = Math.min(LONGEST, SHARE * Math.min(width, height));
  const size = Math.hypot(...force), scale = size === 0 ? 0 : Math.min(ARROW, longest / size);
  return up(force).map(value => value * scale);
}

/** Return where a stretch of some parts begins, and how long it is; within 0 and most, in whole steps. */
function stretch(parts, most) {
  const first = Math.floor(Math.max(0, Math.min(...parts) - EDGE)), last = Math.min(most, Math.max(...parts) + EDGE);
  const long = Math.min(Math.ceil(most), STEP * Math.ceil((last - first) / STEP));
  return [Math.min(first, Math.ceil(most) - long), long];
}

export class Marker {
  /** @param sheet what it lies on */
  constructor(sheet) {
    this.sheet = sheet;
    this.canvas = Object.assign(document.createElement("canvas"), { className: "marker" });
    this.canvas.ariaHidden = "true";
    this.draw = this.canvas.getContext("2d");
    this.left = this.top = this.width = this.height = 0;
    sheet.canvas.after(this.canvas);
  }

  /** Draw a state where `place` says, with the force in the direction of the picture that `up` says. */
  show(place, { probe, god, hand, force, inside }, up) {
    const theme = colours(), at = place(probe), arm = drawnForce(force, up, this.sheet), known = point => point.every(Number.isFinite);
    const held = known(hand) && place(hand), near = inside && known(god) && place(god);
    const parts = [at, at.map((value, k) => value + arm[k]), held, near].filter(Boolean);
    const { draw } = this;
    if (!this.fit(parts)) return;
    draw.strokeStyle = theme.soft;
    draw.lineWidth = 1.5;
    draw.setLineDash([4, 4]);
    if (held) { draw.beginPath(); draw.moveTo(...at); draw.lineTo(...held); draw.stroke(); }
    draw.setLineDash([]);
    if (held) cross(draw, ...held, theme.soft);
    if (near) dot(draw, ...near, 5, theme.green, theme.card);
    dot(draw, ...at, 8, theme.card, theme.ink);
    arrow(draw, ...at, ...arm, theme.red);
  }

  /** Lie, cleared, over some points as far as they are in the picture; whether any is. */
  fit(parts) {
    const { sheet, canvas } = this, { ratio, unit } = sheet;
    const [left, width] = stretch(parts.map(([x]) => x), sheet.width), [top, height] = stretch(parts.map(([, y]) => y), sheet.height);
    const there = width > 0 && height > 0;
    canvas.hidden = !there;
    if (!there) return false;
    if (this.width !== width || this.height !== height || this.ratio !== ratio) {
      Object.assign(this, { width, height, ratio });
      Object.assign(canvas, { width: Math.round(width * ratio), height: Math.round(height * ratio) });
      Object.assign(canvas.style, { width: `${width * unit}px`, height: `${height * unit}px` });
    }
    Object.assign(this, { left, top });
    canvas.style.transform = `translate(${sheet.left + left * unit}px, ${sheet.top + top * unit}px)`;
    this.draw.setTransform(ratio, 0, 0, ratio, -left * ratio, -top * ratio);
    this.draw.clearRect(left, top, width, height);
    return true;
  }

  /** Draw it into another picture of what it lies on. */
  copy(draw, left, top) {
    if (!this.canvas.hidden && this.width) draw.drawImage(this.canvas, left + this.left * this.ratio, top + this.top * this.ratio);
  }
}
