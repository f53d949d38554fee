"use strict";
// What a page can do beyond being read: values at the pointer, zoom, saving a picture and its
// numbers, hiding laws. Without this script the page says everything that it says with it.

const hiddenLaws = new Set();

/** Return an element with properties and children. */
function make(tag, properties = {}, ...children) {
  const made = Object.assign(document.createElement(tag), properties);
  made.append(...children);
  return made;
}

/** Return a button; its words are read out, its sign is seen. */
function button(sign, words, act) {
  const made = make("button", { type: "button", textContent: sign, title: words, onclick: act });
  made.setAttribute("aria-label", words);
  return made;
}

// --- numbers of a panel --------------------------------------------------------------------------

/** Return all values of an axis, of which even steps are given by their ends. */
function values(given) {
  if (Array.isArray(given)) return given;
  const step = (given.to - given.from) / (given.count - 1);
  return Array.from({ length: given.count }, (_, i) => Number((given.from + i * step).toPrecision(8)));
}

/** Return a value as far as it is along its axis: linear, in logarithms, or both about zero. */
function scaled(axis, value) {
  if (axis.scale === "log") return Math.log10(value);
  if (axis.scale !== "symlog") return value;
  const size = Math.abs(value) / axis.linear;
  return Math.sign(value) * (size <= 1 ? size * (10 / 9) : 10 / 9 + Math.log10(size));
}

/** Return what part of an axis lies below a value. */
function part(axis, value) {
  const low = scaled(axis, axis.low);
  return (scaled(axis, value) - low) / (scaled(axis, axis.high) - low);
}

/** Return the value of a linear or logarithmic axis at a part of it. */
function valueAt(axis, share) {
  const [low, high] = [scaled(axis, axis.low), scaled(axis, axis.high)];
  const found = low + share * (high - low);
  return axis.scale === "log" ? 10 ** found : found;
}

/** Return where a point of a panel is in the picture. */
function place(panel, x, y) {
  const [left, top, width, height] = panel.box;
  return [left + part(panel.x, x) * width, top + (1 - part(panel.y, y)) * height];
}

/** Return "name: value unit" for a name that ends with its unit in brackets. */
function said(name, value) {
  const [, words, unit] = /^(.*?)\s*(?:\[(.*?)\])?$/.exec(name);
  const number = String(Number(value.toPrecision(4))).replace("-", "−");
  return `${words ? `${words}: ` : ""}${number}${unit && unit !== "1" ? ` ${unit}` : ""}`;
}

/** Return the name of a line with the unit of its axis. */
function lineName(series, panel) {
  const unit = /\[.*\]/.exec(panel.y.name);
  return series.name ? series.name + (unit ? ` ${unit[0]}` : "") : panel.y.name;
}

// --- reading at the pointer ----------------------------------------------------------------------

/** Return the points of a panel's lines: of each line the nearest, by what is along if it rises. */
function nearest(panel, x, y) {
  const found = [];
  for (const series of panel.series) {
    if (hiddenLaws.has(series.law)) continue;
    series.all ??= values(series.x);
    series.rises ??= series.all.length > 1 && series.all.every((v, i, all) => !i || v > all[i - 1]);
    let best = null;
    series.all.forEach((value, i) => {
      if (value === null || series.y[i] === null) return;
      const at = place(panel, value, series.y[i]);
      const far = series.rises ? Math.abs(at[0] - x) : Math.hypot(at[0] - x, at[1] - y);
      if (!best || far < best.far) best = { series, i, at, far };
    });
    if (best) found.push(best);
  }
  const rising = found.filter((one) => one.series.rises);
  const lone = found.filter((one) => !one.series.rises && one.far < 20);
  const least = (some) => some.reduce((a, b) => (b.far < a.far ? b : a));
  if (lone.length) return [least(lone)];
  return rising.length ? rising.filter((one) => one.far <= least(rising).far + 1) : [];
}

/** Return the value of a panel's field at a part of its width and height, or null. */
function fieldAt(field, right, up) {
  const rows = field.values.length / field.columns;
  const column = Math.min(Math.floor(right * field.columns), field.columns - 1);
  return field.values[Math.min(Math.floor(up * rows), rows - 1) * field.columns + column];
}

