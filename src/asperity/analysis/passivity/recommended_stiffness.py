"""Recommended stiffness of a law on a device: its stability limit times a safety margin.

That a smooth wall was stable shows neither the damping sideways, nor the mass that a texture moves,
nor the grip. ``margins.toml`` holds, law by law, the least stiffness over K₀/q at which the
simulated loops of ``python -m bench.margins`` began to cycle.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.passivity.criteria import evaluate_criteria
from asperity.analysis.passivity.device_loop import make_device_loop
from asperity.analysis.passivity.verdict import StabilityLimit, stability_limit
from asperity.core.arguments import DEFAULT_STIFFNESS
from asperity.core.files import Serializable
from asperity.core.units import round_down
from asperity.devices import Device
from asperity.laws import Law, find_law
from asperity.surface import Surface

_MARGINS_FILE = Path(__file__).with_name("margins.toml")
# Limits that need no margin: they are proved, or half of what is proved.
_BASES_WITHOUT_MARGIN = ("proved", "bounded")


@dataclass(frozen=True)
class Margin(Serializable):
    """Safety margin: the recommended stiffness over the stability limit.

    Attributes:
        factor: recommended stiffness over stability limit, at most 1.
        law: letter of the simulated law; for a user-defined law the shipped law with the least
            factor.
        loop: simulated loop in which the law began to cycle first; empty without simulation.
        surface: surface of that loop.
        delay: delay of that loop, in samples.
        below: number of loops in which the law began to cycle below K₀/q.
        cases: number of simulated loops.
    """

    factor: float
    law: str = ""
    loop: str = ""
    surface: str = ""
    delay: int = 0
    below: int = 0
    cases: int = 0


NO_MARGIN = Margin(1.0)


@cache
def load_margins(along_lightest: bool = False) -> dict[Law, Margin]:
    """Return the simulated margin of each law.

    Args:
        along_lightest: whether K₀ is that of the lightest direction.
    """
    table = tomllib.loads(_MARGINS_FILE.read_text(encoding="utf-8"))
    name = "along_lightest" if along_lightest else "factor"
    fields = ("loop", "surface", "delay", "below", "cases")
    return {
        find_law(law): Margin(entry[name], law, *(entry[field] for field in fields))
        for law, entry in table.items()
    }


def safety_margin(surface: Surface, device: Device, limit: StabilityLimit) -> Margin:
    """Return the safety margin below a stability limit.

    A proved limit needs no margin. Where K₀ is known along the device's lightest direction, the
    margin is smaller.

    Args:
        surface: the surface, of which the law counts.
        device: the device.
        limit: the stability limit.
    """
    if limit.basis in _BASES_WITHOUT_MARGIN or not surface.depends_on_texture:
        return NO_MARGIN
    test = device.wall_test
    margins = load_margins(along_lightest=test is not None and test.lightest is not None)
    return margins.get(surface.law) or min(margins.values(), key=lambda margin: margin.factor)


@dataclass(frozen=True)
class StiffnessRecommendation:
    """Recommended stiffness of a law on a device.

    Attributes:
        stability_limit: stability limit of the stiffness, and its basis.
        margin: safety margin below it.
        stiffness: recommended stiffness [N/m], rounded down to three digits; 0 if no stable
            stiffness is known, or if there is no limit.
        wall_stiffness: K₀ for this law [N/m]: in the lightest direction, at the device's rate;
            ``None`` if it is unknown.
    """

    stability_limit: StabilityLimit
    margin: Margin
    stiffness: float
    wall_stiffness: float | None


def recommend_stiffness(
    surface: Surface, device: Device, q: Bound, one_sided: Bound
) -> StiffnessRecommendation:
    """Return the recommended stiffness of a surface's law on a device.

    Args:
        surface: the surface; its stiffness does not count.
        device: the device.
        q: its characteristic number.
        one_sided: its one-sided number.
    """
    loop = make_device_loop(surface, device, q, one_sided, None)
    limit = stability_limit(loop, evaluate_criteria(loop))
    margin = safety_margin(surface, device, limit)
    known = limit.stiffness or 0.0
    start = round_down(margin.factor * known) if math.isfinite(known) else 0.0
    wall = None if loop.wall_stiffness is None else float(loop.wall_stiffness)
    return StiffnessRecommendation(limit, margin, start, wall)


def at_recommended_stiffness(
    surface: Surface, device: Device, recommendation: StiffnessRecommendation
) -> Surface:
    """Return the surface at the recommended stiffness.

    Without one it is at the smooth wall's K₀, or at 1000 N/m where that is unknown too.
    """
    if recommendation.stiffness:
        return surface.to_stiffness(recommendation.stiffness)
    test = device.wall_test
    return surface.to_stiffness(DEFAULT_STIFFNESS if test is None else test.value)
