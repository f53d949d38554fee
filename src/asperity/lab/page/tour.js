// The guided tour: seven steps, each of which detects by itself whether its effect has occurred.

import { BUZZ_AMPLITUDE, ContactMetrics } from "./tactile_metrics.js";
import { formatQuantity } from "./format.js";

const TOUR_SETTINGS = { // the same surface, device and hand in all steps
  texture: "sinusoid:amplitude=0.4mm,period=2mm", device: "omega.3", delay: 1, max_depth: 8e-4,
  hand_stiffness: 800, hand_damping: 2.3,
  magnify: 1, magnify_height: 1, friction: 0,
};
const STROKE_PATH = 12e-3; // m, four strokes of the hand
const LOOP_PATH = 12e-3; // m, four loops of 2 mm back and forth, partly in contact
const LANDING_PATH = 1e-3; // m, after which the energy of the landing is discarded
const SUPPLIED_ENERGY = 1e-4; // J, which lifts the handle of 100 g by a tenth of a millimetre
const BUZZING_STIFFNESS = 8000; // N/m
const CLICK_COUNT = 3; // more than chance
const SOFT_FRACTION = 0.5; // of the wall's stiffness: the difference threshold of compliance is about 22 % (Tan, Durlach, Beauregard and Srinivasan, 1995)
const STIFF_FRACTION = 0.8; // of the nominal stiffness, measured in a trough

const FRICTION = 0.4; // of wood, about
const LAW_H_PARAMETERS = { continuity: 1 }; // with which the limit of law H is that of the wall
const TOUR_VIEW_WIDTH = 5e-3; // m of the surface: two and a half periods
const TROUGH = -5e-4, FLANK = 0; // x [m]
const PRESS_IN_TROUGH = { motion: "pointer", x: TROUGH, pressDepth: 8e-4, isLatched: true };
const PRESS_ON_FLANK = { ...PRESS_IN_TROUGH, x: 1.3e-3, pressDepth: 1e-3 };
const STROKE = { motion: "stroke", x: FLANK, pressDepth: 8e-4, strokeAmplitude: 1.5e-3, isLatched: false };
const LOOP = { motion: "loop", x: FLANK, pressDepth: 5e-4, loopRadius: 5e-4, loopSpeed: 8, isLatched: false };

const isBelowLimit = ({ settings, limit }) => Number.isFinite(limit.stiffness) && settings.stiffness <= limit.stiffness;
const isFarAboveLimit = ({ settings, limit }) => Number.isFinite(limit.stiffness) && settings.stiffness > 2 * limit.stiffness;
const formatRatio = (value, reference) => (value / reference).toPrecision(2).replace(/\.0$/, "");
const formatPercent = (value, reference) => `${(100 * value / reference).toFixed(0)}\u00a0%`;
const formatOf = (value, goal, unit) => `${formatQuantity(value, unit)} of ${formatQuantity(goal, unit)}`;
const handText = metrics => `the hand ${metrics.stillTime ? "holds still" : "moves"}`;

