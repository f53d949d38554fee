// The force as sound, in the browser's thread for sound: from the loop's rate to the speaker's.

const KEPT = 1 << 16; // samples of the loop
const LAG = 0.06; // s that are kept in hand, so that frames that come unevenly leave no gaps

class Ear extends AudioWorkletProcessor {
  constructor() {
    super();
    this.kept = [new Float32Array(KEPT), new Float32Array(KEPT)];
    this.written = 0;
    this.read = 0;
    this.rate = 1000;
    this.before = [0, 0];
    this.high = [0, 0];
    this.port.onmessage = ({ data }) => {
      this.rate = data.rate;
      for (let k = 0; k < data.forces.length; k += 2) {
        for (const side of [0, 1]) this.kept[side][this.written % KEPT] = data.forces[k + side];
        this.written++;
      }
    };
  }

  process(_inputs, outputs) {
    const [sides] = outputs, lag = LAG * this.rate;
    // A little faster or slower than the loop, towards the wanted lag; far away from it, a jump.
    let behind = this.written - this.read;
    if (behind < 0 || behind > 4 * lag + KEPT / 64) { this.read = Math.max(this.written - lag, 0); behind = lag; }
    const step = this.rate / sampleRate * (1 + 0.02 * Math.max(-1, Math.min(1, (behind - lag) / lag)));
    const keep = Math.exp(-2 * Math.PI * 25 / sampleRate);
    for (let i = 0; i < sides[0].length; i++) {
      const whole = Math.floor(this.read), part = this.read - whole;
      const there = whole + 1 < this.written;
      sides.forEach((side, k) => {
        const kept = this.kept[Math.min(k, 1)];
        const value = there ? kept[whole % KEPT] * (1 - part) + kept[(whole + 1) % KEPT] * part : this.before[k];
        // Only what changes is heard, and never louder than full.
        this.high[k] = keep * (this.high[k] + value - this.before[k]);
        this.before[k] = value;
        side[i] = Math.tanh(2 * this.high[k]);
      });
      if (there) this.read += step;
    }
    return true;
  }
}

registerProcessor("ear", Ear);
