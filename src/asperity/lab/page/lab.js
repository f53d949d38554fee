// The page: what is acknowledged from the lab is shown, and what is done here is said to it.

import { Ledger } from "./tactile_metrics.js";
import { Hand } from "./pointer_hand.js";
import { Handle } from "./device_handle.js";
import { Latency } from "./latency.js";
import { fromSlider, showLimit, toSlider } from "./stiffness_slider.js";
import { Line } from "./connection.js";
import { download, pngOf, svgOf } from "./image_export.js";
import { readTheme } from "./canvas.js";
import { Sound } from "./sound.js";
import { Player } from "./player.js";
import { TakesPanel } from "./clips_panel.js";
import { Tour } from "./tour.js";
import { TourPanel } from "./tour_panel.js";
import { Spectrum, Traces } from "./traces.js";
import { Cut, Relief, isRelief } from "./views.js";
import { millimetres, quantity } from "./format.js";

const $ = id => document.getElementById(id);
const NUMBERS = ["delay", "hand_stiffness", "hand_damping", "magnify", "magnify_height"]; // fields that say them as they are
const relief = new Relief($("relief")), cut = new Cut($("cut"));
const traces = new Traces($("traces")), spectrum = new Spectrum($("spectrum")), sound = new Sound();
const ledger = new Ledger();

let news = null, frame = null, span = 8e-3, centre = [0, 0], firstNews = true;
let laws = []; // as the lab knows them, with their parameters
let faults = 0, seen = -1; // the newest frame that was painted
let asked = {}; // pictures, by kind: which, since when, and when again [ms]
const latency = new Latency();

const line = new Line({
  hello(said) {
    laws = said.laws;
    fill($("other"), said.laws.map(law => [law.letter, `${law.letter} ${law.name}`]), "A");
    fill($("device"), said.devices.map(name => [name, name]));
    $("textures").replaceChildren(...said.textures.map(name => new Option(name)));
    $("letters").replaceChildren(...said.laws.map(law => {
      const button = Object.assign(document.createElement("button"), { type: "button", textContent: law.letter });
      button.setAttribute("role", "radio");
      button.title = law.name;
      button.dataset.words = `${law.name}. ${law.words}`;
      button.onclick = () => change({ law: law.letter });
      return button;
    }));
  },
  news(said) {
    const before = news;
    news = said;
    if (said.steers && !before?.steers) hand.sent = said.requested;
    if (before?.starts !== said.starts) traces.clear();
    if (before?.starts !== said.starts || before?.settings.law !== said.settings.law) ledger.clear();
    if (!before && !frame) [hand.x, hand.y] = centre = [...said.middle];
    if (firstNews && said.steers && !said.handle) fromAddress(); // an address moves no handle
    firstNews = false;
    hand.high = said.high;
    last.look = -Infinity; // other pictures may be wanted now
    show();
  },
  refused(said) { alarm(said.words); },
  take(said) { takes.add(said); },
  frame(said) {
    if (player.on) { line.say("seen", { frame: said.number }); return; } // what was is shown, not what is
    tour.take(said, line.layout.columns);
    feel(said);
    if (document.hidden) line.say("seen", { frame: said.number }); // nothing is painted
  },
  picture(numbers) {
    const view = isRelief(numbers) ? relief : cut, now = performance.now();
    const wait = asked[view.name];
    if (wait) wait.again = now + RESTS * (now - wait.since);
    view.take(numbers);
  },
  /** There is no such picture yet. */
  later({ kind }) { if (asked[kind]) Object.assign(asked[kind], { key: "", version: -1, again: performance.now() + 500 }); },
  lost(reason) {
    const goes = news?.handle ? " The force goes when no page steers." : "";
    firstNews = false;
    news = null;
    asked = {};
    $("state").className = "stopped";
    $("state").textContent = "connection lost";
    alarm(`${reason ? `The server closed the connection: ${reason}.` : "Connection lost. Is asperity lab still running?"}${goes} Reconnecting …`);
  },
});

