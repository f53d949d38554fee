"""Analysis of one law on one surface and one device."""

from __future__ import annotations

import os
from collections.abc import Callable
from dataclasses import replace
from typing import Any

from asperity.analysis.assess_passivity import passivity
from asperity.analysis.bounds.branch_and_bound import DEFAULT_WORK_LIMIT
from asperity.analysis.bounds.measures import NORM, ONE_SIDED
from asperity.analysis.compare import DEFAULT_DEVICE, recommended_law
from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.energy.merit import merit
from asperity.analysis.gain.characteristic import cached_number, curl_number
from asperity.analysis.passivity.verdict import at_recommended_stiffness, recommend_stiffness
from asperity.analysis.results import Analysis
from asperity.analysis.sentences.analysis_sentences import (
    analysis_assumptions,
    analysis_summary,
    surface_width,
)
from asperity.core.errors import ParameterError
from asperity.core.units import format_quantity
from asperity.devices import Device, load_device
from asperity.surface import Surface, default_max_depth
from asperity.textures.catalogue import TextureLike, as_texture

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
    """Analyze one law on one surface and one device.

    q = sup ‖J‖₂/k, q⁺ = sup λ_max(-sym J)/k and sup |curl f|/k between proved bounds, each with
    the point that attains it; the worst simple loop and v* = W/(σ₀ · length); the jumps of the
    force; every criterion of passivity, and the deciding one.

    Args:
        surface: the surface with its law, stiffness k [N/m] and max_depth [m]; or a texture, or
            what names one ("sandpaper:grit=P60"). Law and stiffness of a texture are by default
            those recommended on this device.
        device: id of the catalogue, TOML file, or a :class:`~asperity.devices.Device`.
        direction: (x, y) of the vertical plane of the worst loop; by default that of the
            texture's scan line, which is x unless the heights vary along another line.
        tolerance: relative gap at which the search for a number stops; see
            :func:`~asperity.analysis.characteristic_number`.
        work_limit: greatest number of cells that the search for a number evaluates; when it is
            reached, the bounds found so far are returned with a note.
        extent: width and depth [m] of the part of the plane to search, for sums of waves.
        progress: called with the name of each of ``STEPS`` before it is computed.
        **surface_arguments: of :class:`~asperity.surface.Surface` (law, stiffness, max_depth, ...),
            for a texture.

    Returns:
        An :class:`Analysis`. Undecidable criteria are listed with the missing device data.

    Raises:
        ParameterError: for a value that cannot be used; it names the argument. Also for a finite
            measured surface pressed deeper than it is wide.

    Reference:
        Campion and Hayward, (1), (5), III.B and III.C; MATH sections 3 and 4.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> paper = Surface(Sinusoid(amplitude=0.8e-3, period=1e-3), "A")
        >>> result = analyze(paper, "pantograph")
        >>> round(result.q.value, 4), result.passivity.decided_by, result.continuity.continuous
        (5.1251, 'leak', True)
        >>> round(result.leak.energy * 1e3, 3), round(result.v_star, 3)
        (1.6, 0.255)
    """
    device = load_device(device)
    surface = _resolve_surface(surface, device, surface_arguments)
    _check_depth(surface)
    report_step: Progress = progress or (lambda _step: None)
    report_step(STEPS[0])
    q = cached_number(surface, NORM, tolerance, work_limit, extent)
    report_step(STEPS[1])
    one_sided = cached_number(surface, ONE_SIDED, tolerance, work_limit, extent)
    report_step(STEPS[2])
    curl = None
    if not surface.law.stateful:
        curl = curl_number(surface, tolerance, work_limit, extent)
    report_step(STEPS[3])
    leak = worst_loop(surface, direction)
    report_step(STEPS[4])
    force = continuity(surface, q)
    _ = force.jumps  # located now, so that no picture has to wait for them
    report_step(STEPS[5])
    scan = merit(surface)
    report_step(STEPS[6])
    result = Analysis(
        surface=surface,
        device=device,
        q=q,
        one_sided=one_sided,
        curl=curl,
        conservative=surface.facts.conservative,
        conservative_reason=surface.facts.reason,
        leak=leak,
        continuity=force,
        passivity=passivity(surface, device, q, one_sided, leak),
        merit=scan,
    )
    answer, assumptions = analysis_summary(result), analysis_assumptions(result, extent)
    return replace(result, answer=answer, assumptions=assumptions)


def _resolve_surface(
    surface: Surface | TextureLike, device: Device, arguments: dict[str, Any]
) -> Surface:
    """Return the surface, of a texture with the recommended law and stiffness by default."""
    given = {name: value for name, value in arguments.items() if value is not None}
    if isinstance(surface, Surface):
        for name in given:
            words = "belongs to the surface: give a texture, or change it by to_law, to_stiffness"
            raise ParameterError(name, words)
        return surface
    texture = as_texture(surface, name="surface")
    if "law" not in given:
        given["law"] = recommended_law(texture, device, **given)
    surface = Surface(texture, **given)
    if "stiffness" in given:
        return surface
    numbers = cached_number(surface, NORM), cached_number(surface, ONE_SIDED)
    recommended = recommend_stiffness(surface, device, *numbers)
    return at_recommended_stiffness(surface, device, recommended)


def _check_depth(surface: Surface) -> None:
    """Refuse a depth at which only mirror images of a finite surface are in contact.

    The default depth of a texture is always accepted; the assumptions state when it is too deep.
    """
    width = surface_width(surface.texture)
    if surface.max_depth > width and surface.max_depth != default_max_depth(surface.texture):
        limit = f"must not exceed the width of the surface, {format_quantity(width, 'm')}"
        reason = "further down only its mirror images are in contact"
        raise ParameterError("max_depth", f"{limit}: {reason} [m]", surface.max_depth)
