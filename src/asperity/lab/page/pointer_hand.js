// The hand: where the pointer, the keys or a motion want it.

const ABOVE = 5e-4; // m over the highest point while it does not press
const REACH = 0.09; // m that the hand goes from the middle
const MOTIONS = ["pointer", "stroke", "loop"];
const EVERY = 5; // ms between two changes at least

const held = (value, most) => Math.max(-most, Math.min(most, value));

export class Hand {
  constructor(say) {
    this.say = say;
    this.x = this.y = 0;
    this.z = null; // height that a cut asks for; else pressed or lifted
    this.press = 4e-4;
    this.pressed = false; // by the pointer
    this.latched = false; // by a key
    this.force = 1; // of a pen, around 1
    this.motion = "pointer";
    this.high = 0;
    this.stroke = 4e-3;
    this.loop = 5e-4; // m from the middle of a loop to its sides
    this.turn = 20; // rad/s
    this.sent = 0;
    this.last = 0;
    this.waiting = false;
  }

  get height() {
    if (this.z !== null) return this.z;
    return this.pressed || this.latched ? -this.press * this.force : this.high + ABOVE;
  }

  /** What does it, as set() takes it. */
  get kept() {
    const { motion, x, y, press, stroke, loop, turn } = this;
    return { motion, x, y, press, stroke, loop, turn, latched: false };
  }

  /** Do something else: fields of this object by name. */
  set(wanted) {
    Object.assign(this, { z: null, force: 1, pressed: false, ...wanted });
    this.request();
  }

  next() {
    this.motion = MOTIONS[(MOTIONS.indexOf(this.motion) + 1) % MOTIONS.length];
    this.request();
  }

  /** Return the points that are wanted: a point, or an ellipse. */
  path() {
    const none = [0, 0, 0], x = held(this.x, REACH), y = held(this.y, REACH);
    const still = { target: [x, y, held(this.height, 0.02)], cosine: none, sine: none, speed: 0 };
    if (this.motion === "stroke") {
      return { ...still, target: [x, y, -this.press], sine: [this.stroke, 0, 0], speed: 0.025 / this.stroke };
    }
    if (this.motion === "loop") {
      const deep = 0.6 * this.press;
      return { target: [x, y, -deep], cosine: [this.loop, 0, 0], sine: [0, 0, deep], speed: this.turn };
    }
    return still;
  }

  /** Say where the hand is wanted, now or as soon as it is time again; since when it is wanted [ms]. */
  request(since = performance.now()) {
    this.since = since;
    if (this.waiting) return;
    const wait = this.last + EVERY - performance.now();
    if (wait > 0) {
      this.waiting = true;
      setTimeout(() => { this.waiting = false; this.request(this.since); }, wait);
      return;
    }
    this.last = performance.now();
    if (this.say("steer", this.path())) this.sent++;
  }
}
