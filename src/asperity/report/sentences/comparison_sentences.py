"""Sentences of a comparison: verdicts, the best of several devices, text alternatives of figures.

:func:`asperity.report.document.html.render_picture` appends the ranges of lines and colours.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Iterable, Sequence

from asperity.analysis.results.compare import Comparison
from asperity.analysis.results.device_comparisons import DeviceComparisons, MissingData
from asperity.analysis.results.recommendation import LawRow
from asperity.core.units import count_text, format_quantity, format_stiffness, round_down
from asperity.envelopes.find_design import Design
from asperity.envelopes.searches import FORCE
from asperity.report.sentences.answer_sentences import friction_text
from asperity.report.sentences.limit_sentences import (
    force_magnitude_text,
    percent,
    press_text,
    texture_amount_text,
)
from asperity.report.sentences.passivity_sentences import (
    buzz_text,
    continuity_reason,
    delivery_text,
    leak_energy_text,
    stability_limit_text,
    stiffness_limit_text,
)
from asperity.report.sentences.texts import (
    SAMPLED_MARK,
    bound_text,
    friction_force_text,
    leak_text,
    limit_text,
    sentence,
    sentence_case,
)
from asperity.textures.texture import Texture

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
        f"{data.hint} to its file"
    )


def row_limit_text(row: LawRow) -> str:
    """Return the stability limit of the stiffness on the device: "995 N/m", or "none"."""
    limit = row.stability_limit
    if not limit.stiffness or not row.conservative:
        return "none"
    mark = SAMPLED_MARK if limit.sampled else ""
    return f"{mark}{format_quantity(round_down(limit.stiffness), 'N/m')}"


def recommended_stiffness_text(row: LawRow) -> str:
    """Return the recommended stiffness: "3050 N/m", "none", or "none useful"."""
    stiffness = row.recommended_stiffness
    if stiffness == row.surface.stiffness and not row.is_useful:
        return "none useful"
    return limit_text(stiffness) if stiffness else "none"


def requested_stiffness_text(comparison: Comparison) -> str:
    """Return the stiffness of a comparison, or that each law has its own."""
    stiffness = comparison.stiffness
    if stiffness is None:
        return "the recommended one of each law"
    return format_stiffness(stiffness)


def design_answer(result: Design) -> str:
    """Return the design, and whether it meets the target, in a few sentences."""
    design = f"{_design_text(result)}{_felt_force_text(result)}"
    names = " and ".join(result.binding)
    verb = "limits" if len(result.binding) == 1 else "limit"
    if not result.is_feasible:
        reached = _reached_text(result)
        return f"Not met. {reached} can be reached; {names} {verb} it. Nearest: law {design}."
    if result.target.texture_force is None:
        return f"The largest is law {design}. {sentence_case(names)} {verb} it."
    margin = min(result.margins.values())
    wanted = f"Asked for: at least {_target_text(result)}"
    return f"Law {design}. {wanted}. Least margin {margin:.3g}; {names} {verb} it."


def _reached_text(result: Design) -> str:
    """Return which share of the force asked for can be reached."""
    target = result.target.texture_force
    if target is None or not result.reachable:
        return "Nothing"
    return f"{percent(result.reachable / target)} of {_target_text(result)}"


def _target_text(result: Design) -> str:
    return f"{format_quantity(result.target.texture_force or 0.0, 'N')} {_force_unit(result)}"


def _design_text(result: Design) -> str:
    """Return letter, stiffness and size of a design."""
    texture = result.comparison.texture
    stiffness = limit_text(result.row.surface.stiffness)
    height = format_quantity(texture.peak_to_valley, "m")
    measure = "large" if texture.single_wave is None else "high"
    letter = result.row.law.letter
    size = f"{result.factor:.4g} times as {measure}: {height} peak to valley"
    return f"{letter} at {stiffness}, {size}"


def _felt_force_text(result: Design) -> str:
    """Return what is felt of the texture of a design, after a semicolon; empty if not known."""
    felt = result.row.perceptibility
    if felt is None:
        return ""
    target = result.target
    parts = [f"{force_magnitude_text(felt.texture_rms)} RMS of texture"]
    unit = _force_unit(result)
    if target.texture_force and unit != "RMS at the motor":
        parts.append(f"{force_magnitude_text(result.margins[FORCE] * target.texture_force)} {unit}")
    if target.min_support:
        parts.append(f"support {result.row.support:.2g}")
    return f"; {', '.join([*parts, felt.tier])}"


def _force_unit(result: Design) -> str:
    return f"{result.target.measure} at the {result.target.at}"


def case_title(comparison: Comparison) -> str:
    """Return device and depth of one of several comparisons."""
    return f"{comparison.device.name}, {format_quantity(comparison.max_depth, 'm')} deep"


def conservation_remarks(comparison: Comparison) -> list[str]:
    """Return for each law that it is conservative or dissipative, or what it leaks."""
    return [
        row.energy_balance if row.conservative else f"leaks up to {leak_text(row.leak)} per loop"
        for row in comparison.rows
    ]


# --- text alternatives ---------------------------------------------------------------------------


def join_letters(letters: Iterable[str]) -> str:
    """Return a list of letters as text, "none" for none."""
    return ", ".join(letters) or "none"


def surface_alt_text(texture: Texture) -> str:
    """Return the size of a surface."""
    height = format_quantity(texture.peak_to_valley, "m")
    if texture.is_profile:
        return f"Section of the body along its scan line, {height} from peak to valley."
    sides = " by ".join(
        [format_quantity(float((span @ span) ** 0.5), "m") for span in texture.domain.spans]
    )
    return sentence("map", sides=sides, height=height)


def spectrum_alt_text(wavelength: float, amplitude: float, shortest_waves: Sequence[str]) -> str:
    """Return the strongest wave [m], and the shortest waves for the device."""
    strongest = format_quantity(amplitude, "m", digits=3)
    length = format_quantity(wavelength, "m", digits=3)
    text = f"The strongest wave has an amplitude of {strongest} at a wavelength of {length}."
    if not shortest_waves:
        return text
    return f"{text} Lines mark the shortest waves for the device: {'; '.join(shortest_waves)}."


def hand_alt_text(comparison: Comparison) -> str:
    """Return the law, how much of what is felt its texture reaches, and at which frequency."""
    row = comparison.recommended_row or comparison.nearest_row
    if row is None or row.perceptibility is None:
        return "Thresholds of the hand; no law has a known stiffness."
    return sentence("hand", law=row.law.letter, felt=row.perceptibility)


def force_alt_text(comparison: Comparison, length: float) -> str:
    """Return length [m] and number of the force curves."""
    span = format_quantity(length, "m", digits=3)
    return sentence("force", length=span, laws=_law_count_text(comparison))


def field_alt_text(comparison: Comparison) -> str:
    """Return the laws whose fields have curl, and those without."""
    without = join_letters([row.law.letter for row in comparison.rows if row.conservative])
    with_curl = join_letters([row.law.letter for row in comparison.rows if not row.conservative])
    panels = f"Arrows of force over curl, a panel for each of {_law_count_text(comparison)}"
    return f"{panels}. Without curl: {without}; with curl: {with_curl}."


def gain_alt_text(comparison: Comparison) -> str:
    """Return the laws with the greatest and the least loop gain."""
    rows = sorted(comparison.rows, key=lambda row: row.q.value)
    ends = [f"{row.law.letter} ({bound_text(row.q)})" for row in (rows[0], rows[-1])]
    return sentence("gain", laws=_law_count_text(comparison), least=ends[0], greatest=ends[1])


def merit_alt_text(comparison: Comparison) -> str:
    """Return the conservative and continuous laws; the points are listed from the figure."""
    sound = [row.law.letter for row in comparison.rows if row.conservative and row.continuous]
    points = f"Strength against support, a point for each of {_law_count_text(comparison)}"
    return f"{points}. Conservative and continuous: {join_letters(sound)}."


def risk_alt_text(comparison: Comparison) -> str:
    """Return the share of random loops that cycle at the limit, for each law."""
    rows = [row for row in comparison.rows if row.margin.curve]
    if not rows:
        return "No limit of these laws needs a margin."
    shares = [f"{row.law.letter} {percent(row.margin.limit_share)}" for row in rows]
    return f"Share of random loops that cycle, at the limit itself: {', '.join(shares)}."


def _law_count_text(comparison: Comparison) -> str:
    return count_text(len(comparison.rows), "law")
