// The hand of the simulated device: it follows the pointer or the keys, or moves periodically.

const LIFT_HEIGHT = 5e-4; // m above the highest point of the surface while not pressing
const MAX_REACH = 0.09; // m from the origin
const MAX_HEIGHT = 0.02; // m above or below the plane z = 0
const MOTIONS = ["pointer", "stroke", "loop"];
const REQUEST_INTERVAL = 5; // least interval of two requests [ms]
const STROKE_SPEED = 0.025; // greatest speed of a stroke [m/s]

const clamp = (value, limit) => Math.max(-limit, Math.min(limit, value));

export class PointerHand {
  /** @param send sends a message to the server; returns whether it was sent */
  constructor(send) {
    this.send = send;
    this.x = this.y = 0;
    this.z = null; // height requested in the section; null if the hand is either pressed or lifted
    this.pressDepth = 4e-4;
    this.isPressed = false; // by the pointer
    this.isLatched = false; // pressed by a key
    this.pressure = 1; // of a pen, relative to a medium pressure
    this.motion = "pointer";
    this.surfaceHeight = 0; // highest point of the surface [m]
    this.strokeAmplitude = 4e-3;
    this.loopRadius = 5e-4; // m along x
    this.loopSpeed = 20; // rad/s, counterclockwise
    this.requestCount = 0;
    this.lastRequestTime = 0;
    this.isRequestPending = false;
  }

  get height() {
    if (this.z !== null) return this.z;
    return this.isPressed || this.isLatched ? -this.pressDepth * this.pressure : this.surfaceHeight + LIFT_HEIGHT;
  }

  /** The current motion, to be restored by setMotion(). */
  get motionSettings() {
    const { motion, x, y, pressDepth, strokeAmplitude, loopRadius, loopSpeed } = this;
    return { motion, x, y, pressDepth, strokeAmplitude, loopRadius, loopSpeed, isLatched: false };
  }

  /** Start another motion, given by properties of this object. */
  setMotion(settings) {
    Object.assign(this, { z: null, pressure: 1, isPressed: false, ...settings });
    this.requestMotion();
  }

  get nextMotion() { return MOTIONS[(MOTIONS.indexOf(this.motion) + 1) % MOTIONS.length]; }

  /** Centre and radii of the loops in the x-z plane [m]. */
  get loop() {
    const radiusZ = 0.6 * this.pressDepth;
    return { x: clamp(this.x, MAX_REACH), z: -radiusZ, radiusX: this.loopRadius, radiusZ };
  }

  /** Greatest distance from the middle of a periodic motion [m]; 0 of another one. */
  get reach() { return { stroke: this.strokeAmplitude, loop: this.loopRadius }[this.motion] ?? 0; }

  /** Return the requested trajectory, target + cosine cos(speed t) + sine sin(speed t): a point or an ellipse. */
  trajectory() {
    const none = [0, 0, 0], x = clamp(this.x, MAX_REACH), y = clamp(this.y, MAX_REACH);
    const point = { target: [x, y, clamp(this.height, MAX_HEIGHT)], cosine: none, sine: none, speed: 0 };
    if (this.motion === "stroke") {
      const speed = STROKE_SPEED / this.strokeAmplitude;
      return { ...point, target: [x, y, -this.pressDepth], sine: [this.strokeAmplitude, 0, 0], speed };
    }
    if (this.motion === "loop") {
      const { z, radiusX, radiusZ } = this.loop;
      return { target: [x, y, z], cosine: [radiusX, 0, 0], sine: [0, 0, radiusZ], speed: this.loopSpeed };
    }
    return point;
  }

  /** Send the trajectory to the server, now or once the least interval has passed. */
  requestMotion() {
    if (this.isRequestPending) return;
    const delay = this.lastRequestTime + REQUEST_INTERVAL - performance.now();
    if (delay > 0) {
      this.isRequestPending = true;
      setTimeout(() => { this.isRequestPending = false; this.requestMotion(); }, delay);
      return;
    }
    this.lastRequestTime = performance.now();
    if (this.send("steer", this.trajectory())) this.requestCount++;
  }
}
