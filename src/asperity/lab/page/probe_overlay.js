// Overlay with probe, hand and force: a small canvas above a view, so that the view need not be repainted when they move.

import { colours } from "./canvas.js";

const FORCE_SCALE = 250; // pixels per newton, reduced for an arrow that is too long
const MAX_ARROW = 130, MAX_ARROW_FRACTION = 0.45; // pixels, and fraction of the view
const MARGIN = 12; // pixels around the drawing
const SIZE_STEP = 64; // pixels: the size is rounded up, because each new size allocates memory

function drawDot(context, x, y, radius, fill, outline) {
  context.beginPath();
  context.arc(x, y, radius, 0, 2 * Math.PI);
  if (fill) { context.fillStyle = fill; context.fill(); }
  if (outline) { context.strokeStyle = outline; context.lineWidth = 2.5; context.stroke(); }
}

function drawArrow(context, x, y, dx, dy, colour) {
  const length = Math.hypot(dx, dy);
  if (length < 2) return;
  const [ux, uy] = [dx / length, dy / length], head = Math.min(12, 0.5 * length);
  context.strokeStyle = context.fillStyle = colour;
  context.lineWidth = 4;
  context.beginPath();
  context.moveTo(x, y);
  context.lineTo(x + dx - head * ux, y + dy - head * uy);
  context.stroke();
  context.beginPath();
  context.moveTo(x + dx, y + dy);
  context.lineTo(x + dx - head * ux - 0.5 * head * uy, y + dy - head * uy + 0.5 * head * ux);
  context.lineTo(x + dx - head * ux + 0.5 * head * uy, y + dy - head * uy - 0.5 * head * ux);
  context.fill();
}

function drawCross(context, x, y, colour) {
  context.strokeStyle = colour;
  context.lineWidth = 2;
  context.beginPath();
  context.moveTo(x - 7, y); context.lineTo(x + 7, y); context.moveTo(x, y - 7); context.lineTo(x, y + 7);
  context.stroke();
}

/** Draw the anchor of friction: a square, with the spring to the probe. */
function drawAnchor(context, position, [x, y], colour) {
  context.strokeStyle = context.fillStyle = colour;
  context.lineWidth = 3;
  context.beginPath(); context.moveTo(...position); context.lineTo(x, y); context.stroke();
  context.fillRect(x - 5, y - 5, 10, 10);
}

/** Return the arrow of a force in pixels: proportional to the force, but limited in length. */
function forceArrow(force, projectVector, { width, height }) {
  const limit = Math.min(MAX_ARROW, MAX_ARROW_FRACTION * Math.min(width, height));
  const size = Math.hypot(...force), scale = size === 0 ? 0 : Math.min(FORCE_SCALE, limit / size);
  return projectVector(force).map(value => value * scale);
}

/** Return start and length of an interval that contains coordinates with a margin, within 0 and a limit. */
function enclosingInterval(coordinates, limit) {
  const start = Math.floor(Math.max(0, Math.min(...coordinates) - MARGIN)), end = Math.min(limit, Math.max(...coordinates) + MARGIN);
  const length = Math.min(Math.ceil(limit), SIZE_STEP * Math.ceil((end - start) / SIZE_STEP));
  return [Math.min(start, Math.ceil(limit) - length), length];
}

/** Return the probe of a frame, for the views; the anchor of friction, null without friction. */
export function probeStateOf(frame, columns, energy, friction = null) {
  const value = name => frame.newest[columns[name]];
  return {
    probe: [value("x"), value("y"), value("z")], closest: frame.closest, hand: frame.hand,
    force: [value("applied x"), value("applied y"), value("applied z")], isInside: value("inside") > 0, energy,
    anchor: friction && value("inside") > 0 ? [value("law anchor x"), value("law anchor y"), value("law anchor z") || value("z")] : null,
  };
}

export class ProbeOverlay {
  /** @param base scaled canvas of the view */
  constructor(base) {
    this.base = base;
    this.element = Object.assign(document.createElement("canvas"), { className: "overlay" });
    this.element.ariaHidden = "true";
    this.context = this.element.getContext("2d");
    this.left = this.top = this.width = this.height = 0;
    base.element.after(this.element);
  }

  /**
   * Draw the probe with its hand, closest point and force.
   * @param project maps a point to pixels of the view
   * @param projectVector maps a direction to the view
   */
  draw(project, { probe, closest, hand, force, isInside, anchor }, projectVector) {
    const theme = colours(), { context } = this, isKnown = point => point.every(Number.isFinite);
    const position = project(probe), arrow = forceArrow(force, projectVector, this.base);
    const handPosition = isKnown(hand) && project(hand), closestPosition = isInside && isKnown(closest) && project(closest);
    const anchorPosition = anchor && project(anchor);
    const arrowTip = position.map((value, k) => value + arrow[k]);
    if (!this.fitTo([position, arrowTip, handPosition, closestPosition, anchorPosition].filter(Boolean))) return;
    context.strokeStyle = theme.soft;
    context.lineWidth = 1.5;
    context.setLineDash([4, 4]);
    if (handPosition) { context.beginPath(); context.moveTo(...position); context.lineTo(...handPosition); context.stroke(); }
    context.setLineDash([]);
    if (handPosition) drawCross(context, ...handPosition, theme.soft);
    if (closestPosition) drawDot(context, ...closestPosition, 5, theme.green, theme.card);
    if (anchorPosition) drawAnchor(context, position, anchorPosition, theme.orange);
    drawDot(context, ...position, 8, theme.card, theme.ink);
    drawArrow(context, ...position, ...arrow, theme.red);
  }

  /** Clear the overlay and move it over points; return whether any part of it is within the view. */
  fitTo(points) {
    const { base, element } = this, { pixelRatio, unit } = base;
    const [left, width] = enclosingInterval(points.map(([x]) => x), base.width);
    const [top, height] = enclosingInterval(points.map(([, y]) => y), base.height);
    const isVisible = width > 0 && height > 0;
    element.hidden = !isVisible;
    if (!isVisible) return false;
    if (this.width !== width || this.height !== height || this.pixelRatio !== pixelRatio) {
      Object.assign(this, { width, height, pixelRatio });
      Object.assign(element, { width: Math.round(width * pixelRatio), height: Math.round(height * pixelRatio) });
      Object.assign(element.style, { width: `${width * unit}px`, height: `${height * unit}px` });
    }
    Object.assign(this, { left, top });
    element.style.transform = `translate(${base.left + left * unit}px, ${base.top + top * unit}px)`;
    this.context.setTransform(pixelRatio, 0, 0, pixelRatio, -left * pixelRatio, -top * pixelRatio);
    this.context.clearRect(left, top, width, height);
    return true;
  }

  /** Draw the overlay onto a copy of its view. */
  drawOnto(context, left, top) {
    if (!this.element.hidden && this.width) context.drawImage(this.element, left + this.left * this.pixelRatio, top + this.top * this.pixelRatio);
  }
}
