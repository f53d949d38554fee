"""Sentences of a comparison: the verdict on each law, and the best of several devices."""

from __future__ import annotations

from collections import Counter

from asperity.analysis.results.compare import Comparison
from asperity.analysis.results.device_comparisons import DeviceComparisons, MissingData
from asperity.analysis.results.recommendation import LawRow
from asperity.core.units import format_quantity, format_stiffness, round_down
from asperity.report.sentences.answer_sentences import friction_text
from asperity.report.sentences.limit_sentences import press_text, texture_amount_text
from asperity.report.sentences.number_text import friction_force_text
from asperity.report.sentences.passivity_sentences import (
    buzz_text,
    continuity_reason,
    delivery_text,
    leak_energy_text,
    stability_limit_text,
    stiffness_limit_text,
)

# --- each law -------------------------------------------------------------------------------------


def row_verdict(row: LawRow) -> str:
    """Return the limit of a law that is quiet, and the artefacts to expect, in one line."""
    artefacts = row_artefacts(row)
    if row.conservative and not _instability_text(row):
        artefacts.insert(0, _passivity_text(row))
    if row.recommended_stiffness:
        artefacts.append(press_text(row))
    if row.friction_force is not None:
        artefacts.append(f"{row.energy_balance}: {friction_force_text(row.friction_force)}")
    return "; ".join(artefacts)


def row_artefacts(row: LawRow) -> list[str]:
    """Return the artefacts to expect from a law, each in a few words."""
    parts = []
    if instability := _instability_text(row):
        parts.append(instability)
    if not row.conservative:
        gain = f"feels alive: gains up to {leak_energy_text(row.leak)}"
        parts.append(f"{gain}; {delivery_text(row.passivity.loop)}")
    if not row.continuous:
        parts.append(f"clicks: {continuity_reason(row.continuity)}")
    if row.is_textureless:
        parts.append("no texture")
    elif row.perceptibility is not None and row.tier != "felt":
        stiffness = _row_stiffness_text(row)
        amount = texture_amount_text(row.perceptibility)
        parts.append(f"{row.tier} at {stiffness}: {amount}")
    friction = friction_text(row)
    if friction and row.recommended_stiffness and row.tier != "not felt":
        parts.append(friction)
    if row.rendering.truncated:
        share = 100.0 * row.rendering.truncated / row.rendering.samples
        parts.append(f"search truncated in {share:.2g} % of samples")
    if row.loses_contact:
        parts.append(f"no contact on {100.0 * row.contact_lost:.0f} % of the scan")
    return parts


def _row_stiffness_text(row: LawRow) -> str:
    """Return the stiffness of a row as in its table: a given one as typed."""
    if row.surface.stiffness == row.recommended_stiffness:
        return stiffness_limit_text(row.surface.stiffness)
    return format_stiffness(row.surface.stiffness)


def _instability_text(row: LawRow) -> str:
    """Return how a law may be unstable at its stiffness; empty if nothing is known of it."""
    if row.greatest_press is not None:
        press = format_quantity(round_down(row.greatest_press, 2), "N")
        return f"none: above {press} at any stiffness"
    stiffness = _row_stiffness_text(row)
    stability = stability_limit_text(row.stability_limit, row.passivity.loop)
    if row.passivity.verdict == "not passive" and row.conservative:
        return f"not passive at {stiffness}; {stability}"
    if not row.recommended_stiffness:
        return stability
    if not row.may_buzz:
        return ""
    if row.conservative:
        return f"may buzz at {stiffness}; {stability}"
    return f"may buzz at {stiffness}"


def _passivity_text(row: LawRow) -> str:
    """Return the passivity of a conservative law at its stiffness."""
    passivity = row.passivity
    stiffness = _row_stiffness_text(row)
    if passivity.verdict == "bounded" and passivity.buzz is not None:
        return f"passive at {stiffness} but for steps: {buzz_text(passivity.buzz)}"
    if passivity.verdict == "plausible":
        return stability_limit_text(row.stability_limit, passivity.loop)
    return f"{passivity.verdict} at {stiffness}"


# --- several devices ------------------------------------------------------------------------------

_NO_LAW = "no law"


def device_recommendation(result: DeviceComparisons) -> str:
    """Return the best device and law for the texture, and the number of cases by tier."""
    sentences = []
    if result.best_case is not None:
        sentences.append(_best_case_text(*result.best_case))
    count = len(result.comparisons)
    tiers = Counter([case.tier or _NO_LAW for case in result.comparisons])
    if count:
        order = ("felt", "borderline", "unknown", "not felt", _NO_LAW)
        counts = ", ".join([f"{tier} in {tiers[tier]}" for tier in order if tiers[tier]])
        plural = "s" if count > 1 else ""
        sentences.append(f"Of {count} case{plural}: {counts}.")
    if result.missing_data:
        names = ", ".join([data.device for data in result.missing_data])
        sentences.append(f"No smooth wall is known to have held on {names}.")
    return " ".join(sentences)


def _best_case_text(best: Comparison, row: LawRow) -> str:
    """Return the device, depth and law of the strongest texture, in a sentence."""
    law = f"law {row.law.letter}"
    if best.stiffness is not None:
        law += f" at {format_stiffness(best.stiffness)}"
    elif row.recommended_stiffness:
        law += f" from {format_quantity(row.recommended_stiffness, 'N/m')}"
    if row.perceptibility is not None:
        law += f", {row.tier}, {texture_amount_text(row.perceptibility)}"
    depth = format_quantity(best.max_depth, "m")
    return f"Best on the {best.device.name}, pressed to {depth}: {law}."


def missing_data_sentence(data: MissingData) -> str:
    """Return the data that a device lacks for a comparison, and how to supply them."""
    return (
        f"{data.device}: the stiffest smooth wall that held is unknown; measure it, and add "
        f"{data.hint} to its file, or set {data.field}=...{data.unit}"
    )
