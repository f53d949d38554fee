// Canvas elements that follow their layout size and the text size of the page, and the theme colours.

const REFERENCE_FONT_SIZE = 17; // root font size at which drawings are not enlarged [px]

/**
 * A canvas element that follows its layout size.
 *
 * The size is observed, because reading it from the page would force a layout. Drawings are enlarged
 * with the text of the page: width and height count units of so many CSS pixels, so that the drawing
 * code need not know the text size.
 */
export class ScaledCanvas {
  constructor(element) {
    this.element = element;
    this.context = element.getContext("2d");
    this.pixelRatio = this.unit = this.width = this.height = 1;
    this.left = this.top = 0; // within the offset parent [px]
    this.needsRepaint = true;
    new ResizeObserver(([{ contentRect }]) => this.resize(contentRect.width, contentRect.height)).observe(element);
  }

  resize(width, height) {
    const fontSize = parseFloat(getComputedStyle(document.documentElement).fontSize);
    this.unit = Math.max(1, Math.round(10 * fontSize / REFERENCE_FONT_SIZE) / 10);
    this.pixelRatio = Math.min(window.devicePixelRatio || 1, 2) * this.unit;
    this.width = Math.max(width / this.unit, 1);
    this.height = Math.max(height / this.unit, 1);
    this.left = this.element.offsetLeft;
    this.top = this.element.offsetTop;
    this.needsRepaint = true;
    this.element.width = Math.round(this.width * this.pixelRatio);
    this.element.height = Math.round(this.height * this.pixelRatio);
  }

  /** Clear the canvas; return its context, and its width and height in units. */
  clear() {
    this.needsRepaint = false;
    this.context.setTransform(this.pixelRatio, 0, 0, this.pixelRatio, 0, 0);
    this.context.clearRect(0, 0, this.width, this.height);
    return [this.context, this.width, this.height];
  }
}

let themeColours = {};
/** Read the colours of the style sheet; called again when the theme changes. */
export function readTheme() {
  const style = getComputedStyle(document.documentElement);
  const names = ["ground", "card", "ink", "soft", "line", "blue", "orange", "green", "red", "low", "high", "plus",
    "minus", "solid"];
  themeColours = Object.fromEntries(names.map(name => [name, style.getPropertyValue(`--${name}`).trim()]));
  return themeColours;
}
export const colours = () => themeColours;

/** Return red, green and blue of a colour "#rrggbb". */
export const toRgb = colour => [1, 3, 5].map(start => parseInt(colour.slice(start, start + 2), 16));
