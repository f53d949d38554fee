// The page of the lab: shows the frames and the status sent by the server, and sends the requests of the user.

import { EnergyMeter } from "./tactile_metrics.js";
import { followPointer, obeyKeys } from "./input.js";
import { Pictures } from "./pictures.js";
import { PointerHand } from "./pointer_hand.js";
import { DeviceHandle } from "./device_handle.js";
import { fromSliderValue, showLimit, toSliderFraction } from "./stiffness_slider.js";
import { Connection } from "./connection.js";
import { download, toPng, toSvg } from "./image_export.js";
import { readTheme } from "./canvas.js";
import { probeStateOf } from "./probe_overlay.js";
import { SecondLane } from "./second_lane.js";
import { ForceSound } from "./sound.js";
import { MotionPanel } from "./motion_panel.js";
import { QuietContact } from "./quiet_contact.js";
import { RecommendationPanel } from "./recommendation_panel.js";
import { Tour } from "./tour.js";
import { TourPanel } from "./tour_panel.js";
import { SpectrumPlot, TracePlot } from "./traces.js";
import { ReliefView, SectionView, isBeside, isRelief, pictureLabel } from "./views.js";
import { formatMillimetres, formatQuantity } from "./format.js";

const $ = id => document.getElementById(id);
// Settings whose fields have the same name and unit.
const NUMBER_FIELDS = ["delay", "hand_stiffness", "hand_damping", "magnify", "magnify_height"];
const LOCAL_CONTROLS = ["sound", "volume", "save-png", "save-svg", "reset-energy"]; // need no control of the loop
const MIN_VIEW_WIDTH = 5e-4, MAX_VIEW_WIDTH = 0.06; // m
const MAX_ASPECT = 3; // height over width of a section, whose sides the server limits
const relief = new ReliefView($("relief")), section = new SectionView($("section"));
const traces = new TracePlot($("traces")), spectrum = new SpectrumPlot($("spectrum")), sound = new ForceSound();
const energyMeter = new EnergyMeter(), quietContact = new QuietContact();

let status = null, frame = null, viewWidth = 8e-3, viewCentre = [0, 0], isFirstStatus = true;
let laws = []; // of the server, with their parameters
let errorCount = 0, paintedFrame = -1;

const connection = new Connection({
  hello(message) {
    laws = message.laws;
    fillSelect($("other-law"), laws.map(law => [law.letter, `${law.letter} ${law.name}`]), "A");
    secondLane.setLaws(laws);
    fillSelect($("device"), message.devices.map(name => [name, name]));
    $("textures").replaceChildren(...message.textures.map(name => new Option(name)));
    $("law-buttons").replaceChildren(...laws.map(law => {
      const button = Object.assign(document.createElement("button"), { type: "button", textContent: law.letter });
      button.setAttribute("role", "radio");
      button.title = law.name;
      button.dataset.summary = `${law.name}. ${law.summary}`;
      button.onclick = () => changeScene({ law: law.letter });
      return button;
    }));
  },
  status(message) {
    const previous = status;
    status = message;
    pictures.setStatus(status);
    const hasRestarted = previous?.start_count !== status.start_count;
    if (status.has_control && !previous?.has_control) hand.requestCount = status.request_count;
    if (hasRestarted) traces.clear();
    if (hasRestarted || previous?.settings.law !== status.settings.law) energyMeter.reset();
    if (!previous && !frame) [hand.x, hand.y] = viewCentre = [...status.centre];
    if (isFirstStatus && status.has_control && !status.handle) applyUrlSettings(); // never on a real device
    isFirstStatus = false;
    hand.surfaceHeight = status.highest;
    if (status.has_control && !previous?.has_control) hand.requestMotion(); // that of the page before goes on otherwise
    lastRun.requestPictures = -Infinity; // they may have changed
    showStatus();
    secondLane.setStatus(status);
  },
  error({ message }) { showAlarm(message); },
  frame(newFrame) {
    if (newFrame.lane) { secondLane.addFrame(newFrame, connection.layout.columns); return; }
    tour.addFrame(newFrame, connection.layout.columns);
    showFrame(newFrame);
    if (document.hidden) acknowledge(newFrame); // nothing is painted
  },
  picture(numbers) { if (isBeside(numbers)) secondLane.receivePicture(numbers); else pictures.receive(isRelief(numbers) ? relief : section, numbers); },
  picture_unavailable({ kind }) { for (const one of [pictures, secondLane.pictures]) one.noteUnavailable(kind); },
  disconnected(reason) {
    const notice = status?.handle ? " The force is released when no page with control is connected." : "";
    isFirstStatus = false;
    status = null;
    tour.end(); // the server ends it, too
    $("tour-start").disabled = true;
    for (const one of [pictures, secondLane]) one.setStatus(null);
    $("state").className = "stopped";
    $("state").textContent = "connection lost";
    showAlarm(`${reason ? `The server closed the connection: ${reason}.` : "Connection lost. Is asperity lab still running?"}${notice} Reconnecting …`);
  },
});

