// Takes: the last seconds that were kept, shown again at any moment, or as time goes.

const EVERY = 5e-3; // s of a frame that is made of a take
const SHOWN = 5; // s before a moment that the traces show

/** Rows of the loop, with god-object and hand, as the lab sends them. */
class Table {
  constructor(numbers, columns) {
    [this.rows, this.width] = numbers;
    this.numbers = numbers.subarray(2);
    this.columns = columns;
    this.period = this.at(1)[columns.time] - this.at(0)[columns.time];
  }

  at(row) { return this.numbers.subarray(row * this.width, (row + 1) * this.width); }

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
    return { rows: end - first, first, heard: 0, late: 0, skipped: 0, ...said, newest, least, greatest, forces,
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

export class Player {
  /** @param show object with frame(frame) and clear(), which forgets what was before */
  constructor(show) {
    this.show = show;
    this.table = null;
    this.row = 0;
    this.playing = false;
  }

  get on() { return this.table !== null; }
  get length() { return this.table.rows * this.table.period; }
  get time() { return this.row * this.table.period; }

  open(numbers, columns) {
    this.table = new Table(numbers, columns);
    this.seek(0);
    this.playing = true;
    this.then = performance.now();
  }

  close() { this.table = null; this.playing = false; }

  /** Show how things stood at a moment [s]. */
  seek(time) {
    const step = Math.max(1, Math.round(EVERY / this.table.period));
    const end = Math.max(step, Math.min(this.table.rows, Math.round(time / this.table.period)));
    this.show.clear();
    this.row = Math.max(0, end - Math.round(SHOWN / this.table.period));
    // Energy counts from where the probe is free.
    while (this.row > 0 && this.table.at(this.row)[this.table.columns.inside]) this.row--;
    this.go(end);
  }

  /** Show all that comes until a row. */
  go(end) {
    const step = Math.max(1, Math.round(EVERY / this.table.period));
    while (this.row < end) {
      const next = Math.min(end, this.row + step);
      this.show.frame(this.table.frame(this.row, next));
      this.row = next;
    }
  }

  /** Play on, as the clock goes [ms]; from the beginning again after the end. */
  tick(now) {
    if (!this.on || !this.playing) return;
    const rows = Math.round(1e-3 * (now - this.then) / this.table.period);
    if (rows < 1) return;
    this.then = now;
    if (this.row >= this.table.rows) this.seek(0);
    else this.go(Math.min(this.table.rows, this.row + rows));
  }

  toggle() {
    this.playing = !this.playing;
    this.then = performance.now();
  }
}
