// The force as sound: along the surface in the left ear, normal to it in the right one.

const LOUDEST = 0.5;

export class Sound {
  constructor() {
    this.context = null;
    this.volume = 0.3;
    this.on = false;
  }

  /** Turn it on or off; whether it is on then. */
  async toggle() {
    if (!this.context) {
      this.context = new AudioContext();
      await this.context.audioWorklet.addModule("force_audio_processor.js");
      this.ear = new AudioWorkletNode(this.context, "ear", { numberOfInputs: 0, outputChannelCount: [2] });
      this.gain = this.context.createGain();
      this.ear.connect(this.gain).connect(this.context.destination);
    }
    this.on = !this.on;
    this.setVolume(this.volume);
    await (this.on ? this.context.resume() : this.context.suspend());
    return this.on;
  }

  setVolume(volume) {
    this.volume = volume;
    this.gain?.gain.setTargetAtTime(LOUDEST * volume ** 2, this.context.currentTime, 0.02);
  }

  take(forces, rate) {
    if (!this.on) return;
    const pairs = new Float32Array(2 * forces.length / 3);
    for (let k = 0; k < forces.length / 3; k++) {
      pairs[2 * k] = forces[3 * k] + forces[3 * k + 1];
      pairs[2 * k + 1] = forces[3 * k + 2];
    }
    this.ear.port.postMessage({ forces: pairs, rate }, [pairs.buffer]);
  }
}