const hand = new Hand((what, content) => {
  const said = Boolean(news?.steers && !news.handle) && line.say(what, content);
  if (said) latency.request(hand.sent + 1, hand.since);
  return said;
});

const handle = new Handle(what => line.say(what));
const tour = new Tour({ change, hand, ledger, get span() { return span; }, set span(width) { span = width; }, get news() { return news; } }), panel = new TourPanel(tour);

const player = new Player({
  frame(said) { feel({ ...said, number: seen }); },
  clear() {
    traces.clear(); ledger.clear();
    for (const wait of Object.values(asked)) wait.again = wait.again < Infinity ? 0 : wait.again; // it is another place
  },
});
const takes = new TakesPanel({
  player, change(changes) { line.say("change", { changes }); }, save() { line.say("save"); },
  get columns() { return line.layout.columns; }, get version() { return news?.version; },
});

const rate = () => (player.on ? player.rate : news?.rate ?? 1000);

/** Show what a frame says, of now or of a take. */
function feel(said) {
  frame = said;
  if (news) ledger.take(said, line.layout.columns, news);
  traces.take(said, line.layout.columns);
  spectrum.take(said.forces);
  sound.take(said.forces, rate());
}

function fill(select, pairs, chosen) {
  const value = select.value || chosen;
  select.replaceChildren(...pairs.map(([key, words]) => new Option(words, key, false, key === value)));
}

/** Ask for something else; behind a recording is what it was felt on, and nothing else. */
function change(changes) { takes.close(); line.say("change", { changes }); }

function alarm(words) {
  $("alarm").hidden = !words;
  $("alarm").firstElementChild.textContent = words;
}

// --- what is known ------------------------------------------------------------------------------

function show() {
  const { settings, state, words, steers, free } = news;
  const [size, height] = [settings.magnify, settings.magnify_height].map(times => Number(times.toPrecision(3)));
  const times = size === height ? `, × ${size}` : `, × ${size}, heights × ${height}`;
  $("surface").title = settings.texture;
  $("surface").textContent = settings.texture.split(/[\\/]/).at(-1) + (size === 1 && height === 1 ? "" : times);
  $("state").className = state;
  $("state").textContent = { running: `law ${settings.law} at ${news.rate.toFixed(0)} Hz`, stopped: "stopped",
    starting: "starting", changing: "changing" }[state];
  const told = state === "stopped" ? `The loop has stopped: ${words}` : !steers
    ? "Another page has control; this page is read-only." : words || news.pictures;
  alarm(told);
  handle.show(news);
  $("take").hidden = !free || steers;
  $("tour-begin").disabled = !steers;
  for (const one of document.querySelectorAll(".panel :is(input, select, button)")) {
    if (!["sound", "volume", "picture", "drawing", "reset"].includes(one.id)) one.disabled = !steers;
  }
  for (const button of $("letters").children) {
    const chosen = button.textContent === settings.law;
    button.setAttribute("aria-checked", chosen);
    if (chosen) $("law-words").textContent = button.dataset.words;
  }
  for (const name of ["texture", "device", ...NUMBERS]) put(name, settings[name]);
  showParameters(settings);
  put("max_depth", (1e3 * settings.max_depth).toFixed(3).replace(/\.?0+$/, ""));
  put("stiffness", 1000 * toSlider(settings.stiffness));
  $("stiffness-value").textContent = quantity(settings.stiffness, "N/m");
  $("assumptions").replaceChildren(...news.assumptions.map(words =>
    Object.assign(document.createElement("li"), { textContent: words })));
  showLimit(settings, news.limit);
  if (steers && state === "running" && !news.handle) toAddress(settings);
}