const pictures = new Pictures((kind, content) => connection.send(kind, content), { relief, section });
const hand = new PointerHand((type, payload) =>
  Boolean(status?.has_control && !status.handle) && connection.send(type, payload));
const handle = new DeviceHandle(type => connection.send(type));
const tour = new Tour({
  changeScene, hand, energyMeter, get status() { return status; },
  get viewWidth() { return viewWidth; }, set viewWidth(width) { viewWidth = width; },
});
const tourPanel = new TourPanel(tour), recommendationPanel = new RecommendationPanel(changeScene);
const motionPanel = new MotionPanel({
  hand,
  // Of two laws the first places loops, unless its field has no curl.
  get section() { return secondLane.isShown && pictures.isCurrent(section) && !section.hasCurl ? secondLane.section : section; },
  get isSectionCurrent() { return (this.section === section ? pictures : secondLane.pictures).isCurrent(this.section); },
});

const secondLane = new SecondLane({ changeScene, send(kind, content) { return connection.send(kind, content); }, energyMeter, tour,
  get hasCurl() { return pictures.isCurrent(section) && section.hasCurl; } });
const updateRate = () => status?.update_rate ?? 1000;

/** Tell the server that a frame was processed, so that it sends further ones. */
function acknowledge({ number }) { connection.send("acknowledge", { frame: number }); }

/** Show a frame of the loop. */
function showFrame(newFrame) {
  frame = newFrame;
  if (status) for (const metrics of [energyMeter, quietContact]) metrics.addFrame(frame, connection.layout.columns, status);
  traces.addFrame(frame, connection.layout.columns);
  spectrum.addForces(frame.forces);
  if (status) secondLane.addFirstFrame(frame, connection.layout.columns, status);
  sound.addForces(frame.forces, updateRate());
}

function fillSelect(select, options, initialValue) {
  const value = select.value || initialValue;
  select.replaceChildren(...options.map(([key, text]) => new Option(text, key, false, key === value)));
}

/** Request a change of the scene. */
function changeScene(changes) { connection.send("change", { changes }); }

function showAlarm(text) {
  $("alarm").hidden = !text;
  $("alarm").firstElementChild.textContent = text;
}

// --- status ---------------------------------------------------------------------------------------

function showStatus() {
  const { settings, state, has_control: hasControl } = status;
  $("surface").title = settings.texture;
  $("surface").textContent = settings.texture.split(/[\\/]/).at(-1) + magnificationText(settings);
  $("state").className = state;
  $("state").textContent = { running: `law ${settings.law} at ${status.update_rate.toFixed(0)} Hz`, stopped: "stopped",
    starting: "starting", changing: "changing" }[state];
  showAlarm(alarmText());
  handle.update(status);
  $("take-control").hidden = !status.control_available || hasControl;
  $("tour-start").disabled = !hasControl;
  for (const control of document.querySelectorAll(".panel :is(input, select, button)")) {
    if (!LOCAL_CONTROLS.includes(control.id)) control.disabled = !hasControl;
  }
  for (const button of $("law-buttons").children) {
    const isChecked = button.textContent === settings.law;
    button.setAttribute("aria-checked", isChecked);
    if (isChecked) $("law-summary").textContent = button.dataset.summary;
  }
  for (const name of ["texture", "device", ...NUMBER_FIELDS]) setField(name, settings[name]);
  showLawParameters(settings);
  setField("max_depth", (1e3 * settings.max_depth).toFixed(3).replace(/\.?0+$/, ""));
  showFriction(settings);
  setField("stiffness", 1000 * toSliderFraction(settings.stiffness));
  $("stiffness-value").textContent = formatQuantity(settings.stiffness, "N/m");
  $("assumptions").replaceChildren(...status.assumptions.map(text =>
    Object.assign(document.createElement("li"), { textContent: text })));
  showCurrentLimit();
  recommendationPanel.update(status);
  if (hasControl && state === "running" && !status.handle && !tour.isActive) storeUrlSettings(settings);
}