// Each check returns the progress of a task as text, as a fraction, and whether the effect has occurred.
const checkQuiet = ({ metrics, energyMeter, status }) => ({
  text: `stroked ${formatOf(metrics.pathLength, STROKE_PATH, "m")}; the force varies by ${formatQuantity(metrics.forceAmplitude, "N")} (a buzz: more than ${formatQuantity(BUZZ_AMPLITUDE, "N")})`,
  fraction: metrics.pathLength / STROKE_PATH,
  isDone: metrics.pathLength >= STROKE_PATH && metrics.forceAmplitude < BUZZ_AMPLITUDE && !metrics.clickCount
    && !energyMeter.suppliesEnergy && isBelowLimit(status),
  outcome: formatQuantity(metrics.forceAmplitude, "N"),
});
const checkNoEnergySupplied = ({ metrics, energyMeter, isSettled }) => ({
  text: `given ${formatQuantity(energyMeter.energy, "J")}; at most ${formatQuantity(energyMeter.samplingBound, "J")} by sampling; path ${formatOf(metrics.pathLength, LOOP_PATH, "m")}`,
  fraction: metrics.pathLength / LOOP_PATH,
  isDone: isSettled && metrics.pathLength >= LOOP_PATH && !energyMeter.suppliesEnergy && metrics.isFree,
});
const checkEnergySupplied = ({ energyMeter, isSettled }) => ({
  text: `given ${formatOf(energyMeter.energy, SUPPLIED_ENERGY, "J")}; at most ${formatQuantity(energyMeter.samplingBound, "J")} of it by sampling`,
  fraction: energyMeter.energy / SUPPLIED_ENERGY,
  isDone: isSettled && energyMeter.suppliesEnergy && energyMeter.energy >= SUPPLIED_ENERGY,
});
const checkFriction = ({ metrics, energyMeter, isSettled }) => ({
  text: `taken by friction ${formatOf(energyMeter.takenByFriction, SUPPLIED_ENERGY, "J")}; given ${formatQuantity(energyMeter.energy, "J")}`,
  fraction: energyMeter.takenByFriction / SUPPLIED_ENERGY,
  isDone: isSettled && metrics.isFree && energyMeter.takenByFriction >= SUPPLIED_ENERGY && !energyMeter.suppliesEnergy,
});
const checkBuzz = ({ metrics, status }) => ({
  text: `${handText(metrics)}; the force varies by ${formatOf(metrics.forceAmplitude, BUZZ_AMPLITUDE, "N")}`,
  fraction: metrics.stillTime ? metrics.forceAmplitude / BUZZ_AMPLITUDE : 0,
  isDone: metrics.stillTime > 1 && metrics.forceAmplitude > BUZZ_AMPLITUDE && isFarAboveLimit(status),
});
const checkClicks = ({ metrics }) => ({
  text: `${metrics.clickCount} of ${CLICK_COUNT} clicks`,
  fraction: metrics.clickCount / CLICK_COUNT,
  isDone: metrics.clickCount >= CLICK_COUNT,
});
const checkNoClicks = ({ metrics }) => ({
  text: `stroked ${formatOf(metrics.pathLength, STROKE_PATH, "m")}; clicks: ${metrics.clickCount}`,
  fraction: metrics.pathLength / STROKE_PATH,
  isDone: metrics.pathLength >= STROKE_PATH && metrics.clickCount === 0,
});
const checkStiff = ({ metrics, status }) => ({
  text: `${handText(metrics)}; felt: ${formatQuantity(metrics.feltStiffness, "N/m")}`,
  fraction: metrics.stillTime,
  isDone: metrics.feltStiffness >= STIFF_FRACTION * status.settings.stiffness && isBelowLimit(status),
  reference: metrics.feltStiffness,
});
const checkSoft = ({ metrics, status, reference }) => ({
  text: `felt: ${formatQuantity(metrics.feltStiffness, "N/m")}; the wall: ${formatQuantity(reference, "N/m")}`,
  fraction: metrics.stillTime,
  isDone: metrics.feltStiffness > 0 && metrics.feltStiffness < SOFT_FRACTION * reference && isBelowLimit(status),
  outcome: formatRatio(reference, metrics.feltStiffness),
});

