// Player of clips: shows any moment of a recording, or plays it in real time.

import { Playback } from "./playback.js";

const FRAME_DURATION = 5e-3; // s
const TRACE_DURATION = 5; // s before a moment, which the traces show
const MAX_TRACE_ROWS = 60000;
const MAX_SEARCH_ROWS = 40000; // before the traces, searched for a free probe

export class Player {
  /** @param display object with showFrame(frame), and clear(), which discards the previous frames */
  constructor(display) {
    this.display = display;
    this.playback = null;
    this.row = 0; // end of the rows shown
    this.targetRow = null; // shown as soon as it is loaded
    this.isPlaying = false;
  }

  get isOpen() { return this.playback !== null; }
  get updateRate() { return 1 / this.playback.period; }
  get duration() { return this.playback.rowCount * this.playback.period; }
  get fraction() { return (this.targetRow ?? this.row) / this.playback.rowCount; }
  get time() { return (this.targetRow ?? this.row) * this.playback.period; }
  get frameRows() { return Math.max(1, Math.round(FRAME_DURATION / this.playback.period)); }

  open(clip, columns) {
    this.playback = new Playback(clip, columns);
    this.seek(0);
    this.isPlaying = true;
  }

  close() { this.playback = null; this.isPlaying = false; }

  /** Show the moment at a fraction of the duration, as soon as its rows are loaded. */
  seek(fraction) {
    const { rowCount } = this.playback;
    this.targetRow = Math.max(Math.min(this.frameRows, rowCount), Math.min(rowCount, Math.round(fraction * rowCount)));
    this.showTarget();
  }

  /** Show the target row with the traces before it, if all of these are loaded. */
  showTarget() {
    const { playback, targetRow } = this;
    const traceRows = Math.min(MAX_TRACE_ROWS, Math.round(TRACE_DURATION / playback.period));
    const traceStart = Math.max(0, targetRow - traceRows);
    if (!playback.ensureLoaded(traceStart, targetRow)) return;
    const start = this.findFreeRow(traceStart);
    if (start === null) return;
    this.targetRow = null;
    this.row = start;
    this.display.clear();
    this.showUntil(targetRow);
    this.lastTick = performance.now();
  }

  /** Return the last row, up to a given one, with a free probe, at which the energy counts from zero; null while loading. */
  findFreeRow(row) {
    const { playback } = this, earliest = Math.max(0, row - MAX_SEARCH_ROWS);
    for (let candidate = row, loadedFrom = Infinity; ; candidate--) {
      if (candidate < loadedFrom) {
        if (!playback.ensureLoaded(candidate, candidate + 1)) return null;
        loadedFrom = Math.floor(candidate / playback.chunkRows) * playback.chunkRows;
      }
      if (candidate <= earliest || !playback.row(candidate)[playback.columns.inside]) return candidate;
    }
  }

  /** Show the rows up to an end, frame by frame. */
  showUntil(end) {
    while (this.row < end) {
      const next = Math.min(end, this.row + this.frameRows);
      this.display.showFrame(this.playback.frame(this.row, next));
      this.row = next;
    }
  }

  /** Continue in real time [ms]; at the end, start again. */
  tick(now) {
    if (!this.isOpen) return;
    if (this.targetRow !== null) { this.showTarget(); return; }
    if (!this.isPlaying) return;
    const { playback } = this, elapsedRows = Math.round(1e-3 * (now - this.lastTick) / playback.period);
    if (elapsedRows < 1) return;
    const end = Math.min(playback.rowCount, this.row + elapsedRows);
    if (this.row >= playback.rowCount) { this.seek(0); return; }
    this.lastTick = now;
    if (playback.ensureLoaded(this.row, end)) this.showUntil(end);
    // The rows of the next second are fetched in advance.
    playback.ensureLoaded(Math.min(end, playback.rowCount - 1), Math.min(playback.rowCount, end + Math.round(1 / playback.period)));
  }

  togglePlaying() {
    this.isPlaying = !this.isPlaying;
    this.lastTick = performance.now();
  }
}
