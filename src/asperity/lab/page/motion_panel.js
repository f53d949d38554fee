// Choice of the hand's motion, with a hint where only loops show that a field has curl.

import { findFeedingLoop } from "./feeding_loop.js";

const $ = name => document.getElementById(name);
const HINT = "This field has curl: loops feed the hand, straight strokes hide it.";

export class MotionPanel {
  /** @param host object with hand, section (a view) and isSectionCurrent */
  constructor(host) {
    this.host = host;
    this.buttons = [...$("motion").children];
    for (const button of this.buttons) button.onclick = () => this.choose(button.value);
  }

  /** Let the hand move otherwise; loops are placed where the field feeds the hand, in the sense that does. */
  choose(motion) {
    const { hand, section, isSectionCurrent } = this.host;
    const loop = motion === "loop" && isSectionCurrent ? findFeedingLoop(section, hand.loop) : null;
    this.awaitsPicture = motion === "loop" && !isSectionCurrent;
    if (loop) Object.assign(hand, { x: loop.x, loopRadius: loop.radiusX, loopSpeed: loop.sense * Math.abs(hand.loopSpeed) });
    hand.motion = motion;
    hand.requestMotion();
    this.update();
  }

  update() {
    const { hand, section, isSectionCurrent } = this.host;
    if (this.awaitsPicture && isSectionCurrent) this.choose(hand.motion); // the loop is placed once its field is known
    for (const button of this.buttons) button.setAttribute("aria-checked", button.value === hand.motion);
    const hint = isSectionCurrent && section.hasCurl && hand.motion !== "loop" ? HINT : "";
    if ($("motion-note").textContent !== hint) $("motion-note").textContent = hint;
  }
}
