// Metrics of the frames: energy supplied to the hand, buzz, clicks and stiffness, each with its threshold.

export const PERCEPTION_THRESHOLD = 0.01; // N of an oscillating force, assumed
export const BUZZ_AMPLITUDE = 15 * PERCEPTION_THRESHOLD; // N: clearly felt, and above the effect of encoder steps at a wall
export const CLICK_FORCE = 20 * PERCEPTION_THRESHOLD; // N in one sample
const CLICK_STEEPNESS = 4; // times the stiffness of the law: a smaller change in one sample may be a steep slope
const MIN_DEPTH = 1e-5; // m, below which a stiffness cannot be determined
const MIN_ENERGY = 2e-6; // J, above the rounding errors
const STILL_DISTANCE = 1e-6; // m per frame, below which the anchor of the hand is at rest
const WINDOW = 0.6; // s over which an oscillation is observed
const MAX_BOUNCE = 0.1; // s: a probe that leaves the surface for less is still pressed

/** Energy supplied to the hand since the reset or, unless it was fed before, since the probe was first free, and how much of it sampling and quantisation explain. */
export class EnergyMeter {
  constructor() { this.reset(); this.awaitsFreeProbe = false; }

  /** Reset the energy at the next frame, and again at the next frame with a free probe unless it was fed by then. */
  reset() {
    this.awaitsFreeProbe = true;
    this.offset = null; // of the supplied energy
    this.energy = this.samplingBound = this.storedEnergy = 0;
    this.takenByFriction = 0; // J, by the slip of its anchor
  }

  /**
   * Add a frame. A field without curl that is evaluated at quantised positions, sampled, held and
   * delayed by d samples supplies a hand with at most k (q⁺/2 + d q) Σ|Δp|² + φ Σ|Δp|, where
   * φ = k q |δ|/2 + |b|/2 for the resolutions δ of position and b of force, in any motion
   * (docs/theory/passivity). Friction adds κ (3 d + 1)/2 to the stiffness, and 2 κ |δ|/2 to φ, with delay 10 κ |δ|/2.
   * Any further energy is due to the curl of the field.
   */
  addFrame(frame, columns, status) {
    const { rowCount, pathLength, squaredSteps, newest } = frame, { settings, limit } = status;
    const { position_resolution: positionResolution, force_resolution: forceResolution } = status;
    const supplied = newest[columns.supplied], kappa = status.friction?.presliding_stiffness ?? 0;
    this.takenByFriction += kappa * frame.anchorSlip * rowCount / Math.max(rowCount - 1, 1);
    this.offset ??= supplied;
    if (frame.maxima[columns.inside]) {
      const q = limit.q === "inf" ? Infinity : limit.q ?? 1, k = settings.stiffness, halfDiagonal = 0.5 * Math.sqrt(3);
      const delayTerm = settings.delay ? settings.delay * q : 0;
      const steps = k * q + kappa * (settings.delay ? 10 : 2), quantisation = positionResolution ? steps * halfDiagonal * positionResolution : 0;
      const stiffness = k * (0.5 * (limit.one_sided ?? 1) + delayTerm) + kappa * (3 * settings.delay + 1) / 2;
      const bound = stiffness * squaredSteps + (quantisation + halfDiagonal * forceResolution) * pathLength;
      this.samplingBound += bound * rowCount / Math.max(rowCount - 1, 1); // includes the step from the previous frame
    }
    // A wall that was pressed at the reset may give back what it stored, f²/(2k) at most.
    const force = Math.hypot(...["applied x", "applied y", "applied z"].map(name => newest[columns[name]]));
    if (this.awaitsFreeProbe) this.storedEnergy = Math.max(this.storedEnergy, 0.5 * force ** 2 / Math.min(settings.stiffness, kappa || Infinity));
    if (this.awaitsFreeProbe && !newest[columns.inside]) {
      this.awaitsFreeProbe = false;
      if (!this.suppliesEnergy) {
        this.offset = supplied;
        this.samplingBound = this.storedEnergy = 0;
      }
    }
    this.energy = supplied - this.offset - this.storedEnergy;
  }

  get suppliesEnergy() { return this.energy > Math.max(MIN_ENERGY, this.samplingBound); }

  get verdict() {
    if (this.suppliesEnergy) return "⚠ the field has fed the hand";
    return this.energy > MIN_ENERGY ? "no more than sampling and quantisation explain" : "the hand was not fed";
  }
}

/** Path, clicks, oscillation and stiffness since the last reset. */
export class ContactMetrics {
  constructor() { this.reset(); }

  reset() {
    Object.assign(this, {
      pathLength: 0, // in contact [m]
      clickCount: 0,
      stillTime: 0, // since when the hand is at rest [s]
      forceAmplitude: 0, // of the oscillation within the window [N]
      feltStiffness: 0, // N/m; 0 if it cannot be determined
      isFree: true,
      window: [], // time, and range of each force component, of the frames within the window
      previous: null,
      lastContact: -1, // s
    });
  }

  /**
   * Add a frame; frames during a ramp after a change of the law are skipped.
   * @param usesPlane whether the depth is relative to the plane z = 0, not to the texture
   */
  addFrame(frame, columns, { settings, position_resolution: positionResolution }, usesPlane = false) {
    const { newest, minima, maxima, hand, closest } = frame, value = name => newest[columns[name]];
    const isInside = minima[columns.inside] === 1, previous = this.previous, time = value("time");
    this.previous = { hand: [...hand], x: value("x"), y: value("y"), time };
    if (!previous || minima[columns.share] < 1) { this.window = []; return; }
    const handDistance = Math.hypot(...hand.map((coordinate, k) => coordinate - previous.hand[k]));
    if (maxima[columns.inside] === 1) this.lastContact = time;
    this.isFree = time - this.lastContact > MAX_BOUNCE;
    if (isInside) this.pathLength += Math.hypot(value("x") - previous.x, value("y") - previous.y);
    this.stillTime = !this.isFree && handDistance < STILL_DISTANCE ? this.stillTime + time - previous.time : 0;
    const slopeForce = CLICK_STEEPNESS * settings.stiffness * (frame.positionStep + positionResolution);
    if (isInside && frame.maxForceStep > CLICK_FORCE && frame.maxForceStep > slopeForce) this.clickCount++;
    this.measureOscillation(time, columns, minima, maxima);
    const force = Math.hypot(value("applied x"), value("applied y"), value("applied z"));
    const depth = usesPlane ? -value("z") : Math.hypot(value("x") - closest[0], value("y") - closest[1], value("z") - closest[2]);
    const isAtRest = this.stillTime > WINDOW && this.forceAmplitude < BUZZ_AMPLITUDE;
    this.feltStiffness = isAtRest && force > 5 * PERCEPTION_THRESHOLD && depth > MIN_DEPTH ? force / depth : 0;
  }

  /** Update the amplitude of the force within the window; it is 0 until the contact has lasted that long. */
  measureOscillation(time, columns, minima, maxima) {
    const ranges = ["applied x", "applied y", "applied z"].map(name => [minima[columns[name]], maxima[columns[name]]]);
    this.window = this.isFree ? [] : [...this.window.filter(([start]) => start > time - WINDOW), [time, ranges]];
    const duration = this.window.length ? time - this.window[0][0] : 0;
    if (duration < 0.8 * WINDOW) { this.forceAmplitude = 0; return; }
    const amplitudes = [0, 1, 2].map(k => 0.5 * (Math.max(...this.window.map(([, range]) => range[k][1]))
      - Math.min(...this.window.map(([, range]) => range[k][0]))));
    this.forceAmplitude = Math.hypot(...amplitudes);
  }
}
