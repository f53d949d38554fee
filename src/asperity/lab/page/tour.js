// The guided tour: six steps, each of which finds by itself that its effect has occurred.

import { BUZZ, Gauge } from "./tactile_metrics.js";
import { quantity } from "./format.js";

const STAGE = { // of all steps: the same hand holds the same surface on the same device
  texture: "sinusoid:amplitude=0.4mm,period=2mm", device: "omega.3", delay: 1, max_depth: 8e-4,
  hand_stiffness: 800, hand_damping: 2.3,
  magnify: 1, magnify_height: 1,
};
const STROKED = 12e-3; // m, four strokes of the hand
const LOOPED = 12e-3; // m, four loops: each is 2 mm wide, to and fro, partly in contact
const LANDED = 1e-3; // m of way after which the energy of the landing is over
const GIVEN = 1e-4; // J, enough to lift the handle of 100 g by a tenth of a millimetre
const BUZZING = 8000; // N/m
const CLICKS = 3; // not one by chance
const SOFTER = 0.5; // of the wall's: hands tell compliances apart from about 22 % (Tan, Durlach, Beauregard and Srinivasan, 1995)
const HELD = 0.8; // of the stiffness that is set, felt in a trough

const SPLIT = { continuity: 1 }; // with which the limit of H is the wall's
const SEEN = 5e-3; // m of the surface: two periods and a half
const TROUGH = -5e-4, FLANK = 0; // m
const press = { motion: "pointer", x: TROUGH, press: 8e-4, latched: true };
const pressFlank = { ...press, x: 1.3e-3, press: 1e-3 };
const stroke = { motion: "stroke", x: FLANK, press: 8e-4, stroke: 1.5e-3, latched: false };
const loop = { motion: "loop", x: FLANK, press: 5e-4, loop: 5e-4, turn: 8, latched: false };

const below = ({ news }) => Number.isFinite(news.limit.stiffness) && news.settings.stiffness <= news.limit.stiffness;
const above = ({ news }) => Number.isFinite(news.limit.stiffness) && news.settings.stiffness > 2 * news.limit.stiffness;
const times = (value, of) => (value / of).toPrecision(2).replace(/\.0$/, "");
const percent = (value, of) => `${(100 * value / of).toFixed(0)}\u00a0%`;
const at = (value, goal, unit) => `${quantity(value, unit)} of ${quantity(goal, unit)}`;

// What an act asks for, and what of it is seen: words, how much of it is done, and whether it has happened.
const quiet = g => ({
  words: `stroked ${at(g.gauge.way, STROKED, "m")}; the force varies by ${quantity(g.gauge.swing, "N")}`,
  share: g.gauge.way / STROKED,
  done: g.gauge.way >= STROKED && g.gauge.swing < BUZZ && !g.gauge.clicks && !g.ledger.fed && below(g),
});
const unfed = g => ({
  words: `given ${quantity(g.ledger.energy, "J")}; at most ${quantity(g.ledger.sampled, "J")} by sampling; path ${at(g.gauge.way, LOOPED, "m")}`,
  share: g.gauge.way / LOOPED, done: g.landed && g.gauge.way >= LOOPED && !g.ledger.fed && g.gauge.free,
});
const fed = g => ({
  words: `given ${at(g.ledger.energy, GIVEN, "J")}; at most ${quantity(g.ledger.sampled, "J")} of it by sampling`,
  share: g.ledger.energy / GIVEN, done: g.landed && g.ledger.fed && g.ledger.energy >= GIVEN,
});
const buzzes = g => ({
  words: `the hand ${g.gauge.still ? "holds still" : "moves"}; the force varies by ${at(g.gauge.swing, BUZZ, "N")}`,
  share: g.gauge.still ? g.gauge.swing / BUZZ : 0, done: g.gauge.still > 1 && g.gauge.swing > BUZZ && above(g),
});
const clicks = g => ({
  words: `${g.gauge.clicks} of ${CLICKS} clicks`, share: g.gauge.clicks / CLICKS, done: g.gauge.clicks >= CLICKS,
});
const unclicked = g => ({
  words: `stroked ${at(g.gauge.way, STROKED, "m")}; clicks: ${g.gauge.clicks}`, share: g.gauge.way / STROKED,
  done: g.gauge.way >= STROKED && g.gauge.clicks === 0,
});
const firm = g => ({
  words: `the hand ${g.gauge.still ? "holds still" : "moves"}; felt: ${quantity(g.gauge.felt, "N/m")}`,
  share: g.gauge.still, done: g.gauge.felt >= HELD * g.news.settings.stiffness && below(g),
  keep: g.gauge.felt,
});
const soft = g => ({
  words: `felt: ${quantity(g.gauge.felt, "N/m")}; the wall: ${quantity(g.kept, "N/m")}`,
  share: g.gauge.still, done: g.gauge.felt > 0 && g.gauge.felt < SOFTER * g.kept && below(g), seen: times(g.kept, g.gauge.felt),
});

