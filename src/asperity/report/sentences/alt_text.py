"""Text alternatives of the figures of a comparison, and the figures of an analysis.

:func:`asperity.report.document.html.render_picture` appends the ranges of lines and colours.
"""

from __future__ import annotations

from collections.abc import Callable, Iterable

from asperity.analysis.results.analyze import Analysis
from asperity.analysis.results.compare import Comparison
from asperity.core.units import format_quantity
from asperity.report.sentences.number_text import bound_text
from asperity.report.sentences.texts import sentence
from asperity.textures.texture import Texture


def join_letters(letters: Iterable[str]) -> str:
    """Return a list of letters as text, "none" for none."""
    return ", ".join(letters) or "none"


def surface_alt_text(texture: Texture) -> str:
    """Return the size of a surface."""
    height = format_quantity(texture.peak_to_valley, "m")
    if texture.is_profile:
        return f"Section of the body along its scan line, {height} from peak to valley."
    sides = " by ".join(
        format_quantity(float((span @ span) ** 0.5), "m") for span in texture.domain.spans
    )
    return sentence("map", sides=sides, height=height)


def spectrum_alt_text(comparison: Comparison) -> str:
    """Return the strongest wave, and the resolution of the device."""
    from asperity.report.pictures.device_pictures import device_wavelength_limits, line_spectrum

    lengths, amplitudes = line_spectrum(comparison.texture)
    first = amplitudes.argmax()
    strongest = format_quantity(float(amplitudes[first]), "m", digits=3)
    length = format_quantity(float(lengths[first]), "m", digits=3)
    text = f"The strongest wave has an amplitude of {strongest} at a wavelength of {length}."
    limits = device_wavelength_limits(comparison.device)
    if limits:
        words = "; ".join(words for _length, words in limits)
        text += f" Lines mark the shortest waves for the device: {words}."
    return text


def hand_alt_text(comparison: Comparison) -> str:
    """Return the law, how much of what is felt its texture reaches, and at which frequency."""
    row = comparison.recommended_row or comparison.nearest_row
    if row is None or row.perceptibility is None:
        return "Thresholds of the hand; no law has a known stiffness."
    return sentence("hand", law=row.law.letter, found=row.perceptibility)


def force_alt_text(comparison: Comparison) -> str:
    """Return length and number of the force curves."""
    from asperity.report.pictures.law_pictures import force_segment

    length = format_quantity(force_segment(comparison.texture).length, "m", digits=3)
    return sentence("force", length=length, laws=_law_count_text(comparison))


def field_alt_text(comparison: Comparison) -> str:
    """Return the laws whose fields have curl, and those without."""
    without = join_letters(row.law.letter for row in comparison.rows if row.conservative)
    with_curl = join_letters(row.law.letter for row in comparison.rows if not row.conservative)
    panels = f"Arrows of force over curl, a panel for each of {_law_count_text(comparison)}"
    return f"{panels}. Without curl: {without}; with curl: {with_curl}."


def gain_alt_text(comparison: Comparison) -> str:
    """Return the laws with the greatest and the least loop gain."""
    rows = sorted(comparison.rows, key=lambda row: row.q.value)
    least, most = (f"{row.law.letter} ({bound_text(row.q)})" for row in (rows[0], rows[-1]))
    return sentence("gain", laws=_law_count_text(comparison), least=least, most=most)


def merit_alt_text(comparison: Comparison) -> str:
    """Return the conservative and continuous laws; the points are listed from the figure."""
    sound = [row.law.letter for row in comparison.rows if row.conservative and row.continuous]
    points = f"Strength against support, a point for each of {_law_count_text(comparison)}"
    return f"{points}. Conservative and continuous: {join_letters(sound)}."


def _law_count_text(comparison: Comparison) -> str:
    count = len(comparison.rows)
    return f"{count} law{'' if count == 1 else 's'}"


_COMPARISON_ALT_TEXTS: dict[str, Callable[[Comparison], str]] = {
    "surface": lambda comparison: surface_alt_text(comparison.texture),
    "spectrum": spectrum_alt_text,
    "hand": hand_alt_text,
    "force": force_alt_text,
    "field": field_alt_text,
    "gain": gain_alt_text,
    "merit": merit_alt_text,
}


COMPARISON_FIGURES = tuple(_COMPARISON_ALT_TEXTS)
"""Names of the figures of a comparison, in the order of its page."""


def comparison_alt_text(comparison: Comparison, name: str) -> str:
    """Return the text alternative of a figure of a comparison by its name."""
    return _COMPARISON_ALT_TEXTS[name](comparison)


def analysis_figure_names(analysis: Analysis) -> list[str]:
    """Return the names of the figures that an analysis has."""
    top = [] if analysis.surface.texture.is_profile else ["top"]
    return ["field", "gain", *top, "depth"]
