// Audio worklet that plays the force, resampled from the update rate of the loop to that of the audio output.

const BUFFER_SIZE = 1 << 16; // samples of the loop
const LATENCY = 0.06; // s of buffered samples, which bridge the gaps between frames
const HIGH_PASS = 25; // Hz, below which the force is not audible

class ForceAudioProcessor extends AudioWorkletProcessor {
  constructor() {
    super();
    this.buffers = [new Float32Array(BUFFER_SIZE), new Float32Array(BUFFER_SIZE)]; // left, right
    this.writePosition = 0;
    this.readPosition = 0; // fractional
    this.updateRate = 1000;
    this.previous = [0, 0];
    this.filtered = [0, 0];
    this.port.onmessage = ({ data }) => {
      this.updateRate = data.updateRate;
      for (let k = 0; k < data.forces.length; k += 2) {
        for (const channel of [0, 1]) this.buffers[channel][this.writePosition % BUFFER_SIZE] = data.forces[k + channel];
        this.writePosition++;
      }
    };
  }

  process(_inputs, outputs) {
    const [channels] = outputs, target = LATENCY * this.updateRate;
    // The playback speed is adjusted by up to 2 % to hold the latency; far from it, samples are skipped.
    let lag = this.writePosition - this.readPosition;
    if (lag < 0 || lag > 4 * target + BUFFER_SIZE / 64) {
      this.readPosition = Math.max(this.writePosition - target, 0);
      lag = target;
    }
    const step = this.updateRate / sampleRate * (1 + 0.02 * Math.max(-1, Math.min(1, (lag - target) / target)));
    const decay = Math.exp(-2 * Math.PI * HIGH_PASS / sampleRate);
    for (let i = 0; i < channels[0].length; i++) {
      const index = Math.floor(this.readPosition), fraction = this.readPosition - index;
      const isAvailable = index + 1 < this.writePosition;
      channels.forEach((channel, k) => {
        const buffer = this.buffers[Math.min(k, 1)];
        const force = isAvailable
          ? buffer[index % BUFFER_SIZE] * (1 - fraction) + buffer[(index + 1) % BUFFER_SIZE] * fraction
          : this.previous[k];
        // A high-pass filter removes constant forces; tanh limits the amplitude to full scale.
        this.filtered[k] = decay * (this.filtered[k] + force - this.previous[k]);
        this.previous[k] = force;
        channel[i] = Math.tanh(2 * this.filtered[k]);
      });
      if (isAvailable) this.readPosition += step;
    }
    return true;
  }
}

registerProcessor("force-audio", ForceAudioProcessor);
