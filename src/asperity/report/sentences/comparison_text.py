"""Comparisons of laws and designs as sentences, and text alternatives of their figures.

:func:`asperity.report.document.html.render_picture` appends the ranges of lines and colours.
"""

from __future__ import annotations

from collections.abc import Iterable, Sequence

from asperity.analysis.results.compare import Comparison
from asperity.analysis.results.recommendation import LawRow
from asperity.core.units import count_text, format_quantity, format_stiffness, round_down
from asperity.envelopes.find_design import Design
from asperity.envelopes.searches import FORCE
from asperity.report.sentences import number_text
from asperity.report.sentences.limit_sentences import force_magnitude_text, percent
from asperity.report.sentences.number_text import bound_text, leak_text
from asperity.report.sentences.texts import sentence, sentence_case
from asperity.textures.texture import Texture


def row_limit_text(row: LawRow) -> str:
    """Return the stability limit of the stiffness on the device: "995 N/m", or "none"."""
    limit = row.stability_limit
    if not limit.stiffness or not row.conservative:
        return "none"
    mark = number_text.SAMPLED_MARK if limit.sampled else ""
    return f"{mark}{format_quantity(round_down(limit.stiffness), 'N/m')}"


def recommended_stiffness_text(row: LawRow) -> str:
    """Return the recommended stiffness: "3050 N/m", "none", or "none useful"."""
    stiffness = row.recommended_stiffness
    if stiffness == row.surface.stiffness and not row.is_useful:
        return "none useful"
    return number_text.limit_text(stiffness) if stiffness else "none"


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
    stiffness = number_text.limit_text(result.row.surface.stiffness)
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
