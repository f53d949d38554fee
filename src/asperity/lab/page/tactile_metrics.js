// What the frames show of a law, as numbers: energy fed, buzz, clicks, softness. Each has its threshold, and why.

const NOTICED = 0.01; // N of an oscillating force that a hand notices; the same as asperity.analysis.limits.perceptibility
export const BUZZ = 15 * NOTICED; // N: no doubt that it is felt, and above what the encoder's steps make of a wall's force
export const CLICK = 20 * NOTICED; // N in one sample
const STEEPER = 4; // times the law's stiffness: what jumps more in a sample is no steep slope
const DEEP = 1e-5; // m below which a depth is too small for a stiffness
const FED = 2e-6; // J: less is a rounding
const STILL = 1e-6; // m that the anchor of a hand that holds still moves from frame to frame
const WINDOW = 0.6; // s over which a force is watched
const HOP = 0.1; // s: a probe that is in the air for less is still being pressed, and bounces

/** The energy that the hand was given since the probe was last free, and how much of it sampling and steps explain. */
export class Ledger {
  constructor() { this.clear(); this.waits = false; }

  /** Reset energy, from the next time that the probe is free, until then from the next frame. */
  clear() { this.waits = true; this.base = null; this.energy = this.sampled = 0; }

  /**
   * Take a frame. A field without curl, read in steps of the encoder, sampled, held and late by d samples,
   * gives a hand at most k (q⁺/2 + d q) Σ|Δp|² + φ Σ|Δp|, with φ = k q |δ|/2 + |b|/2 of the steps δ of the
   * position and b of the force, in any motion (docs/theory/passivity). More than that is fed by the field.
   */
  take(frame, columns, news) {
    const { rows, way, squares, newest } = frame, { settings, limit, step, force_step: forceStep } = news;
    const given = newest[columns.supplied];
    this.base ??= given;
    if (frame.greatest[columns.inside]) {
      const q = limit.q === "inf" ? Infinity : limit.q ?? 1, k = settings.stiffness, diagonal = 0.5 * Math.sqrt(3);
      const late = settings.delay ? settings.delay * q : 0, steps = step ? k * q * diagonal * step : 0;
      const bound = k * (0.5 * (limit.one_sided ?? 1) + late) * squares + (steps + diagonal * forceStep) * way;
      this.sampled += bound * rows / Math.max(rows - 1, 1); // the step from the frame before is like the others
    }
    if (this.waits && !newest[columns.inside]) { this.waits = false; this.base = given; this.sampled = 0; }
    this.energy = given - this.base;
  }

  get fed() { return this.energy > Math.max(FED, this.sampled); }

  get words() {
    if (this.fed) return "⚠ the field has fed the hand";
    return this.energy > FED ? "no more than sampling and steps explain" : "the hand was not fed";
  }
}

/** What was seen since it was begun. */
export class Gauge {
  constructor() { this.begin(); }

  begin() {
    Object.assign(this, { way: 0, clicks: 0, still: 0, swing: 0, span: 0, felt: 0, frames: [], before: null, touched: -1, free: true });
  }

  /**
   * Take a frame; what comes with a change of the law is left out.
   * @param plane whether depth is that below the plane z = 0, not that below the texture
   */
  take(frame, columns, { settings, step }, plane = false) {
    const { newest, least, greatest, hand, god } = frame, at = name => newest[columns[name]];
    const inside = least[columns.inside] === 1, before = this.before, time = at("time");
    this.before = { hand: [...hand], x: at("x"), y: at("y"), time };
    if (!before || least[columns.share] < 1) { this.frames = []; return; }
    const moved = Math.hypot(...hand.map((value, k) => value - before.hand[k]));
    if (greatest[columns.inside] === 1) this.touched = time;
    this.free = time - this.touched > HOP;
    if (inside) this.way += Math.hypot(at("x") - before.x, at("y") - before.y);
    this.still = !this.free && moved < STILL ? this.still + time - before.time : 0;
    if (frame.jump > CLICK && frame.jump > STEEPER * settings.stiffness * (frame.moved + step) && inside) this.clicks++;
    this.watch(time, columns, least, greatest);
    const force = Math.hypot(at("applied x"), at("applied y"), at("applied z"));
    const deep = plane ? -at("z") : Math.hypot(at("x") - god[0], at("y") - god[1], at("z") - god[2]);
    // Stiffness as it is felt: force for depth, at rest.
    this.felt = this.still > WINDOW && this.swing < BUZZ && force > 5 * NOTICED && deep > DEEP ? force / deep : 0;
  }

  /** How far the force goes to and fro within the window; known once it was in contact for as long. */
  watch(time, columns, least, greatest) {
    const sides = ["applied x", "applied y", "applied z"].map(name => [least[columns[name]], greatest[columns[name]]]);
    this.frames = !this.free ? [...this.frames.filter(([then]) => then > time - WINDOW), [time, sides]] : [];
    this.span = this.frames.length ? time - this.frames[0][0] : 0;
    if (this.span < 0.8 * WINDOW) { this.swing = 0; return; }
    const swings = [0, 1, 2].map(k => 0.5 * (Math.max(...this.frames.map(([, side]) => side[k][1]))
      - Math.min(...this.frames.map(([, side]) => side[k][0]))));
    this.swing = Math.hypot(...swings);
  }
}