/** Fields for the parameters of the law, as its catalogue declares them. */
function showParameters(settings) {
  const { parameters } = laws.find(law => law.letter === settings.law);
  if ($("parameters").dataset.law !== settings.law) {
    $("parameters").dataset.law = settings.law;
    $("parameters").replaceChildren(...parameters.flatMap(({ name, words, unit }) => {
      const label = Object.assign(document.createElement("label"), { htmlFor: name, textContent: `${name.replaceAll("_", " ")}${unit && ` [${unit}]`}` });
      const field = Object.assign(document.createElement("input"), { id: name, type: "number", step: "any", title: words });
      field.onchange = () => change({ [name]: Number(field.value) });
      return [label, field];
    }));
  }
  for (const { name } of parameters) { put(name, settings[name]); $(name).disabled = !news.steers; }
}

function put(name, value) {
  const field = $(name);
  if (document.activeElement !== field) field.value = value ?? ""; // nothing of a hand that is a band
  field.disabled ||= value === null;
}

function fromAddress() {
  const changes = {};
  for (const [name, text] of new URLSearchParams(location.hash.slice(1))) {
    if (name in news.settings || laws.some(law => law.parameters.some(one => one.name === name))) changes[name] = ["law", "texture", "device"].includes(name) ? text : Number(text);
  }
  if (Object.keys(changes).length && Object.values(changes).every(value => value === value)) change(changes);
}

function toAddress(settings) {
  const said = Object.entries(settings).filter(([, value]) => value !== null);
  history.replaceState(null, "", `#${new URLSearchParams(said)}`);
}

// --- every picture of the screen ------------------------------------------------------------------

function probeState() {
  if (!frame) return null;
  const at = line.layout.columns, value = name => frame.newest[at[name]];
  return {
    probe: [value("x"), value("y"), value("z")], god: frame.god, hand: frame.hand,
    force: [value("applied x"), value("applied y"), value("applied z")], inside: value("inside") > 0,
    energy: ledger.energy,
  };
}

function boxes() {
  const ratio = Math.max(0.15, cut.sheet.height / cut.sheet.width);
  const half = 0.5 * ratio * span, low = news ? 0.5 * (news.low + news.high) : 0;
  return [centre[0] - span / 2, centre[0] + span / 2, low - half, low + half];
}

/** Ask for the pictures that have become others, each when the one before is there. */
function look(state) {
  if (!news) return;
  if (state) {
    const [x, y] = state.probe;
    if (Math.abs(x - centre[0]) > 0.45 * span || Math.abs(y - centre[1]) > 0.45 * span) centre = [x, y];
  }
  ask("relief", { x: centre[0], y: centre[1], size: span });
  ask("cut", { box: boxes(), y: state ? Math.round(state.probe[1] / 5e-5) * 5e-5 : 0 });
}

// The process that computes pictures gets about a tenth of a core: it rests as much longer as a picture took.
const RESTS = 8;
function ask(kind, content) {
  const key = `${news.version} ${news.starts} ${JSON.stringify(content)}`, now = performance.now();
  if (!news.version || asked[kind]?.key === key || now < (asked[kind]?.again ?? 0)) return;
  if (line.say(kind, content)) asked[kind] = { key, version: news.version, since: now, again: Infinity };
}

// When words, the spectrum and traces were last shown, and a picture last asked for [ms].
const last = { words: 0, traces: 0, look: 0 };
function due(what, time, every) {
  if (time - last[what] < every) return false;
  last[what] = time;
  return true;
}

function paint(time) {
  requestAnimationFrame(paint);
  latency.painted();
  line.look();
  player.tick(time);
  const state = probeState();
  if (frame && frame.number !== seen) {
    seen = frame.number;
    line.say("seen", { frame: seen });
  }
  relief.draw(state);
  cut.draw(state, boxes());
  if (due("traces", time, 60)) traces.draw(ledger.base);
  latency.paints(frame?.acknowledged ?? 0);
  if (due("look", time, 200)) look(state);
  if (state && due("words", time, 150)) tell(state);
}

