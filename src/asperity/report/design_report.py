"""Report of a texture that meets a target on a device."""

from __future__ import annotations

from asperity.analysis.limits.perceptibility_sentences import force_magnitude_text
from asperity.analysis.results.check_limits import percent
from asperity.core.units import format_quantity
from asperity.envelopes.find_design import Design
from asperity.envelopes.searches import FORCE, MET
from asperity.report import page
from asperity.report.comparison_report import comparison_page
from asperity.report.page import Cell, Media, Row, Section, Table


def design_page(result: Design) -> page.Page:
    """Return the report: answer, margins, what is lost, and the comparison of the answer."""
    compared = comparison_page(result.comparison)
    rows = []
    for name, ratio in result.margins.items():
        note = "limits the answer" if name in result.binding else ""
        cell = Cell("not met", "no") if ratio < MET else note
        rows.append(Row([name, f"{ratio:.3g}", cell]))
    media = page.SCREEN | Media.HEADING
    title = "Margins: by which factor each requirement is exceeded"
    sections = [Section(title, [Table(("requirement", "margin", ""), rows, (1,))], media=media)]
    if result.lost:
        sections.append(Section("What the device takes away", [_lost_table(result)], media=media))
    return page.Page(
        title=f"Design for {result.comparison.device.name}",
        answer=design_answer(result),
        facts=compared.facts,
        sections=[*sections, *page.user_sections(Design, result), *compared.sections],
        footer=compared.footer,
    )


def _lost_table(result: Design) -> Table:
    """Return what the device takes away from the texture."""
    rows = []
    for name, value in result.lost.items():
        words, _, unit = name.rstrip("]").partition(" [")
        rows.append(Row([words, format_quantity(value, unit) if unit else percent(value)]))
    return Table(("of the texture", "not rendered"), rows, (1,))


def design_answer(result: Design) -> str:
    """Return the design, and whether it meets the target, in a few sentences."""
    row = result.row
    texture = result.comparison.texture
    target = result.target
    k = format_quantity(row.surface.stiffness, "N/m", 4)
    felt = row.perceptibility
    height = format_quantity(texture.peak_to_valley, "m")
    way = "as high" if texture.single_wave is not None else "as large"
    unit = f"{target.measure} at the {target.at}"
    text = f"law {row.law.letter} at {k}, {result.factor:.4g} times {way}: {height} peak to valley"
    if felt is not None:
        text += f"; {force_magnitude_text(felt.texture_rms)} RMS of texture, "
        if target.texture_force and unit != "RMS at the motor":
            text += f"{force_magnitude_text(result.margins[FORCE] * target.texture_force)} {unit}, "
        text += (f"support {row.support:.2g}, " if target.min_support else "") + felt.tier
    verb = "limits" if len(result.binding) == 1 else "limit"
    limits = f"{' and '.join(result.binding)} {verb} it"
    if not result.is_feasible:
        force = f"{force_magnitude_text(result.reachable)} {unit}"
        most = force if result.reachable else "Nothing"
        return f"Not met. {most} can be reached; {limits}. Nearest: {text}."
    if target.texture_force is None:
        return f"The largest is l{text[1:]}. {limits[0].upper()}{limits[1:]}."
    least = min(result.margins.values())
    return f"L{text[1:]}. Least margin {least:.3g}; {limits}."
