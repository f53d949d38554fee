// The force as sound: tangential components in the left channel, the normal component in the right.

const MAX_GAIN = 0.5;

export class ForceSound {
  constructor() {
    this.context = null;
    this.volume = 0.3;
    this.isOn = false;
  }

  /** Switch the sound on or off; return whether it is on. */
  async toggle() {
    if (!this.context) {
      this.context = new AudioContext();
      await this.context.audioWorklet.addModule("force_audio_processor.js");
      this.processor = new AudioWorkletNode(this.context, "force-audio", { numberOfInputs: 0, outputChannelCount: [2] });
      this.gain = this.context.createGain();
      this.processor.connect(this.gain).connect(this.context.destination);
    }
    this.isOn = !this.isOn;
    this.setVolume(this.volume);
    await (this.isOn ? this.context.resume() : this.context.suspend());
    return this.isOn;
  }

  setVolume(volume) {
    this.volume = volume;
    this.gain?.gain.setTargetAtTime(MAX_GAIN * volume ** 2, this.context.currentTime, 0.02);
  }

  /** Play forces (x, y, z of each row) of a loop with an update rate [Hz]. */
  addForces(forces, updateRate) {
    if (!this.isOn) return;
    const samples = new Float32Array(2 * forces.length / 3);
    for (let k = 0; k < forces.length / 3; k++) {
      samples[2 * k] = forces[3 * k] + forces[3 * k + 1];
      samples[2 * k + 1] = forces[3 * k + 2];
    }
    this.processor.port.postMessage({ forces: samples, updateRate }, [samples.buffer]);
  }
}