/** Say in words what is seen. */
function tell(state) {
  const { probe, force, energy } = state;
  panel.draw();
  takes.draw();
  put("motion", hand.motion);
  put("press", 1e3 * hand.press);
  $("press-value").textContent = quantity(hand.press, "m");
  $("energy").textContent = quantity(energy, "J");
  $("ledger").classList.toggle("fed", ledger.fed);
  $("verdict").textContent = ledger.words;
  const [f, amplitude] = spectrum.draw(rate());
  $("peak").textContent = amplitude > 1e-3 ? `strongest ${quantity(f, "Hz")}, ${quantity(amplitude, "N")}` : "quiet";
  $("trace-note").textContent = `${frame.late} late samples, ${frame.skipped} skipped`;
  const size = Math.hypot(...force), place = probe.map(millimetres).join(", ");
  $("readout").textContent = `probe ${place} mm · force ${quantity(size, "N")} · time ${frame.newest[0].toFixed(1)} s`;
  $("relief-note").textContent = `heights × ${(relief.exaggeration ?? 1).toPrecision(2)} · ${handle.there ? "the handle is the hand" : "hold down to press"}`;
  const curl = cut.most > 1e-6 * (cut.strongest ?? 1) ? `curl up to ${quantity(cut.most, "N/m")}` : "no curl: no loop feeds the hand";
  $("cut-note").textContent = cut.box ? `${curl} · wheel: zoom` : "computing …";
  const words = `Probe at ${place} millimetres, force ${quantity(size, "N")}${state.inside ? ", in contact" : ""}`;
  $("relief").setAttribute("aria-label", `The surface in relief. ${words}`);
  $("cut").setAttribute("aria-label", `Section through the surface along x. ${words}. ${curl}`);
  $("traces").setAttribute("aria-label", `Traces of five seconds. Energy given to the hand ${quantity(energy, "J")}`);
  $("spectrum").setAttribute("aria-label", `Spectrum of the normal force: ${$("peak").textContent}`);
}

// --- what is done here ----------------------------------------------------------------------------

function zoom(factor) { span = Math.max(5e-4, Math.min(0.06, span * factor)); }

for (const [canvas, move] of [
  [$("relief"), event => { [hand.x, hand.y] = relief.under(event.offsetX, event.offsetY); hand.z = null; }],
  [$("cut"), event => { [hand.x, hand.z] = cut.under(event.offsetX, event.offsetY, boxes()); }],
]) {
  let last = "";
  const follow = event => {
    // A browser says "moved" after a change of the page, too: that takes nothing from the keys.
    const place = [event.offsetX, event.offsetY, event.buttons, event.pressure].join();
    if (place === last) return;
    last = place;
    if (hand.motion !== "pointer" || !relief.heights || handle.there) return;
    hand.pressed = event.buttons > 0;
    hand.force = event.pointerType === "pen" ? 2 * event.pressure : 1;
    move(event);
    hand.request(event.timeStamp);
  };
  canvas.onpointerdown = event => { canvas.setPointerCapture(event.pointerId); follow(event); };
  canvas.onpointermove = canvas.onpointerup = follow;
  // Said at once, where a browser says it; "moved" waits for the next picture.
  canvas.addEventListener("pointerrawupdate", follow);
  canvas.onpointercancel = () => { hand.pressed = false; hand.request(); };
  canvas.addEventListener("wheel", event => { event.preventDefault(); zoom(1.15 ** Math.sign(event.deltaY)); }, { passive: false });
}