export const STEPS = [
  {
    title: "W is quiet", watch: "The traces: a flat force. The energy: the hand is not fed.",
    explanation: "The smooth wall is the reference. It pushes straight up, in proportion to the depth of the probe: no texture, and no buzz.",
    result: variation => `The wall was stroked, and the force varied by ${variation}: less than a buzz.`,
    tasks: [{ law: "W", stiffness: 1500, instruction: "Stroke the wall: hold the pointer down on the surface and move it back and forth.", demo: STROKE, evaluate: checkQuiet }],
  }, {
    title: "A feels alive", watch: "The energy given to the hand: it grows with every loop, and turns red.",
    explanation: "Law A pushes straight up by the depth below the groove, without pushing sideways. Such a field has curl: a probe that moves down on one flank and up on the other gains energy.",
    result: "The field has fed the hand, by more than sampling and quantisation explain: it feels alive.",
    showsItself: true, // the pointer is moved straight, which shows nothing
    tasks: [{ law: "A", stiffness: 1500, instruction: "Watch the hand move in small loops on a slope; then “Try it”: in the section, move the pointer right, down, left and up again.", demo: LOOP, evaluate: checkEnergySupplied }],
  }, {
    title: "B buzzes above its limit", watch: "The mark at the stiffness, and the band of the force: it oscillates while the hand is still.",
    explanation: ({ B, W }) => `Law B rotates the force to the surface normal. On a curved surface its lateral stiffness exceeds the nominal one: its limit is ${!B ? "below the wall's" : `${formatQuantity(B, "N/m")}${W ? `, ${formatPercent(B, W)} of the wall's` : ""}`}, and here it is set to ${formatQuantity(BUZZING_STIFFNESS, "N/m")}${B ? `, ${formatRatio(BUZZING_STIFFNESS, B)} times that` : ""}.`,
    result: "The hand is still, and the force oscillates: a buzz.",
    tasks: [{ law: "B", stiffness: BUZZING_STIFFNESS, instruction: "Press on a slope, and hold still.", demo: PRESS_ON_FLANK, evaluate: checkBuzz }],
  }, {
    title: "D clicks", watch: "The dot, the closest point: it jumps from one flank to the other, and the lateral force with it.",
    explanation: "Law D, the god-object, pulls to the closest point of the surface. Below a crest two points are equally close, and a lateral step switches between them.",
    result: "Within one sample the force jumped by more than the stiffness explains: a click at each crest.",
    tasks: [{ law: "D", stiffness: 1000, instruction: "Press deep, and stroke across the crests.", demo: STROKE, evaluate: checkClicks }],
  }, {
    title: "C is soft", watch: "The section: the depth reached with the same push.",
    explanation: ({ C, W }) => `Law C has no curl and no jumps. But it stiffens where the surface is curved, and its limit is ${C && W ? `${formatQuantity(C, "N/m")}, ${formatPercent(C, W)} of the wall's` : "below the wall's"}: below that limit it is soft.`,
    result: ratio => `Near its limit, law C yields ${ratio} times as much as the wall.`,
    tasks: [
      { law: "W", stiffness: 1600, usesPlane: true, instruction: "First the wall, near its limit: press, and hold still.", demo: PRESS_IN_TROUGH, evaluate: checkStiff },
      { law: "C", stiffness: 480, instruction: "Now law C, near its own limit: press in a trough, and hold still.", demo: PRESS_IN_TROUGH, evaluate: checkSoft },
    ],
  }, {
    title: "H avoids all of these", watch: "No energy, no click, no buzz, and the stiffness of the wall.",
    explanation: "Law H splits the god-object: between two equally close points it pulls to a point between them. No curl, no jump, and the limit of the wall.",
    result: "As stiff as the wall, without energy gain, clicks or buzz.",
    tasks: [
      { law: "H", stiffness: 1600, parameters: LAW_H_PARAMETERS, instruction: "Press in a trough, and hold still: it is as stiff as the wall, and does not buzz.", demo: PRESS_IN_TROUGH, evaluate: checkStiff },
      { law: "H", stiffness: 1500, parameters: LAW_H_PARAMETERS, instruction: "Move in loops on a slope, as with law A.", demo: LOOP, evaluate: checkNoEnergySupplied },
      { law: "H", stiffness: 1500, parameters: LAW_H_PARAMETERS, instruction: "Stroke deep across the crests, as with law D.", demo: STROKE, evaluate: checkNoClicks },
    ],
  }, {
    title: "Friction takes energy", watch: "The square, the anchor of friction: it sticks, then slides behind the probe. The energy taken by friction grows; that given to the hand does not.",
    explanation: `Without friction, law H feels like ice. Here its friction is ${FRICTION}, with a spring of constant stiffness to the anchor: on every closed path it takes energy, whatever the texture does.`,
    result: "Friction took energy, and gave none.",
    tasks: [{ law: "H", stiffness: 1500, parameters: { ...LAW_H_PARAMETERS, friction: FRICTION }, instruction: "Press, move in loops, and lift.", demo: LOOP, evaluate: checkFriction }],
  },
];

/** Return a text; a function computes it from measured values. */
const resolveText = (text, values) => (typeof text === "function" ? text(values) : text);

export class Tour {
  /** @param host object with changeScene(changes), hand, energyMeter, status, and viewWidth [m] */
  constructor(host) {
    this.host = host;
    this.metrics = new ContactMetrics();
    this.stepIndex = -1; // not active
    this.isDemo = false; // whether the hand moves by itself
    this.wasDemoRequested = false; // by the user, for this step and those after it
    this.completedSteps = STEPS.map(() => false);
    this.previous = null; // view and motion before the tour
    this.limits = {}; // stability limits of the laws on this surface, as received [N/m]
  }

  get isActive() { return this.stepIndex >= 0; }
  get step() { return STEPS[this.stepIndex]; }
  get task() { return this.step?.tasks[Math.min(this.taskIndex, this.step.tasks.length - 1)]; }
  get requiredSettings() {
    const { law, stiffness, parameters } = this.task;
    return { ...TOUR_SETTINGS, law, stiffness, ...parameters };
  }