/** Name the first lane, if there are two. */
function showLanes() {
  const { law } = status.settings, { isShown } = secondLane;
  secondLane.update(law);
  traces.label = isShown ? `law ${law}` : "";
  section.label = isShown || !pictures.isCurrent(section) ? pictureLabel(section, law) : "";
  $("section-title").textContent = isShown ? `Law ${law}` : "Section below the probe";
  $("trace-title").textContent = isShown ? `Law ${law}` : "Position, force and energy";
}

function showCurrentLimit() { showLimit(status.settings, status.limit, quietContact.text); }

function magnificationText(settings) {
  const [size, height] = [settings.magnify, settings.magnify_height].map(factor => Number(factor.toPrecision(3)));
  if (size === 1 && height === 1) return "";
  return size === height ? `, × ${size}` : `, × ${size}, heights × ${height}`;
}

function alarmText() {
  if (status.state === "stopped") return `The loop has stopped: ${status.message}`;
  if (!status.has_control) return "Another page has control; this page is read-only.";
  return status.message || status.picture_message;
}

/** Show a field for each parameter of the current law. */
function showLawParameters(settings) {
  const { parameters } = laws.find(law => law.letter === settings.law);
  if ($("parameters").dataset.law !== settings.law) {
    $("parameters").dataset.law = settings.law;
    $("parameters").replaceChildren(...parameters.flatMap(({ name, description, unit }) => {
      const label = Object.assign(document.createElement("label"), { htmlFor: name, textContent: `${name.replaceAll("_", " ")}${unit && ` [${unit}]`}` });
      const field = Object.assign(document.createElement("input"), { id: name, type: "number", step: "any", title: description });
      field.onchange = () => changeScene({ [name]: Number(field.value) });
      return [label, field];
    }));
  }
  for (const { name } of parameters) { setField(name, settings[name]); $(name).disabled = !status.has_control; }
}

/** Show the friction of a law that can have it, and of law F, whose own it is. */
function showFriction({ law, friction }) {
  const { has_friction: isShared, parameters } = laws.find(({ letter }) => letter === law), kappa = status.friction?.presliding_stiffness;
  setField("friction-coefficient", friction);
  $("friction-coefficient").disabled ||= !isShared;
  $("friction-value").textContent = friction.toFixed(2);
  const own = parameters.some(({ name }) => name === "friction") ? `that of law ${law} itself` : `law ${law} can have none: it would not end its leak`;
  $("friction-note").textContent = !isShared ? own : kappa ? `presliding stiffness ${formatQuantity(kappa, "N/m")}: takes energy on every closed path` : "none: like ice";
}

/** Set the value of a field that has no focus; null disables it, as for the stiffness of an elastic band. */
function setField(id, value) {
  const field = $(id);
  if (document.activeElement !== field) field.value = value ?? "";
  field.disabled ||= value === null;
}

/** Apply the settings in the fragment of the URL, if all are valid. */
function applyUrlSettings() {
  const changes = {};
  for (const [name, text] of new URLSearchParams(location.hash.slice(1))) {
    const isParameter = laws.some(law => law.parameters.some(parameter => parameter.name === name));
    if (name in status.settings || isParameter) changes[name] = ["law", "beside", "texture", "device"].includes(name) ? text : Number(text);
  }
  const values = Object.values(changes);
  if (values.length && !values.some(Number.isNaN)) changeScene(changes);
}

function storeUrlSettings(settings) {
  const entries = Object.entries(settings).filter(([, value]) => value !== null && value !== "");
  history.replaceState(null, "", `#${new URLSearchParams(entries)}`);
}

// --- painting -------------------------------------------------------------------------------------

const probeState = () => frame && probeStateOf(frame, connection.layout.columns, energyMeter.energy, status?.friction);

/** Return the box of the section to be shown: left, right, bottom, top [m]. */
function sectionBox() {
  const { width, height } = section.scaledCanvas, halfHeight = 0.5 * Math.max(0.15, Math.min(height / width, MAX_ASPECT)) * viewWidth;
  const middle = status ? 0.5 * (status.lowest + status.highest) : 0;
  return [viewCentre[0] - viewWidth / 2, viewCentre[0] + viewWidth / 2, middle - halfHeight, middle + halfHeight];
}

/** Whether the hand of this page moves back and forth within a view about the middle of its motion. */
function fitsPeriodicMotion() {
  return status.has_control && !status.handle && hand.reach > 0 && hand.reach <= 0.5 * viewWidth;
}

