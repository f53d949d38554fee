"""What is seen in the pictures of a surface and of laws on it, for who does not see them.

Each is the beginning of a text alternative; what lines and colours range over is added by
:func:`asperity.report.page.picture`.
"""

from __future__ import annotations

from collections.abc import Iterable

from asperity.analysis.analysis_result import Analysis
from asperity.analysis.compare import Comparison
from asperity.report.words.number_words import bound_text, interval_text, span_text
from asperity.textures.texture import Texture
from asperity.units import engineering


def listed(letters: Iterable[str]) -> str:
    """Return letters for reading, "none" for none."""
    return ", ".join(letters) or "none"


def surface(texture: Texture) -> str:
    """Return what is seen of a surface."""
    height = engineering(texture.peak_to_valley, "m")
    if texture.is_profile:
        return f"The body cut along its scan line, {height} from peak to valley."
    sides = " by ".join(
        engineering(float((span @ span) ** 0.5), "m") for span in texture.domain.spans
    )
    return (
        f"A map of {sides} from above, {height} from peak to valley, and the body cut along the "
        "scan line."
    )


def spectrum(comparison: Comparison) -> str:
    """Return which wave is the strongest, and what the device resolves."""
    from asperity.report.pictures.spectrum_picture import device_limits, line_spectrum

    lengths, amplitudes = line_spectrum(comparison.texture)
    first = amplitudes.argmax()
    strongest = engineering(float(amplitudes[first]), "m", digits=3)
    length = engineering(float(lengths[first]), "m", digits=3)
    said = f"The strongest wave has an amplitude of {strongest} at a wavelength of {length}."
    limits = device_limits(comparison.device)
    if limits:
        said += f" Lines mark the shortest waves for the device: {'; '.join(w for _, w in limits)}."
    return said


def force(comparison: Comparison) -> str:
    """Return what is seen of the forces along the scan."""
    from asperity.report.pictures.force_picture import force_stretch

    length = engineering(force_stretch(comparison.texture).length, "m", digits=3)
    return f"Force along {length} of the scan line, a panel for each of {_laws(comparison)}."


def field(comparison: Comparison) -> str:
    """Return which laws' fields have curl."""
    return (
        f"Arrows of force over curl, a panel for each of {_laws(comparison)}. Without curl: "
        f"{listed(row.law.letter for row in comparison.rows if row.conservative)}; with curl: "
        f"{listed(row.law.letter for row in comparison.rows if not row.conservative)}."
    )


def gain(comparison: Comparison) -> str:
    """Return which law has the greatest and which the least loop gain."""
    rows = sorted(comparison.rows, key=lambda row: row.q.value)
    least, most = (f"{row.law.letter} ({bound_text(row.q)})" for row in (rows[0], rows[-1]))
    return (
        f"Loop gain in the vertical plane of the scan, a panel for each of {_laws(comparison)}. "
        f"The greatest anywhere, q, is least for {least} and greatest for {most}."
    )


def merit(comparison: Comparison) -> str:
    """Return which laws are sound; the points themselves are numbers of the picture."""
    sound = [row.law.letter for row in comparison.rows if row.conservative and row.continuous]
    return (
        f"Strength against support, a point for each of {_laws(comparison)}. Conservative and "
        f"continuous: {listed(sound)}."
    )


def _laws(comparison: Comparison) -> str:
    count = len(comparison.rows)
    return f"{count} law{'' if count == 1 else 's'}"


COMPARISON = {
    "surface": lambda comparison: surface(comparison.texture),
    "spectrum": spectrum,
    "force": force,
    "field": field,
    "gain": gain,
    "merit": merit,
}
"""Of the pictures of a comparison, by their names."""


def of_analysis(analysis: Analysis, name: str) -> str:
    """Return what is seen in the picture of that name."""
    law, leak = f"Law {analysis.surface.law.letter}", analysis.leak
    q = f"q = {interval_text(analysis.q)}"
    if name == "field":
        gained = span_text(leak.energy, leak.upper_per_period, "J")
        loop = f"; the worst loop gains {gained}" if len(leak.vertices) else ""
        return f"{law}: arrows of force over curl in a vertical plane{loop}."
    jumps = f"{len(analysis.continuity.jumps)} depths at which the force jumps, and by how much"
    return {
        "gain": f"{law}: loop gain in the vertical plane through the witness of q, {q}.",
        "top": f"{law}: the greatest loop gain over depth, seen from above, {q}.",
        "depth": f"{law}: singular values over depth down to the witness of q, {q}.",
        "jumps": f"{law}: {jumps}.",
    }[name]