/** Return the words for a place of the picture and the points they are about; null for none. */
function reading(panels, x, y) {
  const panel = panels.find(({ box, law }) =>
    !hiddenLaws.has(law) && x >= box[0] && x <= box[0] + box[2] && y >= box[1] && y <= box[1] + box[3]);
  if (!panel) return null;
  const [left, top, width, height] = panel.box;
  const [right, up] = [(x - left) / width, 1 - (y - top) / height];
  const lines = panel.name ? [panel.name] : [];
  const points = nearest(panel, x, y);
  if (points.length) {
    lines.push(said(panel.x.name, points[0].series.all[points[0].i]));
    for (const { series, i } of points) lines.push(said(lineName(series, panel), series.y[i]));
  } else if (panel.field) {
    lines.push(said(panel.x.name, valueAt(panel.x, right)), said(panel.y.name, valueAt(panel.y, up)));
    const value = fieldAt(panel.field, right, up);
    if (value !== null) lines.push(said(panel.field.name, value));
  } else {
    return null;
  }
  return { lines, points };
}

/** Show the values at the pointer beside it, and mark their points. */
function addReading(figure, svg, panels) {
  const box = make("div", { className: "reading", hidden: true });
  const marks = document.createElementNS(svg.namespaceURI, "g");
  marks.setAttribute("class", "marks");
  svg.append(marks);
  figure.append(box);
  const hide = () => {
    box.hidden = true;
    marks.replaceChildren();
  };
  const show = (event) => {
    const at = new DOMPoint(event.clientX, event.clientY).matrixTransform(svg.getScreenCTM().inverse());
    const found = reading(panels, at.x, at.y);
    if (!found) return hide();
    marks.replaceChildren(...found.points.map(({ at: [x, y] }) => {
      const dot = document.createElementNS(svg.namespaceURI, "circle");
      Object.entries({ cx: x, cy: y, r: 3 }).forEach(([name, value]) => dot.setAttribute(name, value));
      return dot;
    }));
    box.replaceChildren(...found.lines.map((line) => make("div", { textContent: line })));
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

/** Let a picture be enlarged: by buttons, the wheel with ctrl, and moved by dragging or arrows. */
function addZoom(svg, tools) {
  const whole = svg.getAttribute("viewBox").split(/[\s,]+/).map(Number);
  let [x, y, width, height] = whole;
  const show = () => {
    x = Math.min(Math.max(x, whole[0]), whole[0] + whole[2] - width);
    y = Math.min(Math.max(y, whole[1]), whole[1] + whole[3] - height);
    svg.setAttribute("viewBox", `${x} ${y} ${width} ${height}`);
    svg.classList.toggle("near", width < whole[2]);
    svg.tabIndex = width < whole[2] ? 0 : -1;
  };
  const zoom = (factor, right = 0.5, down = 0.5) => {
    const wide = Math.min(Math.max(width / factor, whole[2] / 40), whole[2]);
    x += right * (width - wide);
    y += down * (height - (height * wide) / width);
    height *= wide / width;
    width = wide;
    show();
  };
  const move = (right, down) => {
    [x, y] = [x + right * width, y + down * height];
    show();
  };
  svg.addEventListener("wheel", (event) => {
    if (!event.ctrlKey) return; // ordinary scrolling is the page's
    event.preventDefault();
    const frame = svg.getBoundingClientRect();
    const [right, down] = [event.clientX - frame.left, event.clientY - frame.top];
    zoom(Math.exp(-event.deltaY / 300), right / frame.width, down / frame.height);
  }, { passive: false });
  svg.addEventListener("pointermove", (event) => {
    if (!event.buttons || width === whole[2]) return;
    const frame = svg.getBoundingClientRect();
    move(-event.movementX / frame.width, -event.movementY / frame.height);
  });
  svg.addEventListener("keydown", (event) => {
    const way = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
    if (!way[event.key] || width === whole[2]) return;
    event.preventDefault();
    move(...way[event.key]);
  });
  tools.append(
    button("+", "Enlarge", () => zoom(1.5)),
    button("−", "Make smaller", () => zoom(1 / 1.5)),
    button("Whole", "Show the whole picture", () => zoom(1e-9)),
  );
}

// --- saving --------------------------------------------------------------------------------------

/** Offer a text as a file. */
function save(name, type, text) {
  const link = make("a", { download: name, href: URL.createObjectURL(new Blob([text], { type })) });
  link.click();
  setTimeout(() => URL.revokeObjectURL(link.href), 10000);
}

/** Return a picture as a file of its own: whole, in the light colours, with its words. */
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

/** Return the numbers of a picture as columns of CSV, without those of hidden laws. */
function csvFile(panels) {
  const columns = [];
  const add = (panel, name, given) =>
    columns.push([panel.name ? `${panel.name}: ${name}` : name, ...given]);
  for (const panel of panels.filter(({ law }) => !hiddenLaws.has(law))) {
    let along = "";
    for (const series of panel.series.filter(({ law }) => !hiddenLaws.has(law))) {
      const x = values(series.x);
      if (along !== String(x)) add(panel, panel.x.name, x);
      along = String(x);
      add(panel, lineName(series, panel), series.y);
    }
    if (panel.field) fieldColumns(panel).forEach(([name, given]) => add(panel, name, given));
  }
  const rows = Math.max(0, ...columns.map((column) => column.length));
  const cell = (value) => typeof value === "string" ? `"${value.replaceAll('"', '""')}"` : value ?? "";
  return Array.from({ length: rows }, (_, i) => columns.map((one) => cell(one[i])).join(",")).join("\n") + "\n";
}

/** Return names and values of a field where there is one: along, up, and what is drawn. */
function fieldColumns({ field, x, y }) {
  const rows = field.values.length / field.columns;
  const known = [...field.values.keys()].filter((i) => field.values[i] !== null);
  const middle = (axis, i, count) => Number(valueAt(axis, (i + 0.5) / count).toPrecision(5));
  return [
    [x.name, known.map((i) => middle(x, i % field.columns, field.columns))],
    [y.name, known.map((i) => middle(y, Math.floor(i / field.columns), rows))],
    [field.name, known.map((i) => field.values[i])],
  ];
}

// --- laws ----------------------------------------------------------------------------------------

/** Show or hide the rows of a law, and in pictures all of its own. */
function showLaw(law, shown) {
  hiddenLaws[shown ? "delete" : "add"](law);
  for (const one of document.querySelectorAll(`[data-law="${CSS.escape(law)}"]`)) {
    if (one instanceof SVGElement) {
      // Axes and legends stay: they serve other laws too. As attributes it holds in a saved file.
      one.setAttribute("visibility", shown ? "inherit" : "hidden");
      one.querySelectorAll(".shared").forEach((part) => part.setAttribute("visibility", "visible"));
    } else {
      one.hidden = !shown;
    }
  }
}

/** Add a check box for each law, on a page that has several. */
function addLaws() {
  const found = new Set([...document.querySelectorAll("[data-law]")].map((one) => one.dataset.law));
  if (found.size < 2) return;
  const boxes = [...found].map((law) => {
    const box = make("input", { type: "checkbox", checked: true, name: law });
    box.addEventListener("change", () => showLaw(law, box.checked));
    return make("label", {}, box, law);
  });
  const all = (checked) => () => boxes.forEach(({ firstChild: box }) => {
    box.checked = checked;
    showLaw(box.name, checked);
  });
  const words = make("legend", { textContent: "Laws shown" });
  const set = make("fieldset", { className: "laws" }, words, ...boxes);
  set.append(button("All", "Show all laws", all(true)), button("None", "Hide all laws", all(false)));
  document.querySelector("section").before(set);
}

// --- the page ------------------------------------------------------------------------------------

/** Give every picture its tools. */
function addTools(figure) {
  const svg = figure.querySelector("svg");
  const panels = JSON.parse(figure.querySelector("script").textContent);
  const heading = figure.closest("section").querySelector("h1, h2, h3, h4").textContent;
  const name = heading.toLowerCase().replace(/[^\p{L}\p{N}]+/gu, "-").replace(/^-|-$/g, "");
  const viewBox = svg.getAttribute("viewBox");
  const tools = make("div", { className: "tools" });
  addZoom(svg, tools);
  const picture = () => save(`${name}.svg`, "image/svg+xml", svgFile(svg, viewBox));
  tools.append(button("SVG", "Save the picture (SVG)", picture));
  if (panels.length) {
    addReading(figure, svg, panels);
    tools.append(button("CSV", "Save the data (CSV)", () => save(`${name}.csv`, "text/csv", csvFile(panels))));
  }
  figure.append(tools);
}

document.querySelectorAll("figure").forEach(addTools);
addLaws();
