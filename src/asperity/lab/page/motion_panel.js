// Choice of the hand's motion, with a hint where only loops show that a field has curl.

import { findFeedingLoop } from "./feeding_loop.js";

const $ = name => document.getElementById(name);
const HINT = "has curl: loops feed the hand, straight strokes hide it.";

export class MotionPanel {
  /** @param host object with hand, section (the view whose field places loops) and isSectionCurrent */
  constructor(host) {
    this.host = host;
    this.buttons = [...$("motion").children];
    for (const button of this.buttons) button.onclick = () => this.choose(button.value);
  }

  /** Let the hand move otherwise; loops are placed where the field feeds the hand, in the sense that does. */
  choose(motion) {
    const { hand, section, isSectionCurrent } = this.host;
    const loop = motion === "loop" && isSectionCurrent ? findFeedingLoop(section, hand.loop) : null;
    this.awaitsCurl = motion === "loop" && !(isSectionCurrent && section.hasCurl);
    if (loop) Object.assign(hand, { x: loop.x, loopRadius: loop.radiusX, loopSpeed: loop.sense * Math.abs(hand.loopSpeed) });
    hand.motion = motion;
    hand.requestMotion();
    this.update();
  }

  update() {
    const { hand, section, isSectionCurrent } = this.host;
    if (hand.motion !== "loop") this.awaitsCurl = false;
    if (this.awaitsCurl && isSectionCurrent && section.hasCurl) this.choose("loop"); // placed once a field with curl is known
    for (const button of this.buttons) button.setAttribute("aria-checked", button.value === hand.motion);
    const field = section.label ? `The field of ${section.label}` : "This field";
    const hint = isSectionCurrent && section.hasCurl && hand.motion !== "loop" ? `${field} ${HINT}` : "";
    if ($("motion-note").textContent !== hint) $("motion-note").textContent = hint;
  }
}