/** Request the pictures that have changed, centred on the probe when it leaves the view. */
function requestPictures(state) {
  if (!status) return;
  if (state) {
    const [x, y] = fitsPeriodicMotion() ? [hand.x, hand.y] : state.probe;
    if (Math.abs(x - viewCentre[0]) > 0.45 * viewWidth || Math.abs(y - viewCentre[1]) > 0.45 * viewWidth) viewCentre = [x, y];
  }
  pictures.request("relief", { x: viewCentre[0], y: viewCentre[1], size: viewWidth });
  if (!section.covers(sectionBox())) pictures.endPauses(); // a part of the view is blank
  const cut = { box: sectionBox(), y: state ? Math.round(state.probe[1] / 5e-5) * 5e-5 : 0 };
  pictures.request("section", cut);
  secondLane.requestPicture(cut);
}

const lastRun = { texts: 0, traces: 0, requestPictures: 0 }; // time of the last run of each periodic task [ms]

/** Return whether a periodic task is due, and note that it runs. */
function isDue(task, time, interval) {
  if (time - lastRun[task] < interval) return false;
  lastRun[task] = time;
  return true;
}

function paint(time) {
  requestAnimationFrame(paint);
  connection.readBuffer();
  const state = probeState();
  if (frame && frame.number !== paintedFrame) {
    paintedFrame = frame.number;
    acknowledge(frame);
  }
  relief.draw(state);
  section.draw(state, sectionBox());
  secondLane.drawSection(sectionBox());
  if (isDue("traces", time, 60)) drawTraces();
  if (isDue("requestPictures", time, 200)) requestPictures(state);
  if (state && isDue("texts", time, 150)) updateTexts(state);
}

/** Draw the traces of both lanes, to the same scales. */
function drawTraces() {
  traces.draw(energyMeter.offset, secondLane.scale);
  secondLane.drawTraces({ plot: traces, offset: energyMeter.offset });
}

/** Return the counts of ticks since the start of the loop. */
function tickText({ late, skipped, lateness, truncated, forceLimited, tooDeep, deepest, firstRow, rowCount }) {
  let text = `${late} late (${formatQuantity(lateness, "s")}), ${skipped} skipped, ${truncated} truncated ticks`;
  if (forceLimited) text += `, ${forceLimited} at the force limit`;
  if (tooDeep) text += `, ${tooDeep} below the depth (deepest ${formatQuantity(deepest, "m")})`;
  const share = (firstRow + rowCount) / (firstRow + rowCount + skipped);
  return share < 0.99 ? `${text}; measured ${(100 * share).toFixed(0)} % of the update rate that the stiffness is for` : text;
}

/** Update the panels, the numbers, and the descriptions of the views for screen readers. */
function updateTexts({ probe, force, energy, isInside }) {
  tourPanel.update();
  motionPanel.update();
  if (status) { showCurrentLimit(); showLanes(); }
  setField("press-depth", 1e3 * hand.pressDepth);
  $("press-depth-value").textContent = formatQuantity(hand.pressDepth, "m");
  $("energy").textContent = formatQuantity(energy, "J");
  $("energy-card").classList.toggle("supplies-energy", energyMeter.suppliesEnergy);
  $("verdict").textContent = energyMeter.verdict;
  $("taken").hidden = $("anchor-legend").hidden = !status?.friction;
  $("taken").textContent = `taken by friction: ${formatQuantity(energyMeter.takenByFriction, "J")}`;
  const [frequency, amplitude] = spectrum.draw(updateRate(), secondLane.otherSpectrum);
  $("peak").textContent = amplitude > 1e-3 ? `strongest ${formatQuantity(frequency, "Hz")}, ${formatQuantity(amplitude, "N")}` : "quiet";
  $("trace-note").textContent = tickText(frame);
  const forceText = `force ${formatQuantity(Math.hypot(...force), "N")}`, position = probe.map(formatMillimetres).join(", ");
  $("readout").textContent = `probe ${position} mm · ${forceText} · time ${frame.newest[0].toFixed(1)} s`;
  const stale = pictures.staleText(section);
  $("relief-note").textContent = pictures.staleText(relief) || `heights × ${(relief.exaggeration ?? 1).toPrecision(2)} · ${handle.isPresent ? "move the handle of the device" : "hold down to press"}`;
  const curl = section.hasCurl ? `curl up to ${formatQuantity(section.maxCurl, "N/m")}` : "no curl: no energy gain";
  $("section-note").textContent = stale || curl;
  for (const id of ["save-png", "save-svg"]) $(id).disabled = Boolean(stale || pictures.staleText(relief)); // a file would not say so
  const description = `Probe at ${position} millimetres, ${forceText}${isInside ? ", in contact" : ""}`;
  $("relief").setAttribute("aria-label", `The surface in relief. ${description}`);
  $("section").setAttribute("aria-label", `Section through the surface along x. ${description}. ${stale || curl}`);
  $("traces").setAttribute("aria-label", `Traces of five seconds. Energy given to the hand ${formatQuantity(energy, "J")}`);
  $("spectrum").setAttribute("aria-label", `Spectrum of the normal force: ${$("peak").textContent}`);
}

