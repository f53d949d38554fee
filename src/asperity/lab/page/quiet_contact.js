// Contact without an oscillation that could be felt: above the limit it shows that the limit is conservative for this hand.

import { ContactMetrics, PERCEPTION_THRESHOLD } from "./tactile_metrics.js";
import { formatQuantity } from "./format.js";

const MIN_DURATION = 3; // s of contact
const MIN_FORCE = 10 * PERCEPTION_THRESHOLD; // N: a lighter contact would show nothing

export class QuietContact {
  constructor() {
    this.metrics = new ContactMetrics();
    this.key = ""; // of the loop and its settings
    this.restart();
  }

  restart() { Object.assign(this, { duration: 0, amplitude: 0, time: null }); }

  addFrame(frame, columns, status) {
    const key = JSON.stringify([status.start_count, status.settings]), value = name => frame.newest[columns[name]];
    if (key !== this.key) { this.key = key; this.metrics.reset(); this.restart(); }
    const { metrics } = this, time = value("time"), elapsed = time - (this.time ?? time);
    metrics.addFrame(frame, columns, status);
    const force = Math.hypot(value("applied x"), value("applied y"), value("applied z"));
    const isQuiet = !metrics.isFree && force > MIN_FORCE && metrics.forceAmplitude < PERCEPTION_THRESHOLD;
    if (!isQuiet || elapsed < 0) this.restart();
    else Object.assign(this, { duration: this.duration + elapsed, amplitude: Math.max(this.amplitude, metrics.forceAmplitude) });
    this.time = time;
  }

  /** What the contact shows of a limit that is exceeded; empty before it has lasted. */
  get text() {
    if (this.duration < MIN_DURATION) return "";
    return `. The limit is conservative for this hand: in ${Math.floor(this.duration)} s of contact the force varied by at most ${formatQuantity(this.amplitude, "N")}`;
  }
}
