// The second lane: another law beside the first, under the same hand, with its own probe, section, traces and verdict.

import { Pictures } from "./pictures.js";
import { LaneVerdict } from "./lane_verdict.js";
import { Spectrum, TracePlot } from "./traces.js";
import { SectionView, pictureLabel } from "./views.js";
import { formatQuantity } from "./format.js";
import { probeStateOf } from "./probe_overlay.js";

const $ = id => document.getElementById(id);
const IN_TOUR = "not offered in the guided tour, which shows one law at a time";
const setText = (name, text) => { if ($(name).textContent !== text) $(name).textContent = text; };

export class SecondLane {
  /** @param host object with changeScene(changes), send(kind, content), energyMeter and hasCurl of the first lane, and tour */
  constructor(host) {
    this.host = host;
    this.section = new SectionView($("beside-section"));
    this.section.kind = "beside";
    this.traces = new TracePlot($("beside-traces"));
    this.spectrum = new Spectrum();
    this.verdicts = [new LaneVerdict($("verdict-first"), host.energyMeter), new LaneVerdict($("verdict-second"))];
    this.pictures = new Pictures(host.send, { beside: this.section });
    this.status = this.frame = null;
    this.lastLaw = "H"; // that the key chooses
    $("beside").onchange = event => host.changeScene({ beside: event.target.value });
  }

  get energyMeter() { return this.verdicts[1].energyMeter; }

  /** Whether the page is split: a second law is chosen, outside the guided tour. */
  get isShown() { return Boolean(this.status) && !this.unavailableText; }

  get unavailableText() { return this.host.tour.isActive ? IN_TOUR : ""; }

  /** Fill the choice of laws. */
  setLaws(laws) {
    const names = [["", "none"], ...laws.map(({ letter, name }) => [letter, `law ${letter} ${name}`])];
    $("beside").replaceChildren(...names.map(([value, text]) => new Option(text, value)));
  }

  /** Choose the last second law, or none. */
  toggle() { if (!$("beside").disabled) this.host.changeScene({ beside: $("beside").value ? "" : this.lastLaw }); }

  /** Note the newest status; null without a connection. */
  setStatus(status) {
    const previous = this.status, law = status?.settings.beside;
    // What concerns the loop and its pictures is of this lane; the rest is common to both.
    this.status = law ? { ...status, ...status.beside } : null;
    this.law = law; // as chosen, also before its loop runs
    this.pictures.setStatus(this.status);
    if (!law) $("beside-section").classList.remove("stale"); // it is hidden
    if (law) this.lastLaw = law;
    if (status && document.activeElement !== $("beside")) $("beside").value = law;
    const key = this.status && [status.start_count, status.settings.law, this.status.start_count, this.status.settings.law].join();
    if (key !== this.key && law) this.reset();
    if (this.status?.start_count !== previous?.start_count) { this.traces.clear(); this.frame = null; }
    this.key = key;
    this.update();
  }

  /** Reset energies and verdicts of both lanes, so that both count from the same moment. */
  reset() { for (const verdict of this.verdicts) verdict.reset(); }

  /** Add a frame of the first lane. */
  addFirstFrame(frame, columns, status) { if (this.isShown) this.verdicts[0].addFrame(frame, columns, status); }

  addFrame(frame, columns) {
    if (!this.status) return;
    this.frame = frame;
    this.energyMeter.addFrame(frame, columns, this.status);
    this.verdicts[1].addFrame(frame, columns, this.status);
    this.traces.addFrame(frame, columns);
    this.spectrum.addForces(frame.forces);
    this.probe = probeStateOf(frame, columns, this.energyMeter.energy, this.status.friction);
  }

  receivePicture(numbers) { this.pictures.receive(this.section, numbers); }

  requestPicture(content) {
    if (!this.isShown || !this.status.start_count) return;
    if (!this.section.covers(content.box)) this.pictures.endPauses(); // a part of the view is blank
    this.pictures.request("beside", content);
  }

  /** The traces with the offset of the energy, for a scale common to both lanes; null if it is not shown. */
  get scale() { return this.isShown ? { plot: this.traces, offset: this.energyMeter.offset } : null; }

  get otherSpectrum() { return this.isShown ? this.spectrum : null; }

  /** The views of this lane, with the functions that draw them, for a file. */
  views(box, drawTraces) { return this.isShown ? [[this.section, () => this.drawSection(box)], [this.traces, drawTraces]] : []; }

  drawSection(box) { if (this.isShown) this.section.draw(this.frame && this.probe, box); }
  drawTraces(scale) { if (this.isShown) this.traces.draw(this.energyMeter.offset, scale); }

  /** Update texts and layout. */
  update(firstLaw = this.firstLaw) {
    this.firstLaw = firstLaw;
    const { isShown, status, law } = this, unavailable = this.unavailableText;
    document.body.classList.toggle("two-lanes", isShown);
    if (unavailable) $("beside").disabled = true;
    setText("beside-note", unavailable || (status ? this.noteText : "Both laws under the same hand, side by side."));
    this.traces.label = isShown ? `law ${law}` : "";
    this.section.label = isShown ? pictureLabel(this.section, law) : "";
    if (!isShown) return;
    setText("beside-title", `Law ${law}`);
    const stale = this.pictures.staleText(this.section), { section } = this;
    setText("beside-section-note", stale || (section.hasCurl ? `curl up to ${formatQuantity(section.maxCurl, "N/m")}` : "no curl"));
    setText("beside-trace-title", `Law ${law}`);
    setText("beside-trace-note", this.frame ? this.lagText : status.state);
    setText("first-curve", `law ${firstLaw}`);
    setText("second-curve", `law ${law}`);
    this.verdicts[0].hasCurl = this.host.hasCurl;
    this.verdicts[1].hasCurl = !stale && section.hasCurl;
    this.verdicts[0].update();
    this.verdicts[1].update(status.state === "running" ? "" : `${status.state}${status.message && `: ${status.message}`}`);
    const force = this.frame ? formatQuantity(Math.hypot(...this.probe.force), "N") : "not known", energy = formatQuantity(this.energyMeter.energy, "J");
    $("beside-section").setAttribute("aria-label", `Section through the surface along x, law ${law}. Force ${force}. ${this.verdicts[1].text}`);
    $("beside-traces").setAttribute("aria-label", `Traces of five seconds, law ${law}. Energy given to the hand ${energy}`);
  }

  get noteText() {
    const { stiffness, device, delay } = this.status.settings;
    return `Same for both: hand (its motion sample by sample), surface, depth, ${formatQuantity(stiffness, "N/m")}, ${device}, delay ${delay ?? 0}, scales. Each has its own probe.`;
  }

  get lagText() {
    const { lateness, skipped, truncated } = this.frame;
    return `same samples, ${formatQuantity(lateness, "s")} behind, ${skipped} left out, ${truncated} truncated`;
  }
}
