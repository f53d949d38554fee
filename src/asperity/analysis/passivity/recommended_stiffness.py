"""The stability limit, the safety margin below it, and the recommended stiffness."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from functools import cache
from pathlib import Path
from typing import Any, Literal, NamedTuple

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.passivity import criteria, device_loop
from asperity.core.arguments import DEFAULT_STIFFNESS
from asperity.core.files import Serializable
from asperity.core.processes import report_fraction
from asperity.core.units import round_down
from asperity.devices import Device
from asperity.laws import LAWS, Law
from asperity.rendering import DEFAULT_PRESS, Extent, default_reach, is_searched, rendered_surface
from asperity.surface import Surface
from asperity.textures import Sinusoid
from asperity.textures.fields.bake import BakeGoal
from asperity.textures.fields.field_certificate import Progress

Basis = Literal["proved", "plausible", "bounded", "wall gain", "none"]


@dataclass(frozen=True)
class StabilityLimit(Serializable):
    """Stability limit of the stiffness of a law on a device, and its basis.

    Attributes:
        stiffness: the limit [N/m]; 0 if no stable stiffness is known, ``None`` if undecidable.
        basis: ``"proved"``: passive up to the limit, under the assumptions of the criterion.
            ``"plausible"``: a smooth wall of that gain did not cycle. ``"bounded"``:
            passive but for quantisation, whose buzz moves at ``buzz_goal`` at most, or at twice
            what steps of force cause at any stiffness.
            ``"wall gain"``: a wall of that gain did not cycle; no stability limit, since the law
            has curl and delivers energy below v* at any stiffness. ``"none"``.
        criterion: name of the criterion that gives the limit; empty for none.
        delay: delay of the binding pair of damping and delay, in samples; infinity where any delay
            is admissible, ``None`` where the limit has no such pair.
        sampled: whether the limit uses a number that was only sampled, so that it may be too high.
        proved_stiffness: stiffness up to which passivity is proved [N/m]; 0 for none.
        update_rate: least update rate at which the limit holds [Hz]; ``None`` without a limit.
    """

    stiffness: float | None
    basis: Basis
    criterion: str = ""
    delay: float | None = None
    sampled: bool = False
    proved_stiffness: float = 0.0
    update_rate: float | None = field(default=None, compare=False)


def stability_limit(
    loop: device_loop.DeviceLoop, by_name: Mapping[str, criteria.Criterion]
) -> StabilityLimit:
    """Return the stability limit of the stiffness, and its basis.

    Comparison, analysis and the six limits of the device share this limit.
    """
    limit = _find_limit(loop, by_name)
    if limit.basis == "none":
        return limit
    rate = loop.least_rate
    if limit.basis in _BASES_WITHOUT_MARGIN and loop.rate is not None:
        rate = loop.rate  # the device's damping is the basis, per period
    return replace(limit, update_rate=float(rate))


def _find_limit(
    loop: device_loop.DeviceLoop, by_name: Mapping[str, criteria.Criterion]
) -> StabilityLimit:
    """Return the stability limit without its update rate."""
    main = by_name[criteria.main_rule(loop)]
    steps = by_name[criteria.QUANTIZATION]
    if not loop.conservative:
        return _limit_from_criterion("wall gain", by_name[criteria.WALL])
    plausible = _limit_from_criterion("plausible", by_name[criteria.WALL_TEST], loop.longest_delay)
    if loop.obstacle is not None or loop.delay is None or device_loop.is_contradictory(loop):
        return plausible
    proved = _proved_limit(main, steps)
    silent = proved.stiffness or 0.0
    if (
        main.limit
        and not steps.missing
        and (calm := device_loop.buzz_limited_stiffness(loop)) is not None
    ):
        bounded = min(calm, main.limit)
        if bounded > silent:
            return StabilityLimit(
                bounded, "bounded", criteria.QUANTIZATION, proved_stiffness=silent
            )
    if (plausible.stiffness or 0.0) > (proved.stiffness or 0.0):
        return replace(plausible, proved_stiffness=proved.proved_stiffness)
    if proved.stiffness is None:
        return plausible
    return proved


def _proved_limit(main: criteria.Criterion, steps: criteria.Criterion) -> StabilityLimit:
    """Return the stiffness up to which the rule and the quantisation criterion are proved."""
    if main.limit is None or steps.limit is None:
        sampled = _limit_from_criterion("proved", main)
        return sampled if sampled.sampled else StabilityLimit(None, "none")
    stiffness = min(main.limit, steps.limit)
    if not stiffness:
        return StabilityLimit(stiffness, "none")
    return StabilityLimit(stiffness, "proved", main.name, proved_stiffness=stiffness)


def _limit_from_criterion(
    basis: Basis, criterion: criteria.Criterion, delay: device_loop.Number | None = None
) -> StabilityLimit:
    sampled = criterion.limit is None and criterion.upper_limit is not None
    stiffness = criterion.upper_limit if sampled else criterion.limit
    if not stiffness:
        return StabilityLimit(stiffness, "none")
    pair = None if delay is None else float(delay)
    return StabilityLimit(stiffness, basis, criterion.name, pair, sampled)


_MARGINS_FILE = Path(__file__).with_name("margins.toml")


# Limits that need no margin: they are proved, or bound the buzz.
_BASES_WITHOUT_MARGIN = ("proved", "bounded")


class CurvePoint(NamedTuple):
    """The random loops at a factor of K₀/q: how many cycle, and the fastest motion."""

    factor: float
    cycles: int
    speed: float
    extent: float


RISKS = {"1%": 0.01, "5%": 0.05}
"""Shares of random loops that may cycle at the recommended stiffness."""
LEAST_RISK = RISKS["1%"]


@dataclass(frozen=True)
class Margin(Serializable):
    """Safety margin: the recommended stiffness over K₀/q, from random admissible loops.

    Attributes:
        factor: recommended stiffness over stability limit, at most 1.
        law: letter of the simulated law; for a user-defined law the shipped law with the least
            factor.
        loops: number of random loops simulated at that factor of K₀/q; 0 without simulation.
        cycles: in how many of them a motion lasts, without steps, that a hand feels.
        speed: RMS speed of the fastest of these motions, summed over the axes [m/s].
        extent: its RMS displacement [m].
        curve: numbers of random loops that cycle, from the factor for 1 % up to the limit.
        curve_loops: number of random loops simulated at each point of the curve.
        ceiling: factor at which the paper's pantograph, held loosely, cycles; 1 if it does not.
    """

    factor: float
    law: str = ""
    loops: int = 0
    cycles: int = 0
    speed: float = 0.0
    extent: float = 0.0
    curve: tuple[CurvePoint, ...] = ()
    curve_loops: int = 0
    ceiling: float = 1.0

    @property
    def limit_share(self) -> float:
        """Share of the random loops that cycle at the stability limit itself, K₀/q."""
        return self.curve[-1].cycles / self.curve_loops

    def at_risk(self, risk: float) -> Margin:
        """Return the margin at which at most a share of the random loops cycles, 1 % or more."""
        margin = self
        for point in self.curve[1:]:
            if risk <= LEAST_RISK or point.cycles > risk * self.curve_loops:
                break
            margin = replace(self, loops=self.curve_loops, **point._asdict())
        return margin

    @property
    def frequency(self) -> float:
        """Frequency of a sinusoid of that speed and displacement [Hz]."""
        if not self.extent:
            return 0.0
        return self.speed / (2.0 * math.pi * self.extent)


NO_MARGIN = Margin(1.0)


@cache
def load_margins(along_lightest: bool = False) -> dict[Law, Margin]:
    """Return the simulated margin of each law.

    Args:
        along_lightest: whether K₀ is that of the lightest direction, or of the weakest axis.
    """
    table = tomllib.loads(_MARGINS_FILE.read_text(encoding="utf-8"))
    entries = table["lightest" if along_lightest else "normal"]
    return {LAWS[law]: _parse_margin(law, **entry) for law, entry in entries.items()}


def _parse_margin(law: str, curve: list[list[Any]], **entry: Any) -> Margin:
    return Margin(law=law, curve=tuple([CurvePoint(*point) for point in curve]), **entry)


def safety_margin(
    surface: Surface, device: Device, limit: StabilityLimit, risk: float = LEAST_RISK
) -> Margin:
    """Return the safety margin below a stability limit.

    A proved limit needs no margin. Where K₀ is known along the device's lightest direction, the
    margin is smaller.

    Args:
        surface: the surface, of which the law counts.
        device: the device.
        limit: the stability limit.
        risk: greatest share of the random loops that cycle.
    """
    if limit.basis in _BASES_WITHOUT_MARGIN or not surface.depends_on_texture:
        return NO_MARGIN
    test = device.wall_test
    margins = load_margins(along_lightest=test is not None and test.lightest is not None)
    margin = margins.get(surface.law) or min(margins.values(), key=lambda margin: margin.factor)
    return margin.at_risk(risk)


@dataclass(frozen=True)
class StiffnessRecommendation:
    """Recommended stiffness of a law on a device.

    Attributes:
        stability_limit: stability limit of the stiffness, and its basis.
        margin: safety margin below it.
        stiffness: recommended stiffness [N/m], rounded down to three digits; 0 if no stable
            stiffness is known, or if there is no limit.
        start: the same; without one the smooth wall's K₀, or 1000 N/m where that is unknown too.
        wall_stiffness: K₀ for this law [N/m]: in the lightest direction, at the rate and delay of
            the loop; ``None`` if it is unknown.
    """

    stability_limit: StabilityLimit
    margin: Margin
    stiffness: float
    start: float
    wall_stiffness: float | None

    @property
    def exact_stiffness(self) -> float:
        """Margin times stability limit [N/m], not rounded; 0 if there is none."""
        limit = self.stability_limit.stiffness
        if limit is None or math.isinf(limit):
            return 0.0
        return self.margin.factor * limit


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
    return recommend_on_loop(device_loop.make_device_loop(surface, device, q, one_sided))


def recommend_on_loop(
    loop: device_loop.DeviceLoop, risk: float = LEAST_RISK
) -> StiffnessRecommendation:
    """Return the recommended stiffness of a surface's law on a device; its own does not count.

    Args:
        loop: the surface on the device.
        risk: greatest share of random loops that cycle at that stiffness.
    """
    limit = stability_limit(loop, criteria.evaluate_criteria(loop))
    margin = safety_margin(loop.surface, loop.device, limit, risk)
    stiffness = 0.0
    if limit.stiffness is not None and math.isfinite(limit.stiffness):
        stiffness = round_down(margin.factor * limit.stiffness)
    start = stiffness
    if not stiffness:
        start = DEFAULT_STIFFNESS if loop.wall_test is None else loop.wall_test.value
    allowed = loop.delayed_wall_stiffness
    wall = None if allowed is None else float(allowed)
    return StiffnessRecommendation(limit, margin, stiffness, start, wall)


_GENTLE_TEXTURE = Sinusoid(1e-6, 1e-2)


_UNIT_GAIN = Bound(1.0, 1.0, "theorem")


def unit_starts(device: Device) -> dict[str, float]:
    """Return the recommended stiffness [N/m] of each law on a surface with q = q⁺ = 1, by letter.

    On other surfaces it is smaller by the factor q; 0 if no stable stiffness is known.
    """
    return {
        letter: recommend_stiffness(
            Surface(_GENTLE_TEXTURE, letter), device, _UNIT_GAIN, _UNIT_GAIN
        ).stiffness
        for letter in LAWS
    }


def render_on_device(
    surface: Surface,
    device: Device,
    rendering: str,
    extent: Extent | None = None,
    progress: Progress = report_fraction,
) -> Surface:
    """Return the surface as a loop renders it, baked as deep as people press it on a device.

    That is to the device's greatest force, at most 5 N, at the recommended stiffness of a field,
    whose gain is at most 1.15 max(1, c): the stiffness of the surface does not count.

    Args:
        surface: the surface.
        device: the device.
        rendering: see :func:`~asperity.rendering.rendered_surface`.
        extent: see :func:`~asperity.rendering.rendered_surface`.
        progress: see :func:`~asperity.rendering.rendered_surface`.
    """
    if not is_searched(surface):
        return rendered_surface(surface, rendering)
    gain = BakeGoal.max_gain * max(1.0, surface.parameter("continuity"))
    q = Bound(gain, gain, "theorem")
    start = recommend_stiffness(Surface(_GENTLE_TEXTURE, "H"), device, q, q).start
    reach = default_reach(start, device.value("max_force") or DEFAULT_PRESS)
    return rendered_surface(surface, rendering, extent, progress, reach=reach)
