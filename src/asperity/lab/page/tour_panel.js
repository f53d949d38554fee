// The guided tour on the page: what to do, what to watch, and what was seen.

import { STEPS } from "./tour.js";

const $ = name => document.getElementById(`tour-${name}`);

export class TourPanel {
  constructor(tour) {
    this.tour = tour;
    this.drawn = "";
    document.getElementById("tour-begin").onclick = () => this.toggle();
    $("end").onclick = () => this.toggle();
    $("show").onclick = () => { tour.show(); this.draw(); };
    $("back").onclick = () => this.go(tour.step - 1);
    $("next").onclick = () => (tour.step + 1 < STEPS.length ? this.go(tour.step + 1) : this.toggle());
  }

  toggle() {
    if (this.tour.on) this.tour.end(); else this.tour.begin();
    this.draw();
    (this.tour.on ? $("title") : $("begin")).focus();
  }

  go(step) {
    this.tour.go(step);
    this.draw();
  }

  /** Show how things stand. */
  draw() {
    const { tour } = this, panel = document.getElementById("tour");
    panel.hidden = !tour.on;
    $("begin").setAttribute("aria-pressed", tour.on);
    if (!tour.on) { this.drawn = ""; return; }
    const { title, watch } = tour.now, last = tour.step + 1 === STEPS.length;
    panel.classList.toggle("found", tour.found);
    const told = {
      place: `Step ${tour.step + 1} of ${STEPS.length} ${tour.seen.map(seen => (seen ? "●" : "○")).join(" ")}`,
      title, why: tour.why, watch, ask: tour.act.ask, words: tour.result?.words ?? "getting ready …",
      found: tour.found ? `✓ ${tour.told}` : "", next: last ? "Finish" : "Next",
    };
    for (const [name, words] of Object.entries(told)) if ($(name).textContent !== words) $(name).textContent = words;
    const done = tour.turn / tour.now.acts.length, share = Math.min(tour.result?.share ?? 0, 1) / tour.now.acts.length;
    $("bar").value = tour.found ? 1 : Math.min(done + share, 0.99);
    $("show").setAttribute("aria-pressed", tour.shows);
    $("show").textContent = tour.shows ? "Try it" : "Show me";
    $("back").disabled = tour.step === 0;
  }
}
