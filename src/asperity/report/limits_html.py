"""The six limits as one HTML file that needs no network."""

from __future__ import annotations

from functools import lru_cache
from typing import Any

import jinja2

import asperity
from asperity.analysis.limits.limit_result import Limits, RenderedWave
from asperity.analysis.limits.limit_rules import Limit
from asperity.analysis.limits.limit_words import percent, speed_text, speeds_text, stiffness_text
from asperity.devices import FIELD_TABLE
from asperity.report.limits_table import (
    MOST_WAVES,
    ON_WAVES,
    allows_text,
    caption,
    holds_text,
    share_text,
    shown_waves,
    side_text,
)
from asperity.report.pictures import style
from asperity.report.pictures.limits_picture import limits_figure
from asperity.units import engineering


def limits_html(result: Limits) -> str:
    """Return the report: answer, limits, picture, waves and assumptions, in one HTML text.

    The picture is inlined; nothing is loaded from elsewhere; light, dark and print are cared for.
    """
    return _template().render(
        title=f"Will I feel it? Law {result.surface.law.letter} on {result.device.name}",
        result=result,
        version=asperity.__version__,
        facts=_facts(result),
        limits=[_limit(limit) for limit in result.limits],
        symbols=caption(result)[:2],
        picture=style.data_uri(limits_figure(result)),
        on_waves=ON_WAVES,
        waves=[_wave(wave) for wave in shown_waves(result)],
        more_waves=max(len(result.waves) - MOST_WAVES, 0),
        device_rows=_device_rows(result),
        unknown=[
            f"{field.replace('_', ' ')}: {FIELD_TABLE[field].words}"
            for field in _used(result)
            if field not in result.device.data
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
    return environment.get_template("limits.html.j2")


def _facts(result: Limits) -> list[tuple[str, str]]:
    texture, surface = result.texture, result.surface
    facts = [("Surface", str(texture.describe()["kind"]))]
    facts.append(("Peak to valley", engineering(texture.peak_to_valley, "m")))
    facts.append(("Law", f"{surface.law.letter}, {surface.law.name.replace('-', ' ')}"))
    facts.append(("Device", result.device.name))
    facts.append(("Scanning speed", speed_text(result.speed)))
    facts.append(("Stiffness", stiffness_text(result)))
    facts.append(("Speeds at which all decided limits hold", speeds_text(result.speeds)))
    facts.append(("Texture force", engineering(result.force.rms, "N", digits=2) + " RMS"))
    return facts


def _limit(limit: Limit) -> dict[str, str]:
    return {
        "number": str(limit.number),
        "name": limit.name,
        "inequality": limit.inequality,
        "left": side_text(limit.left, limit.unit),
        "right": side_text(limit.right, limit.unit),
        "holds": holds_text(limit.holds),
        "share": share_text(limit),
        "allows": allows_text(limit),
    }


def _wave(wave: RenderedWave) -> dict[str, Any]:
    return {
        "wavelength": engineering(wave.wavelength, "m"),
        "amplitude": engineering(wave.amplitude, "m"),
        "share": percent(wave.share),
        "frequency": engineering(wave.frequency, "Hz"),
        "force": engineering(wave.force, "N", digits=2),
        "holds": [holds_text(wave.holds.get(number)) for number in ON_WAVES],
        "speeds": speeds_text((0.0, wave.top_speed)),
    }


def _used(result: Limits) -> list[str]:
    """Return the fields of the device that the limits and the force are compared with."""
    return [*dict.fromkeys(limit.uses for limit in result.limits), "friction"]


def _device_rows(result: Limits) -> list[dict[str, Any]]:
    return [
        {
            "field": field.replace("_", " "),
            "value": result.device.data[field].text,
            "source": result.device.data[field].source,
            "verified": result.device.data[field].verified,
        }
        for field in _used(result)
        if field in result.device.data
    ]
