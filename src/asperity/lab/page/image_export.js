// Export of the views as PNG, or as SVG with vector lines, arrows and text.

import { readTheme } from "./canvas.js";

const SVG_NAMESPACE = document.createRange().createContextualFragment("<svg/>").firstChild.namespaceURI;
const GAP = 8; // pixels between two views
const textMeasure = document.createElement("canvas").getContext("2d");
const round = value => Number(value.toFixed(2));
const escape = text => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll('"', "&quot;");

/** The part of CanvasRenderingContext2D that the views use, writing SVG elements. */
class SvgContext {
  globalAlpha = 1;
  lineWidth = 1;
  fillStyle = "#000";
  strokeStyle = "#000";
  font = "12px system-ui, sans-serif";

  constructor() { this.elements = []; this.path = []; this.dashes = []; }

  addElement(name, attributes, content = "") {
    const opacity = this.globalAlpha < 1 ? { opacity: this.globalAlpha } : {};
    const text = Object.entries({ ...attributes, ...opacity }).map(([key, value]) => ` ${key}="${escape(String(value))}"`).join("");
    this.elements.push(content ? `<${name}${text}>${escape(content)}</${name}>` : `<${name}${text}/>`);
  }

  beginPath() { this.path = []; }
  moveTo(x, y) { this.path.push(`M${round(x)} ${round(y)}`); }
  lineTo(x, y) { this.path.push(`${this.path.length ? "L" : "M"}${round(x)} ${round(y)}`); }
  closePath() { this.path.push("Z"); }

  /** Add a whole circle: the views draw no other arcs. */
  arc(x, y, radius) {
    const [left, right, r] = [x - radius, x + radius, radius].map(round);
    this.path.push(`M${right} ${round(y)}A${r} ${r} 0 1 0 ${left} ${round(y)}A${r} ${r} 0 1 0 ${right} ${round(y)}`);
  }

  stroke() {
    const dashes = this.dashes.length ? { "stroke-dasharray": this.dashes.join(" ") } : {};
    this.addElement("path", { d: this.path.join(""), fill: "none", stroke: this.strokeStyle, "stroke-width": this.lineWidth, ...dashes });
  }

  fill() { this.addElement("path", { d: this.path.join(""), fill: this.fillStyle }); }
  setLineDash(dashes) { this.dashes = dashes; }
  save() {}
  restore() {}

  fillRect(x, y, width, height) {
    this.addElement("rect", { x: round(x), y: round(y), width: round(width), height: round(height), fill: this.fillStyle });
  }

  fillText(text, x, y) {
    this.addElement("text", { x: round(x), y: round(y), fill: this.fillStyle, style: `font: ${this.font}` }, text);
  }

  measureText(text) { textMeasure.font = this.font; return textMeasure.measureText(text); }

  /** Embed a raster image: the relief, and the colours of the curl. */
  drawImage(canvas, x, y, width, height) {
    this.addElement("image", { x: round(x), y: round(y), width: round(width), height: round(height), preserveAspectRatio: "none", href: canvas.toDataURL() });
  }
}

/** Return views, each with the function that draws it, as one SVG below each other. */
export function toSvg(views) {
  const parts = [], sizes = views.map(([{ scaledCanvas }]) => [scaledCanvas.width, scaledCanvas.height]);
  let top = 0;
  views.forEach(([view, draw], k) => {
    const [width, height] = sizes[k];
    const elements = recordDrawing(view, draw, width, height);
    parts.push(`<svg y="${round(top)}" width="${round(width)}" height="${round(height)}">${elements.join("")}</svg>`);
    top += height + GAP;
  });
  const width = round(Math.max(...sizes.map(([viewWidth]) => viewWidth))), height = round(top - GAP);
  return `<svg xmlns="${SVG_NAMESPACE}" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}">`
    + `<rect width="100%" height="100%" fill="${readTheme().card}"/>${parts.join("")}</svg>`;
}

/** Draw a view and its overlay into an SVG context in place of their canvases; return the elements. */
function recordDrawing(view, draw, width, height) {
  const context = new SvgContext(), { scaledCanvas, overlay } = view, { element, pixelRatio } = scaledCanvas;
  view.scaledCanvas = { element, pixelRatio, width, height, needsRepaint: true, clear: () => [context, width, height] };
  if (overlay) view.overlay = Object.assign(Object.create(overlay), { context, fitTo: () => true });
  try { draw(); } finally { Object.assign(view, overlay ? { scaledCanvas, overlay } : { scaledCanvas }); }
  return context.elements;
}

/** Return a promise of the views as one PNG below each other. */
export function toPng(views) {
  const canvases = views.map(([{ scaledCanvas }]) => scaledCanvas.element);
  const width = Math.max(...canvases.map(canvas => canvas.width));
  const height = canvases.reduce((sum, canvas) => sum + canvas.height + GAP, -GAP);
  const image = Object.assign(document.createElement("canvas"), { width, height });
  const context = image.getContext("2d");
  context.fillStyle = readTheme().card;
  context.fillRect(0, 0, width, height);
  let top = 0;
  for (const [{ scaledCanvas, overlay }] of views) {
    context.drawImage(scaledCanvas.element, 0, top);
    overlay?.drawOnto(context, 0, top);
    top += scaledCanvas.element.height + GAP;
  }
  return new Promise(resolve => image.toBlob(resolve));
}

/** Download a blob as a file. */
export function download(blob, name) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(blob), download: name });
  link.click();
  URL.revokeObjectURL(link.href);
}