$("stiffness").oninput = event => { $("stiffness-value").textContent = quantity(fromSlider(event.target.value), "N/m"); };
$("stiffness").onchange = event => change({ stiffness: fromSlider(event.target.value) });
$("press").oninput = event => { hand.press = 1e-3 * event.target.value; hand.request(); };
$("motion").onchange = event => { hand.motion = event.target.value; hand.request(); };
$("texture").onchange = event => change({ texture: event.target.value });
$("device").onchange = event => change({ device: event.target.value });
$("max_depth").onchange = event => change({ max_depth: 1e-3 * event.target.value });
for (const name of NUMBERS) {
  $(name).onchange = event => change({ [name]: Number(event.target.value) });
}
$("swap").onclick = () => {
  const mine = news?.settings.law;
  if (!mine) return;
  change({ law: $("other").value });
  $("other").value = mine;
};
for (const [name, act] of [["reset", () => ledger.clear()], ["take", () => line.say("take")]]) $(name).onclick = act;
$("volume").oninput = event => sound.setVolume(Number(event.target.value));
$("sound").onclick = async () => {
  const on = await sound.toggle();
  $("sound").setAttribute("aria-pressed", on);
  $("sound").textContent = on ? "Sound off" : "Sound on";
};
const views = [
  [relief, () => relief.draw(probeState())], [cut, () => cut.draw(probeState(), boxes())],
  [traces, () => traces.draw(ledger.base)], [spectrum, () => spectrum.draw(rate())],
];
$("picture").onclick = async () => download(await pngOf(views), "asperity-lab.png");
$("drawing").onclick = () => download(new Blob([svgOf(views)], { type: "image/svg+xml" }), "asperity-lab.svg");

const MOVES = { ArrowLeft: [-1, 0], ArrowRight: [1, 0], ArrowUp: [0, 1], ArrowDown: [0, -1] };
const KEYS = {
  " ": () => { hand.z = null; hand.force = 1; hand.latched = !hand.latched; hand.request(); },
  PageUp: () => { hand.z = Math.min(hand.height + span / 80, 0.01); hand.request(); },
  PageDown: () => { hand.z = Math.max(hand.height - span / 80, -0.01); hand.request(); },
  m: () => hand.next(),
  x: () => $("swap").click(), r: () => ledger.clear(), s: () => $("sound").click(),
  k: () => handle.there || $("save").click(), j: () => player.on && $("play").click(), l: () => player.on && $("live").click(),
  t: () => handle.there || panel.toggle(), v: () => tour.on && $("tour-show").click(),
  n: () => tour.on && $("tour-next").click(), p: () => tour.on && $("tour-back").click(),
  "+": () => zoom(1 / 1.15), "-": () => zoom(1.15),
};

addEventListener("keydown", event => {
  const typing = event.target.closest("input:not([type=range]), select, textarea");
  if (typing || event.ctrlKey || event.altKey || event.metaKey) return;
  const { key } = event, letter = [...$("letters").children].find(one => one.textContent === key.toUpperCase());
  const arrow = MOVES[key], ranged = event.target.matches("input[type=range]");
  const pressing = event.target.closest("button, summary") && key === " ";
  if (arrow && !ranged) {
    hand.x += arrow[0] * span / 60;
    hand.y += arrow[1] * span / 60;
    hand.request();
  } else if (KEYS[key] && !pressing && !(ranged && key.startsWith("Page"))) KEYS[key]();
  else if (letter) { if (news?.steers) letter.click(); } else return;
  event.preventDefault();
});

for (const what of ["error", "unhandledrejection"]) addEventListener(what, () => faults++);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", readTheme);
readTheme();
requestAnimationFrame(paint);
// For tests, and for whoever is curious in the console.
globalThis.lab = {
  line, boxes, get span() { return span; }, get frame() { return frame; }, get news() { return news; }, get faults() { return faults; },
  /** Whether both pictures are of the surface that is shown. */
  get current() { return ["relief", "cut"].every(kind => asked[kind]?.again < Infinity && asked[kind].version === news?.version); },
  get ready() { return Boolean(relief.heights && cut.box); }, latencies: latency.all, hand, tour, ledger, player, probeState, relief, cut, svg: () => svgOf(views), png: () => pngOf(views),
};
