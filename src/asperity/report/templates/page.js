"use strict";
// Interactive tools of a report page: values at the pointer, zoom, export of a figure as SVG and of
// its data as CSV, sorting and hiding of laws; figures for narrow windows. Without this script the page
// is complete but static, and figures wider than the window scroll.

const hiddenLaws = new Set();

/** Return an element with properties and children. */
function createElement(tag, properties = {}, ...children) {
  const element = Object.assign(document.createElement(tag), properties);
  element.append(...children);
  return element;
}

/** Return a button with a short visible label and a description for tooltips and screen readers. */
function createButton(label, description, onclick) {
  const button = createElement("button", { type: "button", textContent: label, title: description, onclick });
  button.setAttribute("aria-label", description);
  return button;
}

// --- data of a panel -----------------------------------------------------------------------------

/** Return the x values of a series; equidistant values are stored as {from, to, count}. */
function expandValues(data) {
  if (Array.isArray(data)) return data;
  const step = (data.to - data.from) / (data.count - 1);
  return Array.from({ length: data.count }, (_, i) => Number((data.from + i * step).toPrecision(8)));
}

/** Return a value transformed by the scale of its axis: linear, logarithmic or symmetric logarithmic. */
function transformValue(axis, value) {
  if (axis.scale === "log") return Math.log10(value);
  if (axis.scale !== "symlog") return value;
  const size = Math.abs(value) / axis.linear;
  return Math.sign(value) * (size <= 1 ? size * (10 / 9) : 10 / 9 + Math.log10(size));
}

/** Return the position of a value along its axis, from 0 to 1. */
function axisFraction(axis, value) {
  const low = transformValue(axis, axis.low);
  return (transformValue(axis, value) - low) / (transformValue(axis, axis.high) - low);
}

/** Return the value at a position along a linear or logarithmic axis, from 0 to 1. */
function valueAt(axis, fraction) {
  const [low, high] = [transformValue(axis, axis.low), transformValue(axis, axis.high)];
  const transformed = low + fraction * (high - low);
  return axis.scale === "log" ? 10 ** transformed : transformed;
}

/** Return the SVG coordinates of a data point of a panel. */
function toSvgPoint(panel, x, y) {
  const [left, top, width, height] = panel.box;
  return [left + axisFraction(panel.x, x) * width, top + (1 - axisFraction(panel.y, y)) * height];
}

/** Return "name: value unit" for a name that ends with its unit in brackets. */
function formatValue(label, value) {
  const [, name, unit] = /^(.*?)\s*(?:\[(.*?)\])?$/.exec(label);
  const number = String(Number(value.toPrecision(4))).replace("-", "−");
  return `${name ? `${name}: ` : ""}${number}${unit && unit !== "1" ? ` ${unit}` : ""}`;
}

/** Return the name of a series with the unit of its axis. */
function seriesName(series, panel) {
  const unit = /\[.*\]/.exec(panel.y.name);
  return series.name ? series.name + (unit ? ` ${unit[0]}` : "") : panel.y.name;
}

// --- values at the pointer -----------------------------------------------------------------------

/**
 * Return the data points of a panel nearest to a point of the SVG, one for each series.
 *
 * Series with increasing x values are compared by horizontal distance; a point of any other series
 * takes precedence when it is close.
 */
function nearestPoints(panel, x, y) {
  const candidates = [];
  for (const series of panel.series) {
    if (hiddenLaws.has(series.law)) continue;
    series.xs ??= expandValues(series.x);
    series.isIncreasing ??= series.xs.length > 1 && series.xs.every((v, i, xs) => !i || v > xs[i - 1]);
    let nearest = null;
    series.xs.forEach((value, i) => {
      if (value === null || series.y[i] === null) return;
      const point = toSvgPoint(panel, value, series.y[i]);
      const distance = series.isIncreasing ? Math.abs(point[0] - x) : Math.hypot(point[0] - x, point[1] - y);
      if (!nearest || distance < nearest.distance) nearest = { series, i, point, distance };
    });
    if (nearest) candidates.push(nearest);
  }
  const onCurves = candidates.filter(({ series }) => series.isIncreasing);
  const closePoints = candidates.filter(({ series, distance }) => !series.isIncreasing && distance < 20);
  const closest = (points) => points.reduce((a, b) => (b.distance < a.distance ? b : a));
  if (closePoints.length) return [closest(closePoints)];
  return onCurves.length ? onCurves.filter(({ distance }) => distance <= closest(onCurves).distance + 1) : [];
}

