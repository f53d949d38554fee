// Verdict on a law in one line: what the hand was given, buzz, and clicks.

import { BUZZ_AMPLITUDE, ContactMetrics, EnergyMeter } from "./tactile_metrics.js";
import { formatQuantity } from "./format.js";

export class LaneVerdict {
  /** @param element to be filled; @param energyMeter that others feed with frames */
  constructor(element, energyMeter = new EnergyMeter()) {
    this.element = element;
    this.energyMeter = energyMeter;
    this.metrics = new ContactMetrics();
    this.hasBuzzed = false;
    this.hasCurl = false; // of the field
  }

  reset() {
    this.energyMeter.reset();
    this.metrics.reset();
    this.hasBuzzed = false;
  }

  addFrame(frame, columns, status) {
    const { metrics } = this;
    metrics.addFrame(frame, columns, status);
    // While the hand moves, the texture itself lets the force vary.
    if (metrics.stillTime > 0.6) this.hasBuzzed = metrics.forceAmplitude >= BUZZ_AMPLITUDE;
  }

  /** The findings: text, and whether each is a fault. */
  get findings() {
    const { energyMeter, metrics, hasBuzzed } = this, energy = formatQuantity(energyMeter.energy, "J");
    const buzz = hasBuzzed ? `buzzes ±${formatQuantity(metrics.forceAmplitude, "N")}` : "no buzz";
    // Sampling explains at most what it was given; a field with curl is alive on the right path only.
    const unfed = this.hasCurl ? "has curl; not shown alive yet" : "not alive";
    return [
      energyMeter.suppliesEnergy ? [`alive: gave ${energy}`, true] : [`${unfed}${energyMeter.energy > 2e-6 ? ` (${energy}, as sampling may)` : ""}`, false],
      [metrics.stillTime > 0.6 || hasBuzzed ? buzz : "buzz: not judged in motion", hasBuzzed],
      [metrics.clickCount ? `${metrics.clickCount} clicks` : "no clicks", metrics.clickCount > 0],
    ];
  }

  get text() { return this.findings.map(([text]) => text).join(", "); }

  /** Show the verdict, or the state of a loop that does not run. */
  update(stateText = "") {
    const findings = stateText ? [[stateText, false]] : this.findings, key = String(findings);
    if (key === this.key) return;
    this.key = key;
    this.element.replaceChildren(...findings.map(([text, isFault]) => Object.assign(document.createElement("span"),
      { textContent: `${isFault ? "⚠ " : ""}${text}`, className: isFault ? "fault" : "" })));
    this.element.parentElement.classList.toggle("faulty", findings.some(([, isFault]) => isFault));
  }
}
