// What the comparison of all laws recommends for the surface, device and hand, and a button that applies it.

import { formatLimit, formatQuantity } from "./format.js";

const $ = name => document.getElementById(name);

/** Set a text unless it is unchanged, so that screen readers do not repeat it. */
const setText = (name, text) => { if ($(name).textContent !== text) $(name).textContent = text; };

export class RecommendationPanel {
  /** @param changeScene requests changes of the scene */
  constructor(changeScene) {
    this.changes = null; // that apply the recommendation
    $("apply-recommendation").onclick = () => this.changes && changeScene(this.changes);
  }

  /** Show the recommendation of a status; its button is disabled without control, or where it is applied already. */
  update({ recommendation, settings, has_control: hasControl }) {
    const { changes = null, reason } = recommendation;
    this.changes = changes;
    setText("recommendation", headline(recommendation));
    setText("recommendation-note", note(recommendation));
    $("recommendation-why").hidden = !reason || !changes;
    setText("recommendation-reason", changes ? `${reason} Assumed hand: ${recommendation.grip}.` : "");
    const isApplied = changes && Object.entries(changes).every(([name, value]) => settings[name] === value);
    const button = $("apply-recommendation");
    button.hidden = !changes;
    button.disabled = !hasControl || isApplied;
    if (changes) button.textContent = isApplied ? `Law ${changes.law} is rendered` : `Use law ${changes.law} at ${formatQuantity(changes.stiffness, "N/m")}`;
  }
}

function headline({ changes, reason, tier, is_recommended: isRecommended }) {
  if (!reason) return "computing …";
  if (!changes) return "none";
  const law = `law ${changes.law} at ${formatQuantity(changes.stiffness, "N/m")}`;
  return isRecommended ? `${law}: ${tier}` : `none is felt; nearest: ${law}`;
}

function note({ changes, reason, limit, amount }) {
  if (!reason) return "All laws are compared on this surface and device.";
  if (!changes) return reason;
  const bound = limit.basis === "wall gain" ? "no stiffness is stable for it" : `limit ${formatLimit(limit.stiffness)} (${limit.basis})`;
  return `${bound}; ${amount}`;
}