/** Return the value of a field at a position in its panel, from 0 to 1 along each axis; may be null. */
function fieldAt(field, right, up) {
  const rows = field.values.length / field.columns;
  const column = Math.min(Math.floor(right * field.columns), field.columns - 1);
  return field.values[Math.min(Math.floor(up * rows), rows - 1) * field.columns + column];
}

/** Return the lines of text for a point of the SVG and the data points they describe, or null. */
function readingAt(panels, x, y) {
  const panel = panels.find(({ box, law }) =>
    !hiddenLaws.has(law) && x >= box[0] && x <= box[0] + box[2] && y >= box[1] && y <= box[1] + box[3]);
  if (!panel) return null;
  const [left, top, width, height] = panel.box;
  const [right, up] = [(x - left) / width, 1 - (y - top) / height];
  const lines = panel.name ? [panel.name] : [];
  const points = nearestPoints(panel, x, y);
  if (points.length) {
    lines.push(formatValue(panel.x.name, points[0].series.xs[points[0].i]));
    for (const { series, i } of points) lines.push(formatValue(seriesName(series, panel), series.y[i]));
  } else if (panel.field) {
    lines.push(formatValue(panel.x.name, valueAt(panel.x, right)), formatValue(panel.y.name, valueAt(panel.y, up)));
    const value = fieldAt(panel.field, right, up);
    if (value !== null) lines.push(formatValue(panel.field.name, value));
  } else {
    return null;
  }
  return { lines, points };
}

/** Show the values at the pointer in a box beside it, and mark their data points. */
function addReading(figure, svg, panels) {
  const box = createElement("div", { className: "reading", hidden: true });
  const marks = document.createElementNS(svg.namespaceURI, "g");
  marks.setAttribute("class", "marks");
  svg.append(marks);
  figure.append(box);
  const hide = () => {
    box.hidden = true;
    marks.replaceChildren();
  };
  const show = (event) => {
    const pointer = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    const reading = readingAt(panels, pointer.x, pointer.y);
    if (!reading) return hide();
    marks.replaceChildren(...reading.points.map(({ point: [x, y] }) => {
      const dot = document.createElementNS(svg.namespaceURI, "circle");
      Object.entries({ cx: x, cy: y, r: 3 }).forEach(([name, value]) => dot.setAttribute(name, value));
      return dot;
    }));
    box.replaceChildren(...reading.lines.map((line) => createElement("div", { textContent: line })));
    box.hidden = false;
    const frame = figure.getBoundingClientRect();
    const [right, down] = [event.clientX - frame.left, event.clientY - frame.top];
    box.style.left = `${Math.max(0, right > frame.width / 2 ? right - box.offsetWidth - 14 : right + 14)}px`;
    box.style.top = `${Math.max(0, Math.min(down + 14, frame.height - box.offsetHeight))}px`;
  };
  svg.addEventListener("pointermove", show);
  svg.addEventListener("pointerdown", show);
  svg.addEventListener("pointerleave", hide);
}

// --- zoom ----------------------------------------------------------------------------------------

