// Scale of the stiffness slider, and the mark of the stability limit on it.

import { formatLimit } from "./format.js";

const $ = id => document.getElementById(id);

// The slider is logarithmic: 10 to 10 000 N/m.
export const toSliderFraction = stiffness => Math.max(0, Math.min(1, Math.log10(stiffness / 10) / 3));
export const fromSliderValue = value => Number((10 * 10 ** (3 * value / 1000)).toPrecision(3));

/** Show the stability limit as a mark on the slider and as text, with what the contact shows of one that is exceeded. */
export function showLimit({ stiffness, law }, limit, quietText) {
  const isKnown = Number.isFinite(limit.stiffness), isExceeded = isKnown && limit.basis !== "wall gain" && stiffness > limit.stiffness;
  const text = `${limitText(stiffness, law, limit, isKnown)}${isExceeded ? quietText : ""}`;
  $("limit-mark").hidden = !isKnown;
  $("limit-text").classList.toggle("above-limit", isKnown && stiffness > limit.stiffness);
  if ($("limit-text").textContent !== text) $("limit-text").textContent = text;
  if (isKnown) $("limit-mark").style.left = `calc(0.5rem + ${toSliderFraction(limit.stiffness)} * (100% - 1rem))`;
}

function limitText(stiffness, law, limit, isKnown) {
  if (limit.basis === "wall gain") {
    return `No stiffness is stable: below a speed v* law ${law} delivers energy. ▲ marks the gain of the tested wall, ${formatLimit(limit.stiffness)}`;
  }
  if (isKnown) {
    const side = stiffness > limit.stiffness ? "▲ above" : "below";
    return `${side} the limit of ${formatLimit(limit.stiffness)} for law ${law}: ${limit.criterion} (${limit.basis})`;
  }
  if (limit.q === "inf") return `No limit: the force of law ${law} jumps`;
  if (!("basis" in limit)) return "Computing the limit …";
  return limit.basis === "none" ? "No limit is known" : `No limit is known: ${limit.basis}`;
}
