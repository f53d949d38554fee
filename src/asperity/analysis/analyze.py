"""One law on one surface and one device: every number with its pedigree."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from asperity.analysis.analysis_result import Analysis
from asperity.analysis.bounds.branch_and_bound import DEFAULT_WORK_LIMIT
from asperity.analysis.compare import DEFAULT_DEVICE, law_to_ask_about
from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.energy.merit import merit
from asperity.analysis.gain.characteristic import (
    characteristic_number,
    curl_number,
    one_sided_number,
)
from asperity.analysis.judge_passivity import passivity
from asperity.analysis.passivity.margin import at_start, start
from asperity.analysis.words.analysis import answer, assumptions, surface_width
from asperity.devices import Device, load_device
from asperity.errors import ParameterError
from asperity.surface import Surface, default_max_depth
from asperity.textures.naming import TextureLike, as_texture
from asperity.units import engineering

STEPS = ("q", "q⁺", "curl", "worst loop", "continuity", "strength and support", "passivity")

Progress = Callable[[str], None]


def analyze(
    surface: Surface | TextureLike,
    device: str | os.PathLike[str] | Device = DEFAULT_DEVICE,
    *,
    direction: tuple[float, float] | None = None,
    tolerance: float | None = None,
    work_limit: int = DEFAULT_WORK_LIMIT,
    extent: tuple[float, float] | None = None,
    progress: Progress | None = None,
    **surface_arguments: Any,
) -> Analysis:
    """Return everything that is known of one law on one surface and one device.

    q = sup ‖J‖₂/k, q⁺ = sup λ_max(-sym J)/k and sup |curl f|/k between proved bounds, each with
    the point that attains it; the worst simple loop and v* = W/(σ₀ · length); where the force
    jumps; every criterion of passivity, and which one decides.

    Args:
        surface: the surface with its law, stiffness k [N/m] and max_depth [m]; or a texture, or
            what names one ("sandpaper:grit=P60"): then the law is the one that a comparison
            recommends and the stiffness its start on this device, unless given.
        device: id of the catalogue, TOML file, or a :class:`~asperity.devices.Device`.
        direction: (x, y) of the vertical plane of the worst loop; by default that of the
            texture's scan line, which is x unless the heights vary along another line.
        tolerance: relative gap at which the search for a number stops; see
            :func:`~asperity.analysis.characteristic_number`.
        work_limit: greatest number of cells that the search for a number looks at; if it is
            reached, the bounds found by then are returned and their note says so.
        extent: width and depth [m] of the part of the plane that counts, for sums of waves.
        progress: called with the name of each of ``STEPS`` before it begins.
        **surface_arguments: of :class:`~asperity.surface.Surface` (law, stiffness, max_depth, ...),
            for a texture.

    Returns:
        An :class:`Analysis`. What the device's data cannot decide is listed with what is missing.

    Raises:
        ParameterError: for a value that cannot be used, it names the argument; and for a finite
            measured surface that would be pressed deeper than it is wide.

    Reference:
        Campion and Hayward, (1), (5), III.B and III.C; MATH sections 3 and 4.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> paper = Surface(Sinusoid(amplitude=0.8e-3, period=1e-3), "A")
        >>> result = analyze(paper, "pantograph")
        >>> round(result.q.value, 4), result.passivity.decided_by, result.continuity.continuous
        (5.1251, 'leak', True)
        >>> round(result.leak.energy * 1e3, 3), round(result.v_star, 3)
        (1.6, 0.255)
    """
    known = load_device(device)
    surface = _surface(surface, known, surface_arguments)
    _refuse_beyond(surface)
    begin: Progress = progress or (lambda _step: None)
    begin(STEPS[0])
    q = characteristic_number(surface, tolerance, work_limit, extent)
    begin(STEPS[1])
    one_sided = one_sided_number(surface, tolerance, work_limit, extent)
    begin(STEPS[2])
    curl = None
    if not surface.law.stateful:
        curl = curl_number(surface, tolerance, work_limit, extent)
    begin(STEPS[3])
    leak = worst_loop(surface, direction)
    begin(STEPS[4])
    smooth = continuity(surface, q)
    _ = smooth.jumps  # located now, so that no picture has to wait for them
    begin(STEPS[5])
    scan = merit(surface)
    begin(STEPS[6])
    facts, judged = surface.facts, passivity(surface, known, q, one_sided, leak)
    result = Analysis(
        surface=surface,
        device=known,
        q=q,
        one_sided=one_sided,
        curl=curl,
        conservative=facts.conservative,
        conservative_reason=facts.reason,
        leak=leak,
        continuity=smooth,
        passivity=judged,
        merit=scan,
        answer="",
        assumptions=(),
    )
    return replace(result, answer=answer(result), assumptions=assumptions(result, extent))


def _surface(asked: Surface | TextureLike, device: Device, arguments: dict[str, Any]) -> Surface:
    """Return the surface: of a texture with the recommended law, at the stiffness to begin with."""
    given = {name: value for name, value in arguments.items() if value is not None}
    if isinstance(asked, Surface):
        for name in given:
            words = "belongs to the surface: give a texture, or change it by to_law, to_stiffness"
            raise ParameterError(name, words)
        return asked
    texture = as_texture(asked, name="surface")
    if "law" not in given:
        given["law"] = law_to_ask_about(texture, device, **given)
    surface = Surface(texture, **given)
    if "stiffness" in given:
        return surface
    numbers = characteristic_number(surface), one_sided_number(surface)
    return at_start(surface, device, start(surface, device, *numbers))


def _refuse_beyond(surface: Surface) -> None:
    """Refuse a depth at which a finite surface is felt through its mirror images only.

    The default depth of a texture is always answered; the assumptions say when it is too deep.
    """
    width = surface_width(surface.texture)
    if surface.max_depth > width and surface.max_depth != default_max_depth(surface.texture):
        limit = f"must not exceed the width of the surface, {engineering(width, 'm')}"
        reason = "further down only its mirror images are felt"
        raise ParameterError("max_depth", f"{limit}: {reason} [m]", surface.max_depth)
