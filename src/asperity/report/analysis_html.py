"""The analysis as one HTML file that needs no network."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import jinja2

import asperity
from asperity.analysis.analyze import Analysis
from asperity.analysis.passivity.criteria import Criterion
from asperity.devices import FIELD_TABLE
from asperity.report.pictures import style
from asperity.report.pictures.analysis_pictures import analysis_figure, pictures_of
from asperity.report.words.analysis_words import (
    down_text,
    holds_text,
    interval_text,
    jump_rows,
    leak_facts,
    limit_text,
    margin_text,
    merit_facts,
    notes,
    numbers,
    reproduction,
    up_text,
    witness_text,
)
from asperity.report.words.number_words import law_title
from asperity.units import engineering

_PICTURES = {
    "field": (
        "The field and the worst loop",
        "Arrows: force on the probe. Colour: curl; the probe gains energy on a loop around one "
        "colour. White everywhere: conservative. Blue: the worst loop, turned as its arrows say, "
        "projected on the plane. The dashed line is the scan; what lies deeper than the working "
        "region is paled. Law F is drawn sliding, its anchor trailing at full deflection; its "
        "worst loop may lie in a horizontal plane and is then seen from the side.",
    ),
    "gain": (
        "Where the loop gain is",
        "‖J‖/k in the vertical plane through the witness of q: by how much the law multiplies the "
        "stiffness of the smooth wall at each place. Computed on a grid, which meets thin ridges "
        "of the medial axis only here and there.",
    ),
    "top": (
        "The loop gain from above",
        "The greatest ‖J‖/k of five depths below each point, sampled on a grid: greater values "
        "may lie between. The bounds of q above are not sampled.",
    ),
    "depth": (
        "Singular values over depth",
        "Those of J/k on the way down to the witness of q; ‖J‖/k is the greatest. The lines are "
        "the bounds of q.",
    ),
    "jumps": (
        "How far the force jumps",
        "At each depth the difference of the force at two points on either side of the medial "
        "axis, closer together than 1e-9 of the texture.",
    ),
}
# What the criteria of passivity use of the device.
_USED = ("max_stiffness", "update_rate", "damping", "virtual_damping", "delay_samples")


def analysis_html(analysis: Analysis, texture: str = "") -> str:
    """Return the report: verdict, numbers, criteria, pictures and assumptions, in one HTML text.

    Pictures are inlined; nothing is loaded from elsewhere; light, dark and print are cared for.

    Args:
        analysis: the result.
        texture: an expression of Python that makes the texture; see
            :func:`asperity.report.words.analysis_words.reproduction`.
    """
    law = analysis.surface.law
    return _template().render(
        title=f"Law {law.letter} on the {analysis.device.name}",
        analysis=analysis,
        version=asperity.__version__,
        facts=_facts(analysis),
        numbers=[
            {
                "name": name,
                "lower": down_text(bound.lower),
                "upper": up_text(bound.upper),
                "method": bound.method,
                "at": witness_text(bound),
            }
            for name, bound in numbers(analysis)
        ],
        notes=notes(analysis),
        criteria=[_criterion(one, analysis) for one in analysis.passivity.criteria],
        loop=leak_facts(analysis),
        jumps=jump_rows(analysis),
        scan=merit_facts(analysis),
        pictures={name: _picture(analysis, name) for name in pictures_of(analysis)},
        code="\n".join(reproduction(analysis, texture)),
        device_rows=_device_rows(analysis),
        unknown=[
            f"{field.replace('_', ' ')}: {FIELD_TABLE[field].words}"
            for field in _USED
            if field not in analysis.device.data
        ],
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
    return environment.get_template("analysis.html.j2")


def _facts(analysis: Analysis) -> list[tuple[str, str]]:
    surface = analysis.surface
    facts = [("Surface", str(surface.texture.describe()["kind"]))]
    facts.append(("Peak to valley", engineering(surface.texture.peak_to_valley, "m")))
    facts.append(("Law", f"{surface.law.letter}, {law_title(surface.law.name)}"))
    facts.append(("Device", analysis.device.name))
    facts.append(("Stiffness", f"{surface.stiffness:g} N/m"))
    facts.append(("Pressed to", engineering(surface.max_depth, "m")))
    facts.append(("Characteristic number q", interval_text(analysis.q)))
    decisive = analysis.passivity.criterion(analysis.passivity.decided_by)
    facts.append((f"Greatest stiffness by {decisive.name}", limit_text(decisive)))
    return facts


def _criterion(criterion: Criterion, analysis: Analysis) -> dict[str, Any]:
    return {
        "name": criterion.name,
        "formula": criterion.formula,
        "holds": holds_text(criterion),
        "limit": limit_text(criterion),
        "margin": margin_text(criterion),
        "says": criterion.says,
        "assumptions": criterion.assumptions,
        "decides": criterion.name == analysis.passivity.decided_by,
    }


def _picture(analysis: Analysis, name: str) -> dict[str, str]:
    title, caption = _PICTURES[name]
    source = style.data_uri(analysis_figure(analysis, name))
    return {"title": title, "caption": caption, "source": source}


def _device_rows(analysis: Analysis) -> list[dict[str, Any]]:
    return [
        {
            "field": field.replace("_", " "),
            "value": analysis.device.data[field].text,
            "source": analysis.device.data[field].source,
            "verified": analysis.device.data[field].verified,
        }
        for field in _USED
        if field in analysis.device.data
    ]
