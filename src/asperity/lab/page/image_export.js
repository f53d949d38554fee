// A picture of what is seen, as PNG, or as SVG whose lines, arrows and words are lines, arrows and words.

import { readTheme } from "./canvas.js";

const SVG = document.createRange().createContextualFragment("<svg/>").firstChild.namespaceURI;
const GAP = 8; // pixels between two views
const ruler = document.createElement("canvas").getContext("2d");
const short = value => Number(value.toFixed(2));
const escaped = text => text.replaceAll("&", "&amp;").replaceAll("<", "&lt;").replaceAll('"', "&quot;");

/** What the views ask of a canvas, written as SVG. */
export class Pen {
  vector = true;
  globalAlpha = 1;
  lineWidth = 1;
  fillStyle = "#000";
  strokeStyle = "#000";
  font = "12px system-ui, sans-serif";

  constructor() { this.parts = []; this.path = []; this.dashes = []; }

  put(name, values, content = "") {
    const alpha = this.globalAlpha < 1 ? { opacity: this.globalAlpha } : {};
    const said = Object.entries({ ...values, ...alpha }).map(([key, value]) => ` ${key}="${escaped(String(value))}"`);
    this.parts.push(content ? `<${name}${said.join("")}>${escaped(content)}</${name}>` : `<${name}${said.join("")}/>`);
  }

  beginPath() { this.path = []; }
  moveTo(x, y) { this.path.push(`M${short(x)} ${short(y)}`); }
  lineTo(x, y) { this.path.push(`${this.path.length ? "L" : "M"}${short(x)} ${short(y)}`); }
  closePath() { this.path.push("Z"); }

  /** A whole circle: the views draw no other arcs. */
  arc(x, y, radius) {
    const [left, right, r] = [x - radius, x + radius, radius].map(short);
    this.path.push(`M${right} ${short(y)}A${r} ${r} 0 1 0 ${left} ${short(y)}A${r} ${r} 0 1 0 ${right} ${short(y)}`);
  }

  stroke() {
    const dashes = this.dashes.length ? { "stroke-dasharray": this.dashes.join(" ") } : {};
    this.put("path", { d: this.path.join(""), fill: "none", stroke: this.strokeStyle, "stroke-width": this.lineWidth, ...dashes });
  }

  fill() { this.put("path", { d: this.path.join(""), fill: this.fillStyle }); }
  setLineDash(dashes) { this.dashes = dashes; }
  save() {}
  restore() {}

  fillRect(x, y, width, height) {
    this.put("rect", { x: short(x), y: short(y), width: short(width), height: short(height), fill: this.fillStyle });
  }

  fillText(text, x, y) {
    this.put("text", { x: short(x), y: short(y), fill: this.fillStyle, style: `font: ${this.font}` }, text);
  }

  measureText(text) { ruler.font = this.font; return ruler.measureText(text); }

  /** A picture in the picture: the relief, and the colours of the curl. */
  drawImage(canvas, x, y, width, height) {
    this.put("image", { x: short(x), y: short(y), width: short(width), height: short(height), preserveAspectRatio: "none", href: canvas.toDataURL() });
  }
}

/** Return views, each with what draws it, below each other as SVG. */
export function svgOf(views) {
  const parts = [], sizes = views.map(([view]) => [view.sheet.width, view.sheet.height]);
  let top = 0;
  views.forEach(([view, draw], k) => {
    const pen = new Pen(), { sheet, marker } = view, [width, height] = sizes[k];
    view.sheet = { canvas: sheet.canvas, ratio: sheet.ratio, width, height, blank: true, cleared: () => [pen, width, height] };
    if (marker) view.marker = Object.assign(Object.create(marker), { draw: pen, fit: () => true });
    try { draw(); } finally { Object.assign(view, marker ? { sheet, marker } : { sheet }); }
    parts.push(`<svg y="${short(top)}" width="${short(width)}" height="${short(height)}">${pen.parts.join("")}</svg>`);
    top += height + GAP;
  });
  const width = short(Math.max(...sizes.map(([wide]) => wide))), height = short(top - GAP);
  return `<svg xmlns="${SVG}" width="${width}" height="${height}" viewBox="0 0 ${width} ${height}">`
    + `<rect width="100%" height="100%" fill="${readTheme().card}"/>${parts.join("")}</svg>`;
}

/** Return the views below each other as PNG. */
export function pngOf(views) {
  const sheets = views.map(([view]) => view.sheet.canvas), height = sheets.reduce((sum, one) => sum + one.height + GAP, -GAP);
  const whole = Object.assign(document.createElement("canvas"), { width: Math.max(...sheets.map(one => one.width)), height });
  const draw = whole.getContext("2d");
  draw.fillStyle = readTheme().card;
  draw.fillRect(0, 0, whole.width, whole.height);
  let top = 0;
  for (const [{ sheet, marker }] of views) {
    draw.drawImage(sheet.canvas, 0, top);
    marker?.copy(draw, 0, top);
    top += sheet.canvas.height + GAP;
  }
  return new Promise(done => whole.toBlob(done));
}

/** Hand a file to whoever sits at the page. */
export function download(content, name) {
  const link = Object.assign(document.createElement("a"), { href: URL.createObjectURL(content), download: name });
  link.click();
  URL.revokeObjectURL(link.href);
}
