"""The comparison as one HTML file that needs no network."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import Any

import jinja2

import asperity
from asperity.analysis.analyze import Analysis
from asperity.analysis.compare import Comparison
from asperity.analysis.row import LawRow
from asperity.report.analysis_html import analysis_html
from asperity.report.pictures import style
from asperity.report.pictures.gain_picture import gain_figure
from asperity.report.pictures.merit_picture import merit_figure
from asperity.report.pictures.plots import field_figure, force_figure, surface_figure
from asperity.report.pictures.spectrum_picture import spectrum_figure
from asperity.report.words.number_words import (
    SAMPLED_NOTE,
    any_sampled,
    bound_text,
    force_text,
    law_title,
    leak_text,
    merit_text,
    position_text,
    stiffness_text,
    strength_has_unit,
    yes_no,
)
from asperity.units import engineering


@dataclass(frozen=True)
class _Picture:
    """A picture with its words.

    Attributes:
        title: heading.
        caption: what is to be seen.
        source: data URI.
    """

    title: str
    caption: str
    source: str


def html_text(result: Comparison | Analysis) -> str:
    """Return the report: answer, tables, pictures, pedigree and assumptions, in one HTML text.

    Pictures are inlined; nothing is loaded from elsewhere; light, dark and print are cared for.
    """
    return analysis_html(result) if isinstance(result, Analysis) else _comparison_html(result)


def _comparison_html(comparison: Comparison) -> str:
    return _template().render(
        title=f"Haptic texture on {comparison.device.name}",
        comparison=comparison,
        version=asperity.__version__,
        facts=_facts(comparison),
        rows=[_cells(row, comparison) for row in comparison.rows],
        strength_unit=" [m]" if strength_has_unit(comparison) else "",
        sampled_note=SAMPLED_NOTE if any_sampled(comparison) else "",
        pictures=_pictures(comparison),
        pedigree=[_pedigree(row) for row in comparison.rows],
        device_rows=_device_rows(comparison),
    )


@lru_cache(maxsize=1)
def _template() -> jinja2.Template:
    environment = jinja2.Environment(
        loader=jinja2.PackageLoader("asperity.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
    return environment.get_template("comparison.html.j2")


def _facts(comparison: Comparison) -> list[tuple[str, str]]:
    texture = comparison.texture
    facts = [("Surface", _described(texture.describe()))]
    facts.append(("Peak to valley", engineering(texture.peak_to_valley, "m")))
    facts.append(("Device", comparison.device.name))
    facts.append(("K₀, stiffest smooth wall", engineering(comparison.device.max_stiffness, "N/m")))
    facts.append(("Stiffness asked for", engineering(comparison.stiffness, "N/m")))
    facts.append(("Pressed to", engineering(comparison.max_depth, "m")))
    return facts


def _described(description: dict[str, Any]) -> str:
    """Return the kind of a texture and its plain arguments in words."""
    lengths = {"amplitude", "period", "pitch", "rms", "height", "size", "cutoff", "rolloff", "edge"}
    parts = []
    for name, value in description.items():
        if name in {"kind", "preparation", "phase", "direction", "phases", "wavevectors"}:
            continue
        values = value if isinstance(value, list) else [value]
        if len(values) > 4:
            parts.append(f"{len(values)} {name}")
            continue
        shown = [
            engineering(v, "m") if name in lengths and isinstance(v, float) else f"{v}"
            for v in values
        ]
        parts.append(f"{name.replace('_', ' ')} {' × '.join(shown)}")
    return f"{description['kind']}: {', '.join(parts)}"


def _cells(row: LawRow, comparison: Comparison) -> dict[str, Any]:
    return {
        "letter": row.law.letter,
        "name": law_title(row.law.name),
        "summary": row.law.summary,
        "q": bound_text(row.q),
        "q_note": f"{row.q.method}: {row.q.note}",
        "one_sided": bound_text(row.one_sided),
        "one_sided_note": f"{row.one_sided.method}: {row.one_sided.note}",
        "stiffness": stiffness_text(row),
        "rule": row.rule,
        "conservative": yes_no(row.conservative),
        "conservative_note": row.conservative_reason,
        "leak": leak_text(row, comparison),
        "leak_note": row.leak.description,
        "continuous": yes_no(row.continuous),
        "continuous_note": row.continuous_reason,
        "strength": merit_text(row.strength),
        "support": merit_text(row.support),
        "force": force_text(row.texture_force),
        "verdict": row.verdict,
        "recommended": row.law.letter == comparison.recommended,
    }


def _pictures(comparison: Comparison) -> list[_Picture]:
    depth = engineering(comparison.max_depth, "m")
    stiffness = engineering(comparison.stiffness, "N/m")
    drawn = [
        (
            "The surface",
            "As the laws see it, after preparation.",
            surface_figure(comparison.texture),
        ),
        (
            "Its spectrum",
            "Amplitude against wavelength along the scan line, with what the device can resolve.",
            spectrum_figure(comparison.texture, comparison.device),
        ),
        (
            "Force along a scan",
            f"Straight scan at constant height, {depth} below the highest point (below the smooth "
            f"wall for W, F and G), at {stiffness}.",
            force_figure(comparison),
        ),
        (
            "Force field over its curl",
            "Arrows: force on the probe in the vertical plane of the scan. Colour: curl; the probe "
            "gains energy on a loop around one colour. White everywhere: conservative. The dashed "
            "line is the scan. Law F is drawn sliding, its anchor trailing at full deflection.",
            field_figure(comparison),
        ),
        (
            "Loop gain",
            "‖J‖/k in the same plane: by how much the law multiplies the stiffness of the smooth "
            "wall at each place. The cross is the witness of q where it lies in the picture.",
            gain_figure(comparison),
        ),
        (
            "Strength and support",
            "How much texture and how much support each law gives for the loop gain that it costs. "
            "Up and to the right is better.",
            merit_figure(comparison),
        ),
    ]
    return [_Picture(title, caption, style.data_uri(figure)) for title, caption, figure in drawn]


def _pedigree(row: LawRow) -> dict[str, str]:
    return {
        "letter": row.law.letter,
        "q": f"{bound_text(row.q)} ({row.q.method}: {row.q.note})",
        "at": position_text(row.q.at) or "–",
        "one_sided": f"{bound_text(row.one_sided)} ({row.one_sided.method}: {row.one_sided.note})",
        "conservative": row.conservative_reason,
        "leak": f"{row.leak.method}: {row.leak.description}",
        "continuous": row.continuous_reason,
    }


def _device_rows(comparison: Comparison) -> list[dict[str, Any]]:
    return [
        {
            "field": field.replace("_", " "),
            "value": datum.text,
            "source": datum.source,
            "verified": datum.verified,
        }
        for field, datum in comparison.device.data.items()
    ]