/** Add zoom by buttons and by the wheel with Ctrl, and panning by dragging and by arrow keys. */
function addZoom(svg, tools) {
  const whole = svg.getAttribute("viewBox").split(/[\s,]+/).map(Number);
  let [x, y, width, height] = whole;
  const update = () => {
    x = Math.min(Math.max(x, whole[0]), whole[0] + whole[2] - width);
    y = Math.min(Math.max(y, whole[1]), whole[1] + whole[3] - height);
    svg.setAttribute("viewBox", `${x} ${y} ${width} ${height}`);
    svg.classList.toggle("zoomed", width < whole[2]);
    svg.tabIndex = width < whole[2] ? 0 : -1;
  };
  const zoom = (factor, right = 0.5, down = 0.5) => {
    const newWidth = Math.min(Math.max(width / factor, whole[2] / 40), whole[2]);
    x += right * (width - newWidth);
    y += down * (height - (height * newWidth) / width);
    height *= newWidth / width;
    width = newWidth;
    update();
  };
  const pan = (right, down) => {
    [x, y] = [x + right * width, y + down * height];
    update();
  };
  svg.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return; // the wheel alone scrolls the page
    event.preventDefault();
    const frame = svg.getBoundingClientRect();
    const [right, down] = [event.clientX - frame.left, event.clientY - frame.top];
    zoom(Math.exp(-event.deltaY / 300), right / frame.width, down / frame.height);
  }, { passive: false });
  svg.addEventListener("pointermove", (event) => {
    if (!event.buttons || width === whole[2]) return;
    const frame = svg.getBoundingClientRect();
    pan(-event.movementX / frame.width, -event.movementY / frame.height);
  });
  svg.addEventListener("keydown", (event) => {
    const steps = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
    if (!steps[event.key] || width === whole[2]) return;
    event.preventDefault();
    pan(...steps[event.key]);
  });
  tools.append(
    createButton("+", "Zoom in", () => zoom(1.5)),
    createButton("−", "Zoom out", () => zoom(1 / 1.5)),
    createButton("Whole", "Show the whole figure", () => zoom(1e-9)),
  );
}

// --- export --------------------------------------------------------------------------------------

