"""The answer of a comparison: two sentences, and the reasons behind them."""

from __future__ import annotations

import math
from collections.abc import Callable

from asperity.analysis.limits.perceptibility import Perceptibility, texture_length
from asperity.analysis.passivity.device_loop import buzz_goal
from asperity.analysis.passivity.recommended_stiffness import Margin, load_margins
from asperity.analysis.results.compare import Comparison
from asperity.analysis.results.recommendation import LawRow
from asperity.core.errors import ArgumentWriter, write_keyword
from asperity.core.units import count_text, format_quantity, format_stiffness, round_down, round_up
from asperity.core.version import __version__
from asperity.devices import Device
from asperity.report.sentences.limit_sentences import (
    force_magnitude_text,
    masking_text,
    percent,
    press_text,
    remedies_text,
    speed_text,
    texture_amount_text,
    unknown_frequencies_text,
    unverified_text,
)
from asperity.report.sentences.passivity_sentences import (
    buzz_text,
    delay_clause,
    delivery_text,
    leak_energy_text,
    stiffness_limit_text,
    update_rate_text,
)
from asperity.report.sentences.surface_text import describe_texture
from asperity.report.sentences.texts import FRICTION_PROOF, sentence_case


def recommendation_text(
    comparison: Comparison, write_argument: ArgumentWriter = write_keyword
) -> str:
    """Return the recommended law and stiffness, what is felt, and the one thing to watch.

    Args:
        comparison: the result.
        write_argument: writes arguments that change the answer, as in Python or as options.
    """
    remarks = _remarks(comparison, write_argument)
    return " ".join([_choice_text(comparison), *remarks[:1]])


def recommendation_reasons(
    comparison: Comparison, write_argument: ArgumentWriter = write_keyword
) -> tuple[str, ...]:
    """Return the reasons of the recommendation and all else to watch, in sentences."""
    further = _remarks(comparison, write_argument)[1:]
    return (*further, *filter(None, _reasons(comparison)))


def methods_text(comparison: Comparison) -> str:
    """Return a paragraph for a methods section: software, surface, law, device, assumptions."""
    texture = comparison.texture
    height = format_quantity(texture.peak_to_valley, "m")
    surface = f"{describe_texture(texture.describe())}; {height} peak to valley"
    row = comparison.recommended_row
    outcome = recommendation_text(comparison)
    if row is not None:
        depth = format_quantity(row.surface.max_depth, "m")
        outcome = (
            f"Law {_law_title(row)} was chosen, at {format_stiffness(row.surface.stiffness)} and "
            f"down to a depth of {depth}; its texture of {force_magnitude_text(row.resolved_force)}"
            f" RMS is {row.tier}, by the model. {_limit_text(row, comparison.device)}"
        )
    others = [f"for law {other.law.letter}" for other in comparison.rows if other is not row]
    assumed = [text for text in comparison.assumptions if not text.endswith(tuple(others))]
    return (
        f"Laws were compared with asperity {__version__} (after Campion and Hayward, 2008) on the "
        f"surface {surface}, for the {comparison.device.name} and scans at "
        f"{speed_text(comparison.speed)}. {outcome} "
        f"Assumptions: {'; '.join(assumed)}."
    )


# --- the first sentence ---------------------------------------------------------------------------


def _choice_text(comparison: Comparison) -> str:
    """Return law and stiffness, up to which depth, and what is felt; or why no law is chosen."""
    row = comparison.recommended_row
    if row is None or row.perceptibility is None:
        return _no_choice_text(comparison)
    device = comparison.device.name
    law = f"law {_law_title(row)} on the {device}"
    start = stiffness_limit_text(row.recommended_stiffness)
    start = f"{start} {update_rate_text(row.stability_limit)}".rstrip()
    choice = f"Use {law} and start at {start}"
    if comparison.stiffness is not None:
        stiffness = format_stiffness(comparison.stiffness)
        known = "no start is known"
        if row.recommended_stiffness:
            known = f"recommended is a start at {start}"
        choice = f"At {stiffness} use {law} ({known})"
    force = force_magnitude_text(row.resolved_force)
    effect = f"its texture of {force} RMS is {row.tier}"
    if row.resolved_force == 0.0:
        whole = force_magnitude_text(row.perceptibility.texture_rms)
        effect = f"its texture of {whole} RMS, sampled too coarsely, is {row.tier}"
    if row.tier == "unknown":
        ends = unknown_frequencies_text(row.perceptibility)
        effect = f"whether its texture of {force} RMS is felt, {ends}, is not known"
    return f"{choice}, {press_text(row)}: {effect}."


def _law_title(row: LawRow) -> str:
    title = f"{row.law.letter} ({row.law.name.replace('-', ' ')})"
    friction = row.surface.contact_friction
    if friction is None:
        return title
    kind = "modulated friction" if friction.modulation > 0.0 else "friction"
    return f"{title} with {kind} {friction.coefficient:g}"


