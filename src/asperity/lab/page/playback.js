// Rows of a recording, fetched in chunks of which only the most recently used are stored.

const MAX_CHUNKS = 16;
const RETRY_INTERVAL = 1000; // ms between two attempts to fetch a chunk

export class Playback {
  /**
   * @param clip description by the server: name, and playback with the numbers of rows and the period
   * @param columns index of each column of the loop
   */
  constructor({ name, playback }, columns) {
    this.name = name;
    this.columns = columns;
    this.rowCount = playback.row_count;
    this.period = playback.period;
    this.chunkRows = playback.chunk_rows;
    this.rowWidth = playback.row_width;
    this.forceRanges = playback.force_ranges;
    this.chunks = new Map(); // by number, the most recently used last
    this.requestTimes = new Map(); // of missing chunks [ms]
  }

  /** Return a row that is loaded. */
  row(index) {
    const number = Math.floor(index / this.chunkRows), start = (index - number * this.chunkRows) * this.rowWidth;
    return this.chunks.get(number).subarray(start, start + this.rowWidth);
  }

  /** Return whether rows are loaded; missing chunks are fetched. */
  ensureLoaded(first, end) {
    let isLoaded = true;
    for (let number = Math.floor(first / this.chunkRows); number * this.chunkRows < end; number++) {
      const chunk = this.chunks.get(number);
      if (chunk) {
        this.chunks.delete(number); // now the most recently used
        this.chunks.set(number, chunk);
      } else {
        isLoaded = false;
        this.fetchChunk(number);
      }
    }
    return isLoaded;
  }

  async fetchChunk(number) {
    if (performance.now() - (this.requestTimes.get(number) ?? -Infinity) < RETRY_INTERVAL) return;
    this.requestTimes.set(number, performance.now());
    const response = await fetch(`${this.name}.${number}`).catch(() => null);
    if (!response?.ok) return;
    this.chunks.set(number, new Float64Array(await response.arrayBuffer()));
    this.requestTimes.delete(number);
    for (const oldest of this.chunks.keys()) {
      if (this.chunks.size <= MAX_CHUNKS) break;
      this.chunks.delete(oldest);
    }
  }

  /** Return loaded rows as a frame, like those of the live loop. */
  frame(first, end) {
    const { columns } = this, count = Math.max(...Object.values(columns)) + 1, newest = this.row(end - 1);
    const minima = newest.slice(0, count), maxima = newest.slice(0, count), forces = new Float64Array(3 * (end - first));
    const statistics = { pathLength: 0, squaredSteps: 0, maxForceStep: 0, positionStep: 0 };
    for (let index = first; index < end; index++) {
      const row = this.row(index);
      for (let k = 0; k < count; k++) {
        minima[k] = Math.min(minima[k], row[k]);
        maxima[k] = Math.max(maxima[k], row[k]);
      }
      forces.set(row.subarray(columns["applied x"], columns["applied x"] + 3), 3 * (index - first));
      if (index > first) this.addStep(statistics, this.row(index - 1), row);
    }
    return { rowCount: end - first, firstRow: first, acknowledged: 0, ...statistics, newest, minima, maxima, forces,
      closest: [...newest.subarray(count, count + 3)], hand: [...newest.subarray(count + 3, count + 6)] };
  }

  /** Update the statistics of a frame by the step between two rows. */
  addStep(statistics, previous, row) {
    const distance = prefix => Math.hypot(...["x", "y", "z"].map(axis => {
      const column = this.columns[`${prefix}${axis}`];
      return row[column] - previous[column];
    }));
    const positionStep = distance(""), forceStep = distance("commanded ");
    statistics.pathLength += positionStep;
    statistics.squaredSteps += positionStep ** 2;
    if (forceStep > statistics.maxForceStep) Object.assign(statistics, { maxForceStep: forceStep, positionStep });
  }
}
