// Pink noise that masks the sound of a device: made once, repeated without a seam.

const SECONDS = 20;
const GAIN = 0.25;

/** Fill samples with pink noise (Voss and McCartney: sums of noises that change ever more rarely). */
export function fillPink(samples, random = Math.random) {
  const ROWS = 12;
  const rows = Array.from({ length: ROWS }, () => 2 * random() - 1);
  for (let k = 0; k < samples.length; k++) {
    const row = Math.min(Math.clz32((k + 1) & -(k + 1)) ^ 31, ROWS - 1);
    rows[row] = 2 * random() - 1;
    samples[k] = (rows.reduce((sum, value) => sum + value, 0) + 2 * random() - 1) / (ROWS + 1);
  }
}

export class MaskingNoise {
  constructor() {
    this.context = null;
  }

  get isOn() {
    return this.context?.state === "running";
  }

  /** Start the noise; browsers allow it after a key. */
  start() {
    if (this.context) return;
    this.context = new AudioContext();
    const buffer = this.context.createBuffer(2, SECONDS * this.context.sampleRate, this.context.sampleRate);
    for (const channel of [0, 1]) fillPink(buffer.getChannelData(channel));
    const source = this.context.createBufferSource();
    source.buffer = buffer;
    source.loop = true;
    const gain = this.context.createGain();
    gain.gain.value = GAIN;
    source.connect(gain).connect(this.context.destination);
    source.start();
  }
}
