// Takes: what was recorded, shown again at any moment, or as time goes.

import { Reel } from "./reel.js";

const EVERY = 5e-3; // s of a frame that is made of a take
const SHOWN = 5; // s before a moment that the traces show
const MOST = 60000; // rows of that
const BACK = 40000; // rows before these in which it is looked for where the probe was free

export class Player {
  /** @param show object with frame(frame) and clear(), which forgets what was before */
  constructor(show) {
    this.show = show;
    this.reel = null;
    this.row = 0; // until which it is shown
    this.sought = null; // row that shall be shown as soon as it is held
    this.playing = false;
  }

  get on() { return this.reel !== null; }
  get rate() { return 1 / this.reel.period; }
  get length() { return this.reel.rows * this.reel.period; }
  get share() { return (this.sought ?? this.row) / this.reel.rows; }
  get time() { return (this.sought ?? this.row) * this.reel.period; }
  get step() { return Math.max(1, Math.round(EVERY / this.reel.period)); }

  open(about, columns) {
    this.reel = new Reel(about, columns);
    this.seek(0);
    this.playing = true;
  }

  close() { this.reel = null; this.playing = false; }

  /** Show how things stood after a share of the rows, as soon as they are there. */
  seek(share) {
    this.sought = Math.max(Math.min(this.step, this.reel.rows), Math.min(this.reel.rows, Math.round(share * this.reel.rows)));
    this.find();
  }

  find() {
    const { reel, sought } = this, from = Math.max(0, sought - Math.min(MOST, Math.round(SHOWN / reel.period)));
    if (!reel.has(from, sought)) return;
    const free = this.freeBefore(from);
    if (free === null) return;
    this.sought = null;
    this.row = free;
    this.show.clear();
    this.go(sought);
    this.then = performance.now();
  }

  /** Return the row before another at which the probe was free, from where energy counts; null if it is not held yet. */
  freeBefore(row) {
    const { reel } = this, least = Math.max(0, row - BACK);
    for (let free = row, held = Infinity; ; free--) {
      if (free < held) {
        if (!reel.has(free, free + 1)) return null;
        held = Math.floor(free / reel.piece) * reel.piece;
      }
      if (free <= least || !reel.at(free)[reel.columns.inside]) return free;
    }
  }

  /** Show all that comes until a row. */
  go(end) {
    while (this.row < end) {
      const next = Math.min(end, this.row + this.step);
      this.show.frame(this.reel.frame(this.row, next));
      this.row = next;
    }
  }

  /** Play on, as the clock goes [ms]; from the beginning again after the end. */
  tick(now) {
    if (!this.on) return;
    if (this.sought !== null) { this.find(); return; }
    if (!this.playing) return;
    const { reel } = this, rows = Math.round(1e-3 * (now - this.then) / reel.period);
    if (rows < 1) return;
    const end = Math.min(reel.rows, this.row + rows);
    if (this.row >= reel.rows) { this.seek(0); return; }
    this.then = now;
    // What is not there yet is waited for; what comes then is asked for in time.
    if (reel.has(this.row, end)) this.go(end);
    reel.has(Math.min(end, reel.rows - 1), Math.min(reel.rows, end + Math.round(1 / reel.period)));
  }

  toggle() {
    this.playing = !this.playing;
    this.then = performance.now();
  }
}
