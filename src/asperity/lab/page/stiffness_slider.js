// The slider of the stiffness, and the mark of the limit on it.

import { quantity } from "./format.js";

const $ = id => document.getElementById(id);

// The slider is logarithmic: 10 to 10 000 N/m.
export const toSlider = stiffness => Math.max(0, Math.min(1, Math.log10(stiffness / 10) / 3));
export const fromSlider = value => Number((10 * 10 ** (3 * value / 1000)).toPrecision(3));

/** Mark the limit at the slider, and say what it is. */
export function showLimit({ stiffness, law }, limit) {
  const known = Number.isFinite(limit.stiffness);
  $("limit").hidden = !known;
  const words = $("limit-words");
  words.classList.toggle("over", known && stiffness > limit.stiffness);
  if (known) {
    $("limit").style.left = `calc(0.5rem + ${toSlider(limit.stiffness)} * (100% - 1rem))`;
    const side = stiffness > limit.stiffness ? "▲ above" : "below";
    words.textContent = `${side} the limit of ${quantity(limit.stiffness, "N/m")} for law ${law}: ${limit.criterion} (${limit.basis})`;
  } else {
    words.textContent = limit.q === "inf" ? `No limit: the force of law ${law} jumps` : "basis" in limit ? `No limit is known${limit.basis === "none" ? "" : `: ${limit.basis}`}` : "Computing the limit …";
  }
}
