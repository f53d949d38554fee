// What pictures are drawn on, and in which colours.

const TEXT = 17; // px of the page's text where a picture is drawn as it is

/**
 * A canvas and the size of its place, which is watched: to ask the page for it would cost a layout.
 *
 * Where the page's text is larger, so is all that is drawn: width and height count in units, each so many pixels of the
 * page, and nothing who draws need know.
 */
export class Sheet {
  constructor(canvas) {
    this.canvas = canvas;
    this.draw = canvas.getContext("2d");
    this.ratio = this.unit = this.width = this.height = 1;
    this.left = this.top = 0; // in what it is placed in
    this.blank = true; // nothing is drawn on it
    new ResizeObserver(([{ contentRect }]) => this.fit(contentRect.width, contentRect.height)).observe(canvas);
  }

  fit(width, height) {
    const text = parseFloat(getComputedStyle(document.documentElement).fontSize);
    this.unit = Math.max(1, Math.round(10 * text / TEXT) / 10);
    this.ratio = Math.min(window.devicePixelRatio || 1, 2) * this.unit;
    Object.assign(this, { width: Math.max(width / this.unit, 1), height: Math.max(height / this.unit, 1), blank: true });
    Object.assign(this, { left: this.canvas.offsetLeft, top: this.canvas.offsetTop });
    this.canvas.width = Math.round(this.width * this.ratio);
    this.canvas.height = Math.round(this.height * this.ratio);
  }

  /** Return the context, cleared, and width and height in units. */
  cleared() {
    this.blank = false;
    this.draw.setTransform(this.ratio, 0, 0, this.ratio, 0, 0);
    this.draw.clearRect(0, 0, this.width, this.height);
    return [this.draw, this.width, this.height];
  }
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

/** Return red, green and blue of a colour as it is written in the style sheet. */
export const channels = colour => [1, 3, 5].map(at => parseInt(colour.slice(at, at + 2), 16));