export const STEPS = [
  {
    title: "W is quiet", watch: "The traces: a flat force. The energy: not fed.",
    why: "The smooth wall is the reference. It pushes straight up, in proportion to the depth of the probe: no texture, and no buzz.",
    found: "The wall was stroked, and the force did not oscillate.",
    acts: [{ law: "W", stiffness: 1500, ask: "Stroke the wall: hold the pointer down on the surface and move it back and forth.", show: stroke, judge: quiet }],
  }, {
    title: "A feels alive", watch: "The energy given to the hand: it grows with every loop, and turns red.",
    why: "Law A pushes straight up by the depth below the groove, without pushing sideways. Such a field has curl: a probe that moves down on one flank and up on the other gains energy.",
    found: "The field has fed the hand, by more than sampling and quantisation explain. A surface that supplies energy feels alive.",
    acts: [{ law: "A", stiffness: 1500, ask: "Move in small loops on a slope: in the section, move the pointer right, down, left and up again.", show: loop, judge: fed }],
  }, {
    title: "B buzzes above its limit", watch: "The mark at the stiffness, and the band of the force: it oscillates while the hand is still.",
    why: ({ B, W }) => `Law B rotates the force to the surface normal. On a curved surface its lateral stiffness exceeds the nominal one: its limit is ${!B ? "below the wall's" : `${quantity(B, "N/m")}${W ? `, ${percent(B, W)} of the wall's` : ""}`}, and here it is set to ${quantity(BUZZING, "N/m")}${B ? `, ${times(BUZZING, B)} times that` : ""}.`,
    found: "The hand is still, and the force oscillates: a buzz.",
    acts: [{ law: "B", stiffness: BUZZING, ask: "Press on a slope, and hold still.", show: pressFlank, judge: buzzes }],
  }, {
    title: "D clicks", watch: "The dot, the closest point: it jumps from one flank to the other, and the lateral force with it.",
    why: "Law D, the god-object, pulls to the closest point of the surface. Below a crest two points are equally close, and a lateral step switches between them.",
    found: "Within one sample the force jumped by more than the stiffness explains: a click at each crest.",
    acts: [{ law: "D", stiffness: 1000, ask: "Press deep, and stroke across the crests.", show: stroke, judge: clicks }],
  }, {
    title: "C is soft", watch: "The section: the depth reached with the same push.",
    why: ({ C, W }) => `Law C has no curl and no jumps. But it stiffens where the surface is curved, and its limit is ${C && W ? `${quantity(C, "N/m")}, ${percent(C, W)} of the wall's` : "below the wall's"}: below that limit it is soft.`,
    found: seen => `Near its limit, law C yields ${seen} times as much as the wall.`,
    acts: [
      { law: "W", stiffness: 4500, plane: true, ask: "First the wall, near its limit: press, and hold still.", show: press, judge: firm },
      { law: "C", stiffness: 1350, ask: "Now law C, near its own limit: press in a trough, and hold still.", show: press, judge: soft },
    ],
  }, {
    title: "H avoids all of these", watch: "No energy, no click, no buzz, and the stiffness of the wall.",
    why: "Law H splits the god-object: between two equally close points it pulls to a point between them. No curl, no jump, and the limit of the wall.",
    found: "As stiff as the wall, without energy gain, clicks or buzz.",
    acts: [
      { law: "H", stiffness: 4500, also: SPLIT, ask: "Press in a trough, and hold still: it is as stiff as the wall, and does not buzz.", show: press, judge: firm },
      { law: "H", stiffness: 1500, also: SPLIT, ask: "Move in loops on a slope, as with law A.", show: loop, judge: unfed },
      { law: "H", stiffness: 1500, also: SPLIT, ask: "Stroke deep across the crests, as with law D.", show: stroke, judge: unclicked },
    ],
  },
];

