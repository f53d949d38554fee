// Takes: what was recorded, shown again at any moment, or as time goes.

import { Playback } from "./playback.js";

const EVERY = 5e-3; // s of a frame that is made of a take
const SHOWN = 5; // s before a moment that the traces show
const MOST = 60000; // rows of that
const BACK = 40000; // rows before these in which it is looked for where the probe was free

export class Player {
  /** @param show object with frame(frame) and clear(), which forgets what was before */
  constructor(show) {
    this.show = show;
    this.playback = null;
    this.row = 0; // until which it is shown
    this.sought = null; // row that shall be shown as soon as it is held
    this.playing = false;
  }

  get on() { return this.playback !== null; }
  get rate() { return 1 / this.playback.period; }
  get length() { return this.playback.rows * this.playback.period; }
  get share() { return (this.sought ?? this.row) / this.playback.rows; }
  get time() { return (this.sought ?? this.row) * this.playback.period; }
  get step() { return Math.max(1, Math.round(EVERY / this.playback.period)); }

  open(about, columns) {
    this.playback = new Playback(about, columns);
    this.seek(0);
    this.playing = true;
  }

  close() { this.playback = null; this.playing = false; }

  /** Show how things stood after a share of the rows, as soon as they are there. */
  seek(share) {
    this.sought = Math.max(Math.min(this.step, this.playback.rows), Math.min(this.playback.rows, Math.round(share * this.playback.rows)));
    this.find();
  }

  find() {
    const { playback, sought } = this, from = Math.max(0, sought - Math.min(MOST, Math.round(SHOWN / playback.period)));
    if (!playback.has(from, sought)) return;
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
    const { playback } = this, least = Math.max(0, row - BACK);
    for (let free = row, held = Infinity; ; free--) {
      if (free < held) {
        if (!playback.has(free, free + 1)) return null;
        held = Math.floor(free / playback.piece) * playback.piece;
      }
      if (free <= least || !playback.at(free)[playback.columns.inside]) return free;
    }
  }

  /** Show all that comes until a row. */
  go(end) {
    while (this.row < end) {
      const next = Math.min(end, this.row + this.step);
      this.show.frame(this.playback.frame(this.row, next));
      this.row = next;
    }
  }

  /** Play on, as the clock goes [ms]; from the beginning again after the end. */
  tick(now) {
    if (!this.on) return;
    if (this.sought !== null) { this.find(); return; }
    if (!this.playing) return;
    const { playback } = this, rows = Math.round(1e-3 * (now - this.then) / playback.period);
    if (rows < 1) return;
    const end = Math.min(playback.rows, this.row + rows);
    if (this.row >= playback.rows) { this.seek(0); return; }
    this.then = now;
    // What is not there yet is waited for; what comes then is asked for in time.
    if (playback.has(this.row, end)) this.go(end);
    playback.has(Math.min(end, playback.rows - 1), Math.min(playback.rows, end + Math.round(1 / playback.period)));
  }

  toggle() {
    this.playing = !this.playing;
    this.then = performance.now();
  }
}