/** Download a text as a file. */
function downloadText(name, type, text) {
  const link = createElement("a", { download: name, href: URL.createObjectURL(new Blob([text], { type })) });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** Return a figure as a standalone SVG file: not zoomed, in the light theme, with its description. */
function svgFile(svg, viewBox) {
  const copy = svg.cloneNode(true);
  copy.querySelector(".marks")?.remove();
  for (const name of ["class", "tabindex", "aria-label", "role"]) copy.removeAttribute(name);
  const [, , width, height] = viewBox.split(/[\s,]+/);
  const size = { viewBox, width: `${width}pt`, height: `${height}pt` };
  Object.entries(size).forEach(([name, value]) => copy.setAttribute(name, value));
  const title = document.createElementNS(svg.namespaceURI, "title");
  title.textContent = svg.getAttribute("aria-label");
  copy.prepend(title);
  const text = new XMLSerializer().serializeToString(copy);
  return text.replace(/var\(--p-\w+, (#[0-9a-f]{6})\)/g, "$1");
}

/** Return the data of a figure as CSV, one column for each quantity, without hidden laws. */
function csvFile(panels) {
  const columns = [];
  const addColumn = (panel, name, values) =>
    columns.push([panel.name ? `${panel.name}: ${name}` : name, ...values]);
  for (const panel of panels.filter(({ law }) => !hiddenLaws.has(law))) {
    let previousX = "";
    for (const series of panel.series.filter(({ law }) => !hiddenLaws.has(law))) {
      const x = expandValues(series.x);
      if (previousX !== String(x)) addColumn(panel, panel.x.name, x);
      previousX = String(x);
      addColumn(panel, seriesName(series, panel), series.y);
    }
    if (panel.field) fieldColumns(panel).forEach(([name, values]) => addColumn(panel, name, values));
  }
  const rowCount = Math.max(0, ...columns.map((column) => column.length));
  const formatCell = (value) => typeof value === "string" ? `"${value.replaceAll('"', '""')}"` : value ?? "";
  const formatRow = (_, i) => columns.map((column) => formatCell(column[i])).join(",");
  return Array.from({ length: rowCount }, formatRow).join("\n") + "\n";
}

/** Return x, y and value of the cells of a field that have a value, each with its name. */
function fieldColumns({ field, x, y }) {
  const rows = field.values.length / field.columns;
  const cells = [...field.values.keys()].filter((i) => field.values[i] !== null);
  const centre = (axis, i, count) => Number(valueAt(axis, (i + 0.5) / count).toPrecision(5));
  return [
    [x.name, cells.map((i) => centre(x, i % field.columns, field.columns))],
    [y.name, cells.map((i) => centre(y, Math.floor(i / field.columns), rows))],
    [field.name, cells.map((i) => field.values[i])],
  ];
}

// --- laws ----------------------------------------------------------------------------------------

/** Show or hide a law: its rows in tables, and its panels and lines in figures. */
function setLawVisible(law, isVisible) {
  hiddenLaws[isVisible ? "delete" : "add"](law);
  for (const element of document.querySelectorAll(`[data-law="${CSS.escape(law)}"]`)) {
    if (element instanceof SVGElement) {
      // Axes and legends are shared with other laws and stay. Attributes, unlike classes, keep their
      // effect in an exported file.
      element.setAttribute("visibility", isVisible ? "inherit" : "hidden");
      element.querySelectorAll(".shared").forEach((shared) => shared.setAttribute("visibility", "visible"));
    } else {
      element.hidden = !isVisible;
    }
  }
}

/** Add a check box for each law to a page with several laws. */
function addLawFilter() {
  const laws = new Set([...document.querySelectorAll("[data-law]")].map((element) => element.dataset.law));
  if (laws.size < 2) return;
  const labels = [...laws].map((law) => {
    const box = createElement("input", { type: "checkbox", checked: true, name: law });
    box.addEventListener("change", () => setLawVisible(law, box.checked));
    return createElement("label", {}, box, law);
  });
  const setAll = (checked) => () => labels.forEach(({ firstChild: box }) => {
    box.checked = checked;
    setLawVisible(box.name, checked);
  });
  const legend = createElement("legend", { textContent: "Laws shown" });
  const filter = createElement("fieldset", { className: "laws" }, legend, ...labels);
  filter.append(
    createButton("All", "Show all laws", setAll(true)),
    createButton("None", "Show none of the laws", setAll(false)),
  );
  document.querySelector("section").before(filter);
}

// --- sorting -------------------------------------------------------------------------------------

const PREFIXES = { p: 1e-12, n: 1e-9, "µ": 1e-6, m: 1e-3, k: 1e3 };

/** Return the number that a cell begins with, in the unit without its prefix; NaN without one. */
function cellValue(text) {
  if (text.trim() === "∞") return Infinity;
  const match = /^\s*~?\s*([-−]?\d[\d.]*(?:e[-−]?\d+)?)\s*(?:([pnµmk])(?=[NJmsgWH]))?/.exec(text);
  return match ? Number(match[1].replaceAll("−", "-")) * (PREFIXES[match[2]] ?? 1) : NaN;
}

/** Sort the rows of a table by a column: numbers by value and before words, words by their letters. */
function sortRows(table, column, isDescending) {
  const rows = [...table.tBodies[0].rows].map((row) => {
    const text = row.cells[column].textContent;
    return { row, text, value: cellValue(text) };
  });
  const sign = isDescending ? -1 : 1;
  rows.sort((a, b) => {
    if (isNaN(a.value) !== isNaN(b.value)) return isNaN(a.value) - isNaN(b.value);
    return sign * (isNaN(a.value) ? a.text.localeCompare(b.text) : a.value - b.value || 0);
  });
  table.tBodies[0].append(...rows.map(({ row }) => row));
}

/** Make the headings of a table of laws buttons that sort it, first the greatest numbers. */
function addSorting(table) {
  const headings = [...(table.tHead?.rows[0].cells ?? [])];
  headings.forEach((heading, column) => {
    if (!heading.textContent) return;
    const button = createButton(heading.textContent, `Sort by ${heading.textContent}`, () => {
      const descends = heading.getAttribute("aria-sort") !== "descending" && heading.classList.contains("n");
      const isDescending = descends || heading.getAttribute("aria-sort") === "ascending";
      headings.forEach((other) => other.removeAttribute("aria-sort"));
      heading.setAttribute("aria-sort", isDescending ? "descending" : "ascending");
      sortRows(table, column, isDescending);
    });
    heading.replaceChildren(button);
  });
}

// --- narrow windows ------------------------------------------------------------------------------

const narrowWindow = matchMedia("(max-width: 30rem)");
const NARROW = 300; // units of the SVG across a narrow window, with which its text is readable
const GAP = 8; // units between blocks
const LEGEND_LINE = 12; // units of a line of a legend

const setAttributes = (element, values) => Object.entries(values).forEach(([name, value]) => element.setAttribute(name, value));
const isLabel = (element) => /scale\(0\.\d+ -0\.\d+\)/.test(element.getAttribute("transform") ?? "");
const move = (element, dx, dy) => setAttributes(element, { transform: `translate(${dx} ${dy}) ${element.getAttribute("transform") ?? ""}` });
const right = (box) => box.x + box.width, bottom = (box) => box.y + box.height;

/** Return the box around boxes. */
function unite(boxes) {
  const [x, y] = [Math.min(...boxes.map((box) => box.x)), Math.min(...boxes.map((box) => box.y))];
  return { x, y, width: Math.max(...boxes.map(right)) - x, height: Math.max(...boxes.map(bottom)) - y };
}

/** Return the labels of an element: groups of glyphs on one line. */
const labelsOf = (element) => [...element.querySelectorAll("g[transform]")].filter(isLabel);

/** Break a label at spaces so that it ends at a limit; return the height of the lines after the first. */
function wrapLabel(label, start, limit) {
  const box = label.parentNode.getBBox();
  if (right(box) <= limit) return 0;
  const scale = Number(/scale\((\S+)/.exec(label.getAttribute("transform"))[1]), height = 130 * scale;
  const glyphs = [...label.children].filter(({ tagName }) => tagName === "use");
  const placeOf = (glyph) => Number(/translate\((\S+)/.exec(glyph.getAttribute("transform"))?.[1] ?? 0);
  const places = glyphs.map(placeOf), ends = [...places.slice(1), box.width / scale];
  let [line, offset, space] = [0, 0, -1];
  glyphs.forEach((glyph, i) => {
    if (!glyph.getBBox().width) space = i;
    if (box.x + (ends[i] - offset) * scale > limit && space >= 0 && i > space) {
      line += 1;
      offset = places[space + 1] + (box.x - start) / scale;
      for (let k = space + 1; k < i; k++) setAttributes(glyphs[k], { transform: `translate(${places[k] - offset} ${-130 * line})` });
      space = -1;
    }
    if (line) setAttributes(glyph, { transform: `translate(${places[i] - offset} ${-130 * line})` });
  });
  return line * height;
}

/** Put the entries of a legend, marks with a text each, in lines that end at a limit. */
function wrapLegend(legend, limit) {
  const box = legend.getBBox(), entries = [[]];
  if (right(box) <= limit) return;
  for (const child of [...legend.children].filter((one) => one.getBBox().width)) {
    entries.at(-1).push(child);
    if (labelsOf(child).length) entries.push([]);
  }
  let [x, y] = [box.x, box.y];
  for (const entry of entries.filter((one) => one.length)) {
    const place = unite(entry.map((one) => one.getBBox()));
    if (x > box.x && x + place.width > limit) [x, y] = [box.x, y + LEGEND_LINE];
    for (const child of entry) move(child, x - place.x, y - place.y + (LEGEND_LINE - place.height) / 2);
    x += place.width + 2 * GAP;
  }
}

/** Move an element by (dx, dy), and what is in a box from x to its new place at the left, squeezed by a factor. */
function squeeze(element, box, factor, dx, dy) {
  const matrix = `matrix(${factor} 0 0 1 ${box.x + dx - factor * box.x} ${dy})`;
  const shiftOf = (x) => dx + (factor - 1) * (Math.min(Math.max(x, box.x), right(box)) - box.x);
  if (element.tagName === "defs") return;
  if (isLabel(element)) {
    const { x, width } = element.parentNode.getBBox();
    return move(element, shiftOf(x + width / 2), dy);
  }
  if (element.tagName === "use" && element.hasAttribute("x")) {
    const [x, y] = [Number(element.getAttribute("x")), Number(element.getAttribute("y"))];
    return setAttributes(element, { x: x + shiftOf(x), y: y + dy });
  }
  if (element.tagName === "g" && !element.hasAttribute("clip-path")) return [...element.children].forEach((child) => squeeze(child, box, factor, dx, dy));
  setAttributes(element, { transform: `${matrix} ${element.getAttribute("transform") ?? ""}` });
  if (factor === 1) return;
  for (const path of [element, ...element.querySelectorAll("path")]) setAttributes(path, { "vector-effect": "non-scaling-stroke" });
  for (const mark of element.querySelectorAll("use[x]")) {
    const x = Number(mark.getAttribute("x"));
    // A shape that is not a mark is at 0.
    if (x) setAttributes(mark, { transform: `translate(${x} 0) scale(${1 / factor} 1) translate(${-x} 0)` });
  }
}

/** Return the parts of axes: the box of their frame, all they show but data, and legends beside the frame. */
function partsOf(group) {
  const frame = [...group.querySelectorAll(":scope > image, :scope > g > path")].find((path) => path.getBBox().width > 1)?.getBBox();
  const shared = [...group.querySelectorAll(":scope > .shared")];
  const children = [...group.children].filter((child) => shared.includes(child) // grids of axes are clipped
    || !child.matches("[clip-path], image") && !child.querySelector("[clip-path]"));
  return { frame, children, legends: !frame ? [] : shared.slice(2).filter((legend) => legend.getBBox().x > right(frame) - 1), shared };
}

/** Give axes without labels at their left those of axes in the same row, as they share their scale. */
function copyLabels(axes) {
  const hasLabels = ({ shared: [, vertical] }) => labelsOf(vertical).length > 1;
  for (const one of axes.filter((axis) => !hasLabels(axis))) {
    const other = axes.find((axis) => hasLabels(axis) && Math.abs(axis.frame.y - one.frame.y) < 1 && axis.frame.x < one.frame.x);
    if (!other) continue;
    const copy = other.shared[1].cloneNode(true);
    copy.querySelectorAll("defs").forEach((defs) => defs.remove()); // names are unique
    const moved = createGroup(...copy.children);
    copy.removeAttribute("class"); // hidden with its law
    copy.append(moved);
    move(moved, one.frame.x - other.frame.x, 0);
    one.shared[1].replaceWith(copy);
    one.children.splice(one.children.indexOf(one.shared[1]), 1, copy);
    one.shared[1] = copy;
  }
}

/** Return a group of elements of an SVG. */
function createGroup(...children) {
  const group = document.createElementNS(document.querySelector("svg").namespaceURI, "g");
  group.append(...children);
  return group;
}

/** Hide the labels of a horizontal axis that overlap others at their left. */
function hideOverlaps(axis) {
  const labels = labelsOf(axis).map((label) => ({ label, box: label.parentNode.getBBox() }));
  const top = Math.min(...labels.map(({ box }) => box.y));
  let end = -Infinity;
  for (const { label, box } of labels.filter((one) => one.box.y < top + 5).sort((a, b) => a.box.x - b.box.x)) {
    if (box.x < end + 2) setAttributes(label, { visibility: "hidden" });
    else end = right(box);
  }
}

/** Put the panels of a figure below each other, and squeeze those that are wider than a narrow window. */
function stackPanels(svg, panels) {
  const whole = svg.querySelector("g"), [ground, ...groups] = whole.children;
  const isPanel = (frame) => (panel) => Math.abs(panel.box[0] - frame.x) + Math.abs(panel.box[1] - frame.y) < 2;
  const axes = groups.map((group) => ({ group, ...partsOf(group) })).filter(({ frame, shared }) => frame && shared.length > 1);
  for (const one of axes) one.panel = panels.find(isPanel(one.frame));
  const [stacked, bars] = [axes.filter(({ panel }) => panel), axes.filter(({ panel }) => !panel)];
  if (!stacked.length) return;
  copyLabels(stacked);
  const isUpright = ({ frame }) => frame.height > frame.width;
  for (const bar of bars.filter(isUpright)) {
    const beside = stacked.filter(({ frame }) => right(frame) <= bar.frame.x && Math.abs(frame.y - bar.frame.y) < 0.5 * frame.height);
    (beside.sort((a, b) => right(b.frame) - right(a.frame))[0] ?? stacked[0]).bar = bar;
  }
  const boxOf = (one) => unite([one.frame, ...one.children.filter((child) => !one.legends.includes(child) && child.getBBox().width).map((child) => child.getBBox())]);
  for (const one of stacked) {
    one.left = Math.max(one.frame.x - boxOf({ ...one, children: one.shared }).x, 0) + 2;
    one.rest = one.bar ? right(boxOf(one.bar)) - right(one.frame) : 14;
  }
  const left = Math.max(...stacked.map((one) => one.left));
  const widths = stacked.map(({ frame, rest }) => left + frame.width + rest), fitting = widths.filter((width) => width <= 1.2 * NARROW);
  const width = Math.max(fitting.length < widths.length ? NARROW : 0.85 * NARROW, ...fitting);
  let y = 0;
  const addRow = (element) => {
    const start = element.getBBox().x;
    if (element.classList.contains("shared")) wrapLegend(element, start + width);
    else for (const label of labelsOf(element)) wrapLabel(label, start, start + width);
    const box = element.getBBox();
    const factor = Math.min(1, width / box.width);
    setAttributes(element, { transform: `translate(${factor < 1 ? 0 : Math.min(left, width - box.width)} ${y}) scale(${factor}) translate(${-box.x} ${-box.y})` });
    y += factor * box.height + GAP;
  };
  const others = groups.filter((group) => !axes.some((one) => one.group === group) && group.getBBox().width);
  const figureHeight = ground.getBBox().height, isAbove = (group) => group.getBBox().y < 0.3 * figureHeight;
  for (const group of others.filter(isAbove)) addRow(group);
  const addAxes = (one, start) => {
    const { frame, legends } = one, factor = Math.min(1, (width - start - (one.rest ?? 14)) / frame.width);
    const whole = unite([boxOf(one), ...(one.bar ? [boxOf(one.bar)] : [])]), [dx, shrinkage] = [start - frame.x, (1 - factor) * frame.width];
    const texts = one.children.filter((child) => !one.shared.includes(child) && labelsOf(child).length).map((child) => ({ child, box: child.getBBox() }));
    const isRight = (box) => box.x > frame.x + 3 && Math.abs(right(box) - right(frame)) < 3, isAbove = (box) => bottom(box) < frame.y + 2;
    let raised = 0;
    for (const { child, box } of texts.filter((text) => isAbove(text.box) && !isRight(text.box))) {
      const lines = wrapLabel(labelsOf(child)[0], frame.x, width - dx);
      texts.filter((text) => text.box.y < bottom(box) - 1).forEach((text) => { text.raised = (text.raised ?? 0) + lines; });
      raised += lines;
    }
    const dy = y - whole.y + raised, text = new Map(texts.map((one) => [one.child, one]));
    for (const child of [...one.group.children]) {
      const at = child.getBBox(), middle = at.x + at.width / 2, share = Math.min(Math.max((middle - frame.x) / frame.width, 0), 1);
      if (text.has(child)) {
        const { box } = text.get(child), shift = isRight(box) ? 1 : isAbove(box) ? 0 : share;
        const x = Math.max(0, Math.min(box.x + dx - shift * shrinkage, isAbove(box) && !isRight(box) ? Infinity : width - 1 - box.width));
        move(child, x - box.x, dy - (text.get(child).raised ?? 0));
      } else if (one.shared.indexOf(child) < 2) squeeze(child, frame, factor, dx, dy);
      else if (!legends.includes(child)) move(child, dx - shrinkage * (share > 0.6 ? 1 : share > 0.4 ? 0.5 : 0), dy);
    }
    if (one.bar) for (const child of one.bar.group.children) move(child, dx - shrinkage, dy);
    hideOverlaps(one.shared[0]);
    y = bottom(whole) + dy + GAP;
    for (const legend of legends) addRow(legend);
    if (one.panel) one.panel.box = [start, frame.y + dy, factor * frame.width, frame.height];
  };
  for (const one of stacked) addAxes(one, left);
  for (const bar of bars.filter((one) => !isUpright(one))) {
    // What is far from the bar, such as the key of arrows, comes before it.
    const key = createGroup(...bar.children.filter((one) => one.getBBox().width && bottom(one.getBBox()) < bar.frame.y - 30));
    bar.children = bar.children.filter((child) => child.parentNode !== key);
    whole.append(key);
    if (key.children.length) addRow(key);
    addAxes(bar, Math.max(14, (width - bar.frame.width) / 2));
  }
  for (const group of others.filter((one) => !isAbove(one))) addRow(group);
  setAttributes(ground.querySelector("path"), { d: `M 0 0 H ${width} V ${y} H 0 Z` });
  setAttributes(svg, { viewBox: `0 0 ${width} ${y}` });
}

/** Draw a figure for a narrow window. */
function reflow(figure) {
  const svg = figure.querySelector("svg"), script = figure.querySelector("script");
  const panels = JSON.parse(script.textContent);
  if (figure.closest(".cards") || !panels.length) return;
  stackPanels(svg, panels);
  script.textContent = JSON.stringify(panels);
  figure.classList.add("narrow");
}

// --- page ----------------------------------------------------------------------------------------

/** Add zoom, values at the pointer and export to a figure. */
function addTools(figure) {
  const svg = figure.querySelector("svg");
  const panels = JSON.parse(figure.querySelector("script").textContent);
  const heading = figure.closest("section").querySelector("h1, h2, h3, h4").textContent;
  const name = heading.toLowerCase().replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-|-$/g, "");
  const viewBox = svg.getAttribute("viewBox");
  const tools = createElement("div", { className: "tools" });
  addZoom(svg, tools);
  const saveSvg = () => downloadText(`${name}.svg`, "image/svg+xml", svgFile(svg, viewBox));
  tools.append(createButton("SVG", "Save the figure as SVG", saveSvg));
  if (panels.length) {
    addReading(figure, svg, panels);
    const saveCsv = () => downloadText(`${name}.csv`, "text/csv", csvFile(panels));
    tools.append(createButton("CSV", "Save the data as CSV", saveCsv));
  }
  figure.append(tools);
}

/** Let the keyboard reach what is wider than the window, and only that. */
function addScrolling(regions) {
  const update = (region) => {
    if (region.scrollWidth > region.clientWidth + 1) region.tabIndex = 0;
    else region.removeAttribute("tabindex");
  };
  const observer = new ResizeObserver((entries) => entries.forEach(({ target }) => update(target)));
  for (const region of regions) observer.observe(region);
}

/** Set a figure up for the width of the window, also when that changes. */
function setUpFigure(figure) {
  const original = figure.cloneNode(true);
  let current = figure, isNarrow;
  const setUp = () => {
    isNarrow = narrowWindow.matches;
    if (isNarrow) reflow(current);
    addTools(current);
    addScrolling(current.querySelectorAll(".view"));
  };
  const update = () => {
    if (narrowWindow.matches === isNarrow) return;
    const next = original.cloneNode(true);
    current.replaceWith(next);
    current = next;
    setUp();
    hiddenLaws.forEach((law) => setLawVisible(law, false));
  };
  // Later, as a window has other widths for a moment, such as during a screenshot.
  narrowWindow.addEventListener("change", () => setTimeout(update, 300));
  setUp();
}

document.querySelectorAll("figure").forEach(setUpFigure);
addScrolling(document.querySelectorAll(".scroll"));
document.querySelectorAll("table:has(tr[data-law])").forEach(addSorting);
addLawFilter();