/** Return words, of numbers that were seen where they tell of any. */
const said = (words, seen) => (typeof words === "function" ? words(seen) : words);

export class Tour {
  /** @param host object with change(changes), hand, ledger, news and span, the width of what is seen */
  constructor(host) {
    this.host = host;
    this.gauge = new Gauge();
    this.step = -1; // none
    this.shows = false;
    this.seen = STEPS.map(() => false);
    this.before = null;
    this.limits = {}; // of laws on this stage, as received [N/m]
  }

  get on() { return this.step >= 0; }
  get now() { return STEPS[this.step]; }
  get act() { return this.now?.acts[Math.min(this.turn, this.now.acts.length - 1)]; }
  get wanted() {
    const { law, stiffness, also } = this.act;
    return { ...STAGE, law, stiffness, ...also };
  }

  /** What the step tells: of limits, once they are known, and what was measured. */
  get why() { return said(this.now.why, this.limits); }
  get told() { return said(this.now.found, this.measured); }

  get found() { return this.on && this.seen[this.step]; }

  begin() {
    if (!this.on) this.before = { span: this.host.span, hand: this.host.hand.kept };
    this.seen.fill(false);
    this.host.span = SEEN;
    // The lab keeps what is shown, and sets up what the steps begin with, whatever hand there was.
    this.since = this.host.news.starts;
    this.host.change({ stage: "tour", ...STAGE });
    this.go(0);
  }

  end() {
    if (!this.on) return;
    this.step = -1;
    this.show(false);
    this.host.span = this.before.span;
    this.host.hand.set(this.before.hand);
    this.host.change({ stage: "back" });
  }

  go(step) {
    if (step < 0 || step >= STEPS.length) return;
    this.step = step;
    this.seen[step] = false;
    this.kept = 0;
    this.start(0);
  }

  start(turn) {
    this.turn = turn;
    const { law, stiffness, ...stage } = this.wanted, { settings, starts } = this.host.news;
    // What takes another loop is asked for only if it must, and not while it is on its way; what a step sets, always.
    const known = starts !== this.since;
    const others = Object.entries(stage).filter(([name, value]) => !(name in STAGE) || known && settings[name] !== value);
    this.host.change({ ...Object.fromEntries(others), law, stiffness });
    this.host.hand.motion = "pointer";
    this.host.hand.latched = false;
    this.host.hand.request();
    this.gauge.begin();
    this.host.ledger.clear();
    this.free = this.landed = false;
  }

  /** Let the hand move by itself, or no more. */
  show(on = !this.shows) {
    this.shows = on && this.on;
    if (this.on && !on) { this.host.hand.latched = false; this.host.hand.motion = "pointer"; this.host.hand.request(); }
    this.shown = false;
  }

  get ready() {
    const { news } = this.host;
    return news?.state === "running" && Object.entries(this.wanted).every(([name, value]) => news.settings[name] === value);
  }

  take(frame, columns) {
    if (!this.on) return;
    this.result = null;
    if (!this.ready) { this.gauge.begin(); this.shown = false; return; }
    const { settings, limit } = this.host.news;
    if (limit.stiffness) this.limits[settings.law] = limit.stiffness;
    // Each act begins with the probe in the air: what was stored before counts for nothing.
    if (!this.free) this.free = frame.newest[columns.inside] === 0;
    if (!this.free) return;
    if (this.shows && !this.shown) { this.shown = true; this.host.hand.set(this.act.show); }
    this.gauge.take(frame, columns, this.host.news, this.act.plane);
    if (!this.landed && this.gauge.way > LANDED) { this.landed = true; this.host.ledger.clear(); }
    const { ledger, news } = this.host, landed = this.landed && !ledger.waits;
    this.result = this.act.judge({ gauge: this.gauge, ledger, news, landed, kept: this.kept });
    if (!this.result.done || this.found) return;
    this.kept = this.result.keep ?? this.kept;
    this.measured = this.result.seen;
    this.shown = false;
    if (this.turn + 1 < this.now.acts.length) this.start(this.turn + 1);
    else this.seen[this.step] = true;
  }
}
