// Rows of a loop that was recorded, of which the page holds some pieces, never all.

const MOST = 16; // pieces that are held
const AGAIN = 1000; // ms until a piece is asked for again that could not be had

export class Playback {
  /**
   * @param about what the lab says of it: name, rows, period, piece, width, force
   * @param columns where each column stands
   */
  constructor({ name, playback }, columns) {
    Object.assign(this, playback, { name, columns });
    this.pieces = new Map(); // by number, the one that was used last at the end
    this.asked = new Map(); // and when [ms]
  }

  /** Return a row that is held. */
  at(row) {
    const number = Math.floor(row / this.piece), at = (row - number * this.piece) * this.width;
    return this.pieces.get(number).subarray(at, at + this.width);
  }

  time(row) { return this.at(row)[this.columns.time]; }

  /** Whether some rows are held; what is missing is asked for. */
  has(first, end) {
    let all = true;
    for (let number = Math.floor(first / this.piece); number * this.piece < end; number++) {
      const piece = this.pieces.get(number);
      if (piece) { this.pieces.delete(number); this.pieces.set(number, piece); } else { all = false; this.ask(number); }
    }
    return all;
  }

  async ask(number) {
    if (performance.now() - (this.asked.get(number) ?? -Infinity) < AGAIN) return;
    this.asked.set(number, performance.now());
    const answer = await fetch(`${this.name}.${number}`).catch(() => null);
    if (!answer?.ok) return;
    this.pieces.set(number, new Float64Array(await answer.arrayBuffer()));
    this.asked.delete(number);
    for (const old of this.pieces.keys()) { if (this.pieces.size <= MOST) break; this.pieces.delete(old); }
  }

  /** Return rows as a frame of the loop would say them. */
  frame(first, end) {
    const { columns } = this, count = Math.max(...Object.values(columns)) + 1, newest = this.at(end - 1);
    const least = newest.slice(0, count), greatest = newest.slice(0, count), forces = new Float64Array(3 * (end - first));
    const said = { way: 0, squares: 0, jump: 0, moved: 0 };
    for (let row = first; row < end; row++) {
      const now = this.at(row);
      for (let k = 0; k < count; k++) {
        least[k] = Math.min(least[k], now[k]);
        greatest[k] = Math.max(greatest[k], now[k]);
      }
      forces.set(now.subarray(columns["applied x"], columns["applied x"] + 3), 3 * (row - first));
      if (row > first) this.step(said, this.at(row - 1), now);
    }
    return { rows: end - first, first, acknowledged: 0, late: 0, skipped: 0, ...said, newest, least, greatest, forces,
      god: [...newest.subarray(count, count + 3)], hand: [...newest.subarray(count + 3, count + 6)] };
  }

  step(said, before, now) {
    const way = Math.hypot(...["x", "y", "z"].map(axis => now[this.columns[axis]] - before[this.columns[axis]]));
    const jump = Math.hypot(...["x", "y", "z"].map(axis => now[this.columns[`commanded ${axis}`]] - before[this.columns[`commanded ${axis}`]]));
    said.way += way;
    said.squares += way ** 2;
    if (jump > said.jump) Object.assign(said, { jump, moved: way });
  }
}