  get explanation() { return resolveText(this.step.explanation, this.limits); }
  get resultText() { return resolveText(this.step.result, this.outcome); }

  get isStepCompleted() { return this.isActive && this.completedSteps[this.stepIndex]; }

  start() {
    const { host } = this;
    if (!this.isActive) this.previous = { viewWidth: host.viewWidth, motion: host.hand.motionSettings };
    this.completedSteps.fill(false);
    host.viewWidth = TOUR_VIEW_WIDTH;
    // The server saves the current scene, and builds that of the tour whatever the hand was.
    this.initialStartCount = host.status.start_count;
    host.changeScene({ saved_scene: "tour", ...TOUR_SETTINGS });
    this.goTo(0);
  }

  end() {
    if (!this.isActive) return;
    this.stepIndex = -1;
    this.setDemo(false);
    this.host.viewWidth = this.previous.viewWidth;
    this.host.hand.setMotion(this.previous.motion);
    this.host.changeScene({ saved_scene: "previous" });
  }

  goTo(stepIndex) {
    if (stepIndex < 0 || stepIndex >= STEPS.length) return;
    this.stepIndex = stepIndex;
    this.completedSteps[stepIndex] = false;
    this.reference = 0;
    this.isDemo = this.wasDemoRequested || Boolean(this.step.showsItself);
    this.startTask(0);
  }

  startTask(taskIndex) {
    this.taskIndex = taskIndex;
    this.progress = null;
    const { law, stiffness, ...others } = this.requiredSettings, { settings, start_count: startCount } = this.host.status;
    // Settings of the tour may restart the loop: they are repeated only if they differ once the loop of
    // the tour runs. Parameters of the task are always set.
    const hasTourScene = startCount !== this.initialStartCount;
    const needed = Object.entries(others).filter(([name, value]) => !(name in TOUR_SETTINGS) || hasTourScene && settings[name] !== value);
    this.host.changeScene({ ...Object.fromEntries(needed), law, stiffness });
    this.stopHand();
    this.metrics.reset();
    this.host.energyMeter.reset();
    this.wasFree = this.hasLanded = false;
  }

  /** Let the hand follow the pointer, not pressed. */
  stopHand() {
    const { hand } = this.host;
    hand.motion = "pointer";
    hand.isLatched = false;
    hand.requestMotion();
  }

  /** Let the hand move by itself, or no longer. */
  setDemo(isOn = !this.isDemo) {
    this.isDemo = this.wasDemoRequested = isOn && this.isActive;
    if (this.isActive && !isOn) this.stopHand();
    this.hasDemoStarted = false;
  }

  /** Whether the loop runs with the settings of the task. */
  get isReady() {
    const { status } = this.host;
    return status?.state === "running" && Object.entries(this.requiredSettings).every(([name, value]) => status.settings[name] === value);
  }

  /** Evaluate the task with a frame of the loop. */
  addFrame(frame, columns) {
    if (!this.isActive) return;
    // The progress of a completed step stays that at its completion, as its result does.
    if (!this.isStepCompleted) this.progress = null;
    if (!this.isReady) { this.metrics.reset(); this.hasDemoStarted = false; return; }
    const { hand, energyMeter, status } = this.host;
    if (status.limit.stiffness) this.limits[status.settings.law] = status.limit.stiffness;
    // A task starts with a free probe, so that energy stored before does not count.
    if (!this.wasFree) this.wasFree = frame.newest[columns.inside] === 0;
    if (!this.wasFree) return;
    if (this.isDemo && !this.hasDemoStarted) { this.hasDemoStarted = true; hand.setMotion(this.task.demo); }
    this.metrics.addFrame(frame, columns, status, this.task.usesPlane);
    if (!this.hasLanded && this.metrics.pathLength > LANDING_PATH) { this.hasLanded = true; energyMeter.reset(); }
    const isSettled = this.hasLanded && !energyMeter.awaitsFreeProbe;
    if (this.isStepCompleted) return;
    this.progress = this.task.evaluate({ metrics: this.metrics, energyMeter, status, isSettled, reference: this.reference });
    if (this.progress.isDone) this.completeTask();
  }

  completeTask() {
    this.reference = this.progress.reference ?? this.reference;
    this.outcome = this.progress.outcome;
    this.hasDemoStarted = false;
    if (this.taskIndex + 1 < this.step.tasks.length) this.startTask(this.taskIndex + 1);
    else this.completedSteps[this.stepIndex] = true;
  }
}
