"""The row of each law in a comparison, at its recommended stiffness and down to its depth."""

from __future__ import annotations

from dataclasses import dataclass, replace

from asperity.analysis.bounds.bound import NORM, ONE_SIDED
from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.leak import find_leak
from asperity.analysis.energy.press import (
    depth_at_press,
    holds_at_any_press,
    mean_press,
    region_of_press,
)
from asperity.analysis.energy.straight_scan import merit as compute_merit
from asperity.analysis.gain.characteristic import cached_number
from asperity.analysis.limits.perceptibility import assess_perceptibility
from asperity.analysis.passivity.device_loop import DeviceLoop, make_device_loop
from asperity.analysis.passivity.recommended_stiffness import recommend_on_loop, render_on_device
from asperity.analysis.passivity.verdict import assess_loop
from asperity.analysis.results.recommendation import LawRow
from asperity.core.arguments import FIELD
from asperity.core.processes import Part, report_part
from asperity.core.units import round_down
from asperity.devices import Device
from asperity.perception.grip import Grip
from asperity.rendering import assess_rendering, is_searched
from asperity.surface import Surface
from asperity.textures.texture import TexturePart


@dataclass(frozen=True)
class ComparisonQuery:
    """The conditions under which every law is analysed."""

    device: Device
    stiffness: float | None
    speed: float
    part: TexturePart
    explicit_depth: bool
    rendering: str
    grip: Grip
    risk: float
    press: float | None


Task = tuple[Surface, ComparisonQuery]


def precompute_row(task: Task) -> None:
    """Compute a row in a worker process, which leaves its numbers in the cache."""
    render_row(*task)


def render_row(surface: Surface, query: ComparisonQuery) -> LawRow:
    """Return the row of a law as a loop renders it."""
    greatest_press = None
    if query.press is not None:
        surface, greatest_press = _pressed_surface(surface, query, query.press)
    row = _compute_row(render_on_device(surface, query.device, query.rendering), query)
    if greatest_press is None:
        return row
    none = replace(row.passivity.stability_limit, stiffness=0.0, basis="none")
    return replace(
        row,
        passivity=replace(row.passivity, stability_limit=none),
        recommended_stiffness=0.0,
        perceptibility=None,
        greatest_press=greatest_press,
    )


_PRESS_TOLERANCE = 1e-3
_FIELD_GAIN = 1.15  # of a baked law over the law itself, at most: one field is enough
_RENDERINGS = 4


def _pressed_surface(
    surface: Surface, query: ComparisonQuery, press: float
) -> tuple[Surface, float | None]:
    """Return a surface for the depth of a press [N]; and the greatest press where none is enough.

    A field that is baked for a depth may have a greater gain, and a smaller start, than the law.
    """
    if query.stiffness is not None:
        stiff = surface.to_stiffness(query.stiffness)
        return surface.to_depth(depth_at_press(stiff, press)), None

    def start(trial: Surface) -> float:
        return recommend_on_loop(_device_loop(trial, query), query.risk).exact_stiffness

    depth, greatest = region_of_press(surface, press, start)
    if depth is None:
        return surface, greatest
    surface = surface.to_depth(depth)
    if is_searched(surface) and query.rendering == FIELD:
        soft = surface.to_stiffness(start(surface) / _FIELD_GAIN)
        surface = surface.to_depth(depth_at_press(soft, press))
    for _ in range(_RENDERINGS):
        stiffness = round_down(start(render_on_device(surface, query.device, query.rendering)))
        stiff = surface.to_stiffness(stiffness)
        if mean_press(stiff) >= press * (1.0 - _PRESS_TOLERANCE):
            break
        surface = surface.to_depth(depth_at_press(stiff, press))
    return surface, None


def _device_loop(surface: Surface, query: ComparisonQuery) -> DeviceLoop:
    q = cached_number(surface, NORM)
    return make_device_loop(surface, query.device, q, cached_number(surface, ONE_SIDED))


def _compute_row(surface: Surface, query: ComparisonQuery) -> LawRow:
    device = query.device
    report_part(Part.GAIN)
    loop = _device_loop(surface, query)
    q = loop.q
    recommended = recommend_on_loop(loop, query.risk)
    if query.stiffness is None:
        surface = surface.to_stiffness(recommended.start)
    report_part(Part.LEAK)
    leak = find_leak(surface)
    merit = compute_merit(surface)
    perceptibility = None
    if query.stiffness or recommended.stiffness:
        perceptibility = assess_perceptibility(
            surface,
            device,
            query.part,
            rms=merit.ripple * surface.stiffness,
            speed=query.speed,
            explicit_depth=query.explicit_depth,
            grip=query.grip,
        )
    return LawRow(
        surface=surface,
        q=q,
        one_sided=loop.one_sided,
        passivity=assess_loop(loop.with_leak(surface, leak)),
        margin=recommended.margin,
        recommended_stiffness=recommended.stiffness,
        press=mean_press(surface),
        holds_at_any_press=holds_at_any_press(surface),
        perceptibility=perceptibility,
        conservative=surface.facts.conservative,
        conservative_reason=surface.facts.reason,
        leak=leak,
        continuity=continuity(surface, q),
        strength=merit.strength,
        support=merit.support,
        contact_lost=merit.contact_lost,
        ripple=merit.ripple,
        rendering=assess_rendering(surface, query.speed, device.value("update_rate")),
    )
