// Panel of the guided tour: the task, what to watch, the progress and the result of a step.

import { STEPS } from "./tour.js";

const $ = name => document.getElementById(`tour-${name}`);

export class TourPanel {
  constructor(tour) {
    this.tour = tour;
    $("start").onclick = () => this.toggle();
    $("end").onclick = () => this.toggle();
    $("demo").onclick = () => { tour.setDemo(); this.update(); };
    $("back").onclick = () => this.goTo(tour.stepIndex - 1);
    $("next").onclick = () => (tour.stepIndex + 1 < STEPS.length ? this.goTo(tour.stepIndex + 1) : this.toggle());
  }

  /** Start or end the tour. */
  toggle() {
    if (this.tour.isActive) this.tour.end(); else this.tour.start();
    this.update();
    (this.tour.isActive ? $("title") : $("start")).focus();
  }

  goTo(stepIndex) {
    this.tour.goTo(stepIndex);
    this.update();
  }

  update() {
    const { tour } = this, panel = document.getElementById("tour");
    panel.hidden = !tour.isActive;
    $("start").setAttribute("aria-pressed", tour.isActive);
    if (!tour.isActive) return;
    const { title, watch, tasks } = tour.step, isLast = tour.stepIndex + 1 === STEPS.length;
    panel.classList.toggle("completed", tour.isStepCompleted);
    const texts = {
      step: `Step ${tour.stepIndex + 1} of ${STEPS.length} ${tour.completedSteps.map(isCompleted => (isCompleted ? "●" : "○")).join(" ")}`,
      title, watch, explanation: tour.explanation, instruction: tour.task.instruction,
      progress: tour.progress?.text ?? "getting ready …",
      result: tour.isStepCompleted ? `✓ ${tour.resultText}` : "", next: isLast ? "Finish" : "Next",
    };
    // Unchanged texts are left alone, so that screen readers do not repeat them.
    for (const [name, text] of Object.entries(texts)) if ($(name).textContent !== text) $(name).textContent = text;
    const fraction = (tour.taskIndex + Math.min(tour.progress?.fraction ?? 0, 1)) / tasks.length;
    $("bar").value = tour.isStepCompleted ? 1 : Math.min(fraction, 0.99);
    $("demo").setAttribute("aria-pressed", tour.isDemo);
    $("demo").textContent = tour.isDemo ? "Try it" : "Show me";
    $("back").disabled = tour.stepIndex === 0;
  }
}