// --- input ----------------------------------------------------------------------------------------

function zoom(factor) { viewWidth = Math.max(MIN_VIEW_WIDTH, Math.min(MAX_VIEW_WIDTH, viewWidth * factor)); }

const inputHost = {
  hand, handle, tour, motionPanel, secondLane, zoom,
  get viewWidth() { return viewWidth; }, get hasControl() { return Boolean(status?.has_control); },
  get canFollowPointer() { return Boolean(relief.heights) && !handle.isPresent; },
};
followPointer($("relief"), inputHost, event => { [hand.x, hand.y] = relief.pointAt(event.offsetX, event.offsetY); hand.z = null; });
for (const view of [section, secondLane.section]) {
  followPointer(view.scaledCanvas.element, inputHost, event => { [hand.x, hand.z] = view.pointAt(event.offsetX, event.offsetY, sectionBox()); });
}
obeyKeys(inputHost);

$("stiffness").oninput = event => { $("stiffness-value").textContent = formatQuantity(fromSliderValue(event.target.value), "N/m"); };
$("stiffness").onchange = event => changeScene({ stiffness: fromSliderValue(event.target.value) });
$("friction-coefficient").oninput = event => { $("friction-value").textContent = Number(event.target.value).toFixed(2); };
$("friction-coefficient").onchange = event => changeScene({ friction: Number(event.target.value) });
$("press-depth").oninput = event => { hand.pressDepth = 1e-3 * event.target.value; hand.requestMotion(); };
$("texture").onchange = event => changeScene({ texture: event.target.value });
$("device").onchange = event => changeScene({ device: event.target.value });
$("max_depth").onchange = event => changeScene({ max_depth: 1e-3 * event.target.value });
for (const name of NUMBER_FIELDS) {
  $(name).onchange = event => changeScene({ [name]: Number(event.target.value) });
}
$("swap-laws").onclick = () => {
  const previousLaw = status?.settings.law;
  if (!previousLaw) return;
  changeScene({ law: $("other-law").value });
  $("other-law").value = previousLaw;
};
$("reset-energy").onclick = () => secondLane.reset();
$("take-control").onclick = () => connection.send("take_control");
$("volume").oninput = event => sound.setVolume(Number(event.target.value));
$("sound").onclick = async () => {
  const isOn = await sound.toggle();
  $("sound").setAttribute("aria-pressed", isOn);
  $("sound").textContent = isOn ? "Sound off" : "Sound on";
};
const views = () => [
  [relief, () => relief.draw(probeState())], [section, () => section.draw(probeState(), sectionBox())],
  [traces, drawTraces], [spectrum, () => spectrum.draw(updateRate(), secondLane.otherSpectrum)],
  ...secondLane.views(sectionBox(), drawTraces),
];
$("save-png").onclick = async () => download(await toPng(views()), "asperity-lab.png");
$("save-svg").onclick = () => download(new Blob([toSvg(views())], { type: "image/svg+xml" }), "asperity-lab.svg");

for (const type of ["error", "unhandledrejection"]) addEventListener(type, () => errorCount++);
matchMedia("(prefers-color-scheme: dark)").addEventListener("change", readTheme);
readTheme();
requestAnimationFrame(paint);
// For the tests and for the console of the browser.
globalThis.lab = {
  connection, hand, pictures, quietContact, tour, energyMeter, relief, section, traces, probeState, sectionBox,
  toSvg: () => toSvg(views()), toPng: () => toPng(views()), secondLane,
  get viewWidth() { return viewWidth; }, get frame() { return frame; }, get status() { return status; },
  get errorCount() { return errorCount; },
  /** Whether both views have a picture. */
  get hasPictures() { return Boolean(relief.heights && section.box); },
  /** Whether both pictures are of the current surface. */
  get hasCurrentPictures() { return pictures.areCurrent; },
};