def _no_choice_text(comparison: Comparison) -> str:
    """Return why no law is recommended."""
    device = comparison.device.name
    if all(row.is_textureless for row in comparison.rows):
        return "None of the laws compared renders a texture on this surface."
    row = comparison.nearest_row
    if row is None or row.perceptibility is None:
        if comparison.stiffness is not None:
            return _too_stiff_text(comparison, comparison.stiffness)
        return (
            f"No stable stiffness is known on the {device} for any of the laws compared: "
            "they need a known delay, or have no bound at this depth."
        )
    stiffness = stiffness_limit_text(row.surface.stiffness)
    if row.is_hidden_by_friction:
        return (
            f"No law is useful on the {device} at this depth: law {_law_title(row)}, which comes "
            f"nearest, {friction_text(row)}."
        )
    return (
        f"Nothing of this texture will be felt on the {device}: law {_law_title(row)}, which comes "
        f"nearest, gives {force_magnitude_text(row.resolved_force)} RMS at {stiffness}."
    )


def _too_stiff_text(comparison: Comparison, stiffness: float) -> str:
    """Return that no law is stable at the given stiffness, with the law that may be stiffest."""
    row = max(comparison.rows, key=lambda row: row.recommended_stiffness)
    text = (
        "No law that renders this texture is known to be stable at "
        f"{format_stiffness(stiffness)} on the {comparison.device.name}"
    )
    if not row.recommended_stiffness:
        return f"{text}."
    start = stiffness_limit_text(row.recommended_stiffness)
    return f"{text}; law {_law_title(row)} can start at {start}."


def friction_text(row: LawRow) -> str:
    """Return that the device's dry friction exceeds the press at which a law holds; else empty."""
    friction = row.device_friction
    if friction is None:
        return ""
    mark = "" if friction.is_trusted else " (not verified)"
    force = force_magnitude_text(row.press)
    limit = force_magnitude_text(friction.value)
    return f"may be pressed with at most {force}, less than the device's friction of {limit}{mark}"


# --- what to watch --------------------------------------------------------------------------------


def _remarks(comparison: Comparison, write_argument: ArgumentWriter) -> list[str]:
    """Return what to watch of the recommended law or the nearest, the most important first."""
    row = comparison.recommended_row or comparison.nearest_row
    if row is None or row.perceptibility is None:
        return []
    is_chosen = comparison.recommended_row is not None
    texture = row.perceptibility
    remarks = [
        _leak_text(row) if is_chosen and not row.is_sound else "",
        _faint_text(texture),
        _saturation_text(row, comparison.device) if is_chosen else "",
        _size_text(row, comparison.device),
        unverified_text(texture),
        _row_friction_text(row) if is_chosen else "",
        _contact_loss_text(row, write_argument),
        _form_text(texture),
        _limit_text(row, comparison.device) if is_chosen else "",
    ]
    return list(filter(None, remarks))


def _faint_text(texture: Perceptibility) -> str:
    """Return what makes a texture felt that is not; else empty."""
    if texture.tier == "felt":
        return ""
    return remedies_text(texture)


def _leak_text(row: LawRow) -> str:
    text = f"None that is felt is conservative and continuous: law {row.law.letter}"
    if not row.conservative:
        return f"{text} {delivery_text(row.passivity.loop)}, and can feel alive."
    return f"{text} clicks."


def _saturation_text(row: LawRow, device: Device) -> str:
    """Return a warning if the force at full depth exceeds the device's maximum force."""
    limit = device.value("max_force")
    force = row.surface.stiffness * row.surface.max_depth
    if limit is None or force <= limit:
        return ""
    depth = format_quantity(row.surface.max_depth, "m")
    needed = format_quantity(force, "N")
    available = format_quantity(limit, "N")
    return f"Pressed to {depth} it needs {needed}; the device gives {available}."


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


def _row_friction_text(row: LawRow) -> str:
    text = friction_text(row)
    return f"It {text}: near rest, friction holds the tool." if text else ""


def _contact_loss_text(row: LawRow, write_argument: ArgumentWriter) -> str:
    if not row.loses_contact:
        return ""
    depth = format_quantity(row.surface.max_depth, "m")
    full_depth = format_quantity(round_up((1.0 - 1e-9) * row.surface.texture.peak_to_valley), "m")
    return (
        f"Pressed to {depth} it loses contact on {100.0 * row.contact_lost:.0f} % of the scan; "
        f"pressed to {full_depth} it keeps contact ({write_argument('max_depth', full_depth)})."
    )


def _form_text(texture: Perceptibility) -> str:
    if not texture.is_mostly_form:
        return ""
    rms = force_magnitude_text(texture.rms)
    return f"Most of its force of {rms} RMS is form and waviness, felt as a shape."


def _limit_text(row: LawRow, device: Device) -> str:
    """Return how sure the limit of a stiffness is, in a sentence."""
    return _LIMIT_TEXTS[row.stability_limit.basis](row, device)


