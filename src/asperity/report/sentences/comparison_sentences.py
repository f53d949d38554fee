"""Sentences of a comparison: the verdict on each law, and the recommendation with its reasons."""

from __future__ import annotations

import math
from collections import Counter

from asperity.analysis.limits.perceptibility import Perceptibility, texture_length
from asperity.analysis.passivity.device_loop import buzz_goal
from asperity.analysis.passivity.recommended_stiffness import Margin, load_margins
from asperity.analysis.results.compare import Comparison
from asperity.analysis.results.device_comparisons import DeviceComparisons, MissingData
from asperity.analysis.results.recommendation import LawRow
from asperity.core.units import format_quantity, round_down, round_up
from asperity.devices import Device
from asperity.report.sentences.limit_sentences import (
    force_magnitude_text,
    masking_text,
    remedies_text,
    texture_amount_text,
    unverified_text,
)
from asperity.report.sentences.passivity_sentences import (
    buzz_text,
    continuity_reason,
    delay_clause,
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
        parts.append(f"{row.tier}: {texture_amount_text(row.perceptibility)}")
    if row.rendering.truncated:
        share = 100.0 * row.rendering.truncated / row.rendering.samples
        parts.append(f"search truncated in {share:.2g} % of samples")
    if row.loses_contact:
        parts.append(f"no contact on {100.0 * row.contact_lost:.0f} % of the scan")
    return parts


def _instability_text(row: LawRow) -> str:
    """Return how a law may be unstable at its stiffness; empty if nothing is known of it."""
    stiffness = stiffness_limit_text(row.surface.stiffness)
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
    stiffness = stiffness_limit_text(row.surface.stiffness)
    if passivity.verdict == "bounded" and passivity.buzz is not None:
        return f"passive at {stiffness} but for steps: {buzz_text(passivity.buzz)}"
    if passivity.verdict == "plausible":
        return stability_limit_text(row.stability_limit, passivity.loop)
    return f"{passivity.verdict} at {stiffness}"


# --- the recommendation ---------------------------------------------------------------------------


def recommendation_text(comparison: Comparison) -> str:
    """Return the recommended law and stiffness, its perceptibility, and the reason."""
    row = comparison.recommended_row
    device = comparison.device
    if row is None or row.perceptibility is None:
        return _no_recommendation_text(comparison)
    texture = row.perceptibility
    effect = f"{texture_amount_text(texture)}: {row.tier}"
    if row.tier != "felt":
        effect += f"; {masking_text(texture)}"
    sentences = [
        f"{_choice_text(row, comparison)}, which gives {effect}.",
        unverified_text(texture),
        remedies_text(texture),
        _form_advice(texture),
        _contact_loss_text(row),
        _size_text(row, device),
        _SOUND_REASON if row.is_sound else _least_leak_reason(row, comparison),
        _limit_basis_text(row, device),
        _trade_off_text(row, comparison),
        _saturation_warning(row, device),
    ]
    return " ".join(filter(None, sentences))


def _choice_text(row: LawRow, comparison: Comparison) -> str:
    """Return the recommended law and its stiffness."""
    law = _law_title(row)
    device = comparison.device.name
    start = stiffness_limit_text(row.recommended_stiffness)
    if comparison.stiffness is None:
        return f"Use law {law} on the {device} and start at {start}"
    stiffness = format_quantity(comparison.stiffness, "N/m")
    if row.recommended_stiffness:
        return f"At {stiffness} use law {law} on the {device} (recommended is a start at {start})"
    return f"At {stiffness} use law {law} on the {device} (no start is known)"


def _law_title(row: LawRow) -> str:
    return f"{row.law.letter} ({row.law.name.replace('-', ' ')})"


def _form_advice(texture: Perceptibility) -> str:
    """Return how to remove form and waviness, where they make up most of the force."""
    if not texture.is_mostly_form:
        return ""
    return "Most of it is form and waviness, felt as a shape: form=2 and l_cutoff remove it."


def _contact_loss_text(row: LawRow) -> str:
    if not row.loses_contact:
        return ""
    depth = format_quantity(row.surface.max_depth, "m")
    full_depth = format_quantity(round_up((1.0 - 1e-9) * row.surface.texture.peak_to_valley), "m")
    return (
        f"Pressed to {depth} it loses contact on {100.0 * row.contact_lost:.0f} % of the scan; "
        f"pressed to {full_depth} it keeps contact (max_depth)."
    )


def _size_text(row: LawRow, device: Device) -> str:
    """Return a warning where surface or period are larger than the workspace, and what fits."""
    texture = row.surface.texture
    size = texture_length(texture)
    width = device.workspace_size
    if size <= width or not (texture.domain.periodic or texture.is_mirrored):
        return ""
    whole = "A period" if texture.domain.periodic else "The surface"
    factor = round_down(width / size, 2)
    return (
        f"{whole} is {format_quantity(size, 'm')} long and the workspace "
        f"{format_quantity(width, 'm')}: only a part can be touched, "
        f"or all of it magnified {factor:g} times more."
    )


def _no_recommendation_text(comparison: Comparison) -> str:
    """Return why no law is recommended."""
    device = comparison.device
    if all(row.is_textureless for row in comparison.rows):
        return "None of the laws compared renders a texture on this surface."
    row = comparison.nearest_row
    if row is None or row.perceptibility is None:
        if comparison.stiffness is not None:
            return _too_stiff_text(comparison, comparison.stiffness)
        return (
            f"No stable stiffness is known on the {device.name} for any of the laws compared: "
            "they need a known delay, or have no bound at this depth."
        )
    texture = row.perceptibility
    stiffness = stiffness_limit_text(row.surface.stiffness)
    amount = texture_amount_text(texture)
    sentences = [
        f"Nothing of this texture will be felt on the {device.name}: law {_law_title(row)}, which "
        f"comes nearest, gives at {stiffness} {amount}; {masking_text(texture)}.",
        remedies_text(texture),
        _form_advice(texture),
        _contact_loss_text(row),
        _size_text(row, device),
    ]
    return " ".join(filter(None, sentences))


def _too_stiff_text(comparison: Comparison, stiffness: float) -> str:
    """Return that no law is stable at the given stiffness, with the law that may be stiffest."""
    row = max(comparison.rows, key=lambda row: row.recommended_stiffness)
    text = (
        "No law that renders this texture is known to be stable at "
        f"{format_quantity(stiffness, 'N/m')} on the {comparison.device.name}"
    )
    if not row.recommended_stiffness:
        return f"{text}."
    start = stiffness_limit_text(row.recommended_stiffness)
    return f"{text}; law {_law_title(row)} can start at {start}."


def _limit_basis_text(row: LawRow, device: Device) -> str:
    """Return the basis of the recommended stiffness, in a sentence."""
    basis = row.stability_limit.basis
    if basis == "proved":
        return _proof_text(row, device)
    if basis == "bounded":
        return _bounded_text(row, device)
    if basis == "wall gain":
        delivery = delivery_text(row.passivity.loop)
        wall = _wall_text(device)
        return f"No stiffness is stable: its field {delivery}. {wall} {_margin_text(row)}"
    return f"{_wall_text(device)} {_plausible_text(row)} {_margin_text(row)}"


def _proof_text(row: LawRow, device: Device) -> str:
    at_most = stiffness_limit_text(row.stability_limit.stiffness or 0.0)
    delay = device.value("delay_samples") or 0.0
    proved_delay = row.passivity.greatest_delay
    if proved_delay is None or proved_delay < delay:
        samples = f"{delay:.0f}"
    else:
        samples = f"up to {proved_delay}"
    return f"It is proved passive up to {at_most}, at the start with {samples} samples of delay."


def _bounded_text(row: LawRow, device: Device) -> str:
    text = "It is passive there but for the steps of positions and forces"
    buzz = row.passivity.buzz
    if buzz is None:
        return f"{text}."
    goal = buzz_goal(device)
    relation = "within" if buzz.speed <= goal else "more than"
    speed = format_quantity(goal, "m/s")
    return f"{text}: {buzz_text(buzz)}, {relation} the {speed} for which starts are chosen."


def _plausible_text(row: LawRow) -> str:
    limit = row.stability_limit
    at_most = stiffness_limit_text(limit.stiffness or 0.0)
    proof = "not proved"
    if limit.proved_stiffness:
        proof = f"proved only up to {stiffness_limit_text(limit.proved_stiffness)}"
    text = (
        f"A limit of {at_most} for law {row.law.letter} is therefore "
        f"plausible{delay_clause(limit.delay)}, but {proof}"
    )
    if limit.delay == math.inf:
        return f"{text}; a longer delay than in that test lowers it."
    return f"{text}."


def _wall_text(device: Device) -> str:
    """Return the stiffest wall known of the device, in a sentence."""
    test = device.wall_test
    if test is None:
        return "The stiffest stable wall of this device is unknown."
    stiffness = stiffness_limit_text(test.value)
    if test.pedigree == "measured":
        return f"A smooth wall of {stiffness} was stable on this device."
    return f"The stiffest wall known to be stable on this device is {stiffness}."


def _margin_text(row: LawRow) -> str:
    """Return the safety margin below the stability limit and its reason, in a sentence."""
    margin = row.margin
    if not margin.loops:
        return "The recommended stiffness equals this limit."
    relation = "equals" if margin.factor == 1.0 else f"is {margin.factor:g} times"
    whole = "this limit" if row.conservative else "K₀/q, the gain of that wall"
    loops = simulated_loops_text(margin)
    text = f"The recommended stiffness {relation} {whole}: there {loops}."
    calibrated = {other.law: other.factor for other in load_margins(along_lightest=True).values()}
    factor = calibrated[margin.law]
    if factor <= margin.factor:
        return text
    return (
        f"{text} On a calibrated device, where a wall was tried along every axis, the factor is "
        f"{factor:g}: up to {factor / margin.factor:.2g} times stiffer (calibrate)."
    )


def simulated_loops_text(margin: Margin) -> str:
    """Return how many random simulated loops cycle, and how large a motion."""
    text = f"{margin.cycles} of {margin.loops} random simulated loops cycle"
    if not margin.cycles:
        return text
    speed = format_quantity(margin.speed, "m/s", digits=2)
    return f"{text}, at up to {speed} RMS and {margin.frequency:.2g} Hz"


_SOUND_REASON = "No closed path of its field gives net energy, and its force does not jump."


def _least_leak_reason(best: LawRow, comparison: Comparison) -> str:
    gain = format_quantity(best.leak.worst_per_period, "J")
    faint = [row for row in comparison.textured_rows if row.is_sound]
    reason = "None of the laws compared is conservative, continuous and known to work here"
    if faint:
        rival = max(faint, key=lambda row: row.resolved_force)
        force = force_magnitude_text(rival.resolved_force)
        stiffness = stiffness_limit_text(rival.surface.stiffness)
        reason = (
            f"Law {rival.law.letter}, conservative and continuous, gives only {force} RMS at its "
            f"{stiffness}, which is not felt"
        )
    return (
        f"{reason}; of the continuous laws this one leaks least for its texture force, "
        f"up to {gain} per loop, so it can feel alive."
    )


def _trade_off_text(best: LawRow, comparison: Comparison) -> str:
    """Return the stiffness that the recommended law gives up against a stiffer one."""
    if comparison.stiffness is not None:
        return ""
    rival = max(comparison.textured_rows, key=lambda row: row.recommended_stiffness)
    if rival.recommended_stiffness <= 1.5 * best.recommended_stiffness:
        return ""
    drawbacks = []
    if not rival.conservative:
        gain = format_quantity(rival.leak.worst_per_period, "J")
        drawbacks.append(f"gains up to {gain} per loop there")
    if not rival.continuous:
        drawbacks.append("its force jumps")
    start = stiffness_limit_text(rival.recommended_stiffness)
    drawback = " and ".join(drawbacks) or "has less texture"
    return f"The price is stiffness: law {rival.law.letter} can start at {start}, but {drawback}."


def _saturation_warning(row: LawRow, device: Device) -> str:
    """Return a warning if the force at full depth exceeds the device's maximum force."""
    limit = device.value("max_force")
    force = row.surface.stiffness * row.surface.max_depth
    if limit is None or force <= limit:
        return ""
    depth = format_quantity(row.surface.max_depth, "m")
    needed = format_quantity(force, "N")
    available = format_quantity(limit, "N")
    return f"Pressed to {depth} it needs {needed}; the device gives {available}."


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
        order = ("felt", "borderline", "not felt", _NO_LAW)
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
        law += f" at {format_quantity(best.stiffness, 'N/m')}"
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