def _proved_text(row: LawRow, device: Device) -> str:
    at_most = stiffness_limit_text(row.stability_limit.stiffness or 0.0)
    delay = device.value("delay_samples") or 0.0
    proved_delay = row.passivity.greatest_delay
    if proved_delay is None or proved_delay < delay:
        samples = count_text(round(delay), "sample")
    else:
        samples = f"up to {count_text(proved_delay, 'sample')}"
    return f"It is proved passive up to {at_most}, at the start with {samples} of delay."


def _bounded_text(row: LawRow, device: Device) -> str:
    text = "It is passive there but for the steps of positions and forces"
    buzz = row.passivity.buzz
    if buzz is None:
        return f"{text}."
    goal = buzz_goal(device)
    relation = "within" if buzz.speed <= goal else "more than"
    speed = format_quantity(goal, "m/s")
    return f"{text}: {buzz_text(buzz)}, {relation} the {speed} for which starts are chosen."


def _plausible_text(row: LawRow, _device: Device) -> str:
    limit = row.stability_limit
    at_most = stiffness_limit_text(limit.stiffness or 0.0)
    proof = "not proved"
    if limit.proved_stiffness:
        proof = f"proved only up to {stiffness_limit_text(limit.proved_stiffness)}"
    text = f"Its limit of {at_most} is plausible{delay_clause(limit.delay)}, but {proof}"
    if limit.delay == math.inf:
        return f"{text}; a longer delay than in that test lowers it."
    return f"{text}."


def _no_limit_text(row: LawRow, _device: Device) -> str:
    return f"No stiffness is stable: its field {delivery_text(row.passivity.loop)}."


_LIMIT_TEXTS: dict[str, Callable[[LawRow, Device], str]] = {
    "proved": _proved_text,
    "bounded": _bounded_text,
    "plausible": _plausible_text,
    "wall gain": _no_limit_text,
    "none": _plausible_text,
}


# --- why ------------------------------------------------------------------------------------------


def _reasons(comparison: Comparison) -> list[str]:
    """Return why this law, and why at this stiffness; empty texts for reasons that do not apply."""
    row = comparison.recommended_row or comparison.nearest_row
    if row is None or row.perceptibility is None:
        return []
    texture = row.perceptibility
    reasons = [f"Law {row.law.letter} gives {texture_amount_text(texture)}."]
    if texture.tier != "felt":
        reasons.append(f"{sentence_case(masking_text(texture))}.")
    if comparison.recommended_row is None:
        return reasons
    sound = "No closed path of its field gives net energy, and its force does not jump."
    if row.energy_balance == "dissipative":
        sound += f" {sentence_case(FRICTION_PROOF)}."
    reasons.append(sound if row.is_sound else _least_leak_reason(row, comparison))
    if row.stability_limit.basis in ("plausible", "wall gain", "none"):
        reasons += [_wall_text(comparison.device), _margin_text(row)]
    reasons.append(_trade_off_text(row, comparison))
    return reasons


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
        return "The recommended stiffness equals the limit."
    relation = "equals" if margin.factor == 1.0 else f"is {margin.factor:g} times"
    whole = "the limit" if row.conservative else "K₀/q, the gain of that wall"
    loops = simulated_loops_text(margin)
    text = f"The recommended stiffness {relation} {whole}: there {loops}{_limit_share_text(row)}."
    calibrated = {other.law: other.factor for other in load_margins(along_lightest=True).values()}
    factor = calibrated[margin.law]
    if factor <= margin.factor:
        return text
    return (
        f"{text} On a calibrated device, where a wall was tried along every axis, the factor is "
        f"{factor:g}: up to {factor / margin.factor:.2g} times stiffer."
    )


def _limit_share_text(row: LawRow) -> str:
    """Return which share of the random loops cycles at the limit itself, after a semicolon."""
    limit = row.stability_limit.stiffness
    if row.margin.factor > row.margin.ceiling:
        return f"; the paper's pantograph, held loosely, does from {row.margin.ceiling:g} times on"
    if row.margin.factor == 1.0 or not limit:
        return ""
    return f"; {percent(row.margin.limit_share)} do at {stiffness_limit_text(limit)} itself"


def simulated_loops_text(margin: Margin) -> str:
    """Return how many random simulated loops cycle, and how large a motion."""
    text = f"{margin.cycles} of {margin.loops} random simulated loops cycle"
    if not margin.cycles:
        return text
    speed = format_quantity(margin.speed, "m/s", digits=2)
    return f"{text}, at up to {speed} RMS and {margin.frequency:.2g} Hz"


def _least_leak_reason(best: LawRow, comparison: Comparison) -> str:
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
        f"up to {leak_energy_text(best.leak)}, so it can feel alive."
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
        drawbacks.append(f"gains up to {leak_energy_text(rival.leak)} there")
    if not rival.continuous:
        drawbacks.append("its force jumps")
    start = stiffness_limit_text(rival.recommended_stiffness)
    drawback = " and ".join(drawbacks) or "has less texture"
    return f"The price is stiffness: law {rival.law.letter} can start at {start}, but {drawback}."
