"""Analysis of one law on one surface and one device."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

import numpy as np

from asperity.analysis.bounds.bound import NORM, ONE_SIDED, Bound, scale_upper_bound
from asperity.analysis.bounds.branch_and_bound import DEFAULT_WORK_LIMIT
from asperity.analysis.energy.closed_loops import EnergyBalance, Leak, energy_balance
from asperity.analysis.energy.continuity import Continuity, continuity
from asperity.analysis.energy.leak import find_leak
from asperity.analysis.energy.straight_scan import FrictionScan, Merit, friction_scan, merit
from asperity.analysis.gain.characteristic import cached_number, curl_number, make_options
from asperity.analysis.passivity.recommended_stiffness import recommend_stiffness, render_on_device
from asperity.analysis.passivity.verdict import Passivity, passivity
from asperity.analysis.results.compare import DEFAULT_DEVICE, recommended_law
from asperity.core.arguments import FIELD
from asperity.core.checks import check_keywords
from asperity.core.display import Plottable, Reportable, Text
from asperity.core.errors import ParameterError
from asperity.core.files import attributes_to_dict, to_plain_data
from asperity.core.units import format_quantity
from asperity.devices import Device, DeviceLike, load_device
from asperity.rendering import Rendering, assess_rendering
from asperity.surface import SURFACE_KEYWORDS, Surface, default_max_depth
from asperity.textures.catalogue import TextureLike, as_texture
from asperity.textures.texture import Texture

STEPS = ("q", "q⁺", "curl", "worst loop", "continuity", "strength and support", "passivity")

Progress = Callable[[str], None]
SCHEMA = 4


@dataclass(frozen=True)
class Analysis(Plottable, Reportable):
    """Results of one law on one surface and one device.

    Attributes:
        surface: the surface, with its law, stiffness and depth.
        device: the device.
        q: characteristic number [1].
        one_sided: one-sided number q⁺ [1].
        curl: sup |curl f|/k [1]; ``None`` for a law with state, whose force is no field.
        conservative: whether the work around every closed path is zero.
        conservative_reason: the reason, in one sentence.
        leak: the worst simple loop, in a vertical plane.
        continuity: whether the force jumps inside the working region, and where.
        passivity: every criterion on the device, and the deciding one.
        merit: strength and support on a straight scan.
        extent: width and depth [m] of the searched part of the plane, if they were given.
    """

    surface: Surface
    device: Device
    q: Bound
    one_sided: Bound
    curl: Bound | None
    conservative: bool
    conservative_reason: str
    leak: Leak
    continuity: Continuity
    passivity: Passivity
    merit: Merit
    extent: tuple[float, float] | None = None
    answer = Text[str]("The verdict in one sentence.")
    assumptions = Text[tuple[str, ...]](
        "Used defaults, unverified device data and preparation of the surface, in sentences."
    )

    @property
    def energy_balance(self) -> EnergyBalance:
        """Whether closed paths take no energy, take it from the hand, or give it to the hand."""
        return energy_balance(self.surface)

    @cached_property
    def friction_force(self) -> FrictionScan | None:
        """Friction on a straight scan; ``None`` without friction."""
        return friction_scan(self.surface)

    @property
    def curl_density(self) -> Bound | None:
        """Sup |curl f| [N/m]: the greatest work of a small loop per area [J/m²]."""
        if self.curl is None:
            return None
        k = self.surface.stiffness
        upper = scale_upper_bound(self.curl.upper, k)
        return replace(self.curl, lower=k * self.curl.lower, upper=upper)

    @property
    def v_star(self) -> float | None:
        """v* = f_c*/σ₀ [m/s], the speed below which damping does not absorb every loop.

        0 for a conservative law; ``None`` where the device's damping is not known.
        """
        return self.passivity.critical_speed

    @cached_property
    def rendering(self) -> Rendering:
        """How a loop renders the law, at 0.1 m/s."""
        rate = self.device.value("update_rate")
        return assess_rendering(self.surface, update_rate=rate)

    @property
    def bounds(self) -> tuple[Bound, ...]:
        """q, q⁺ and, for a law without state, sup |curl f|/k."""
        return tuple([bound for bound in (self.q, self.one_sided, self.curl) if bound is not None])

    def __repr__(self) -> str:
        law = self.surface.law.letter
        verdict = self.passivity.verdict
        return f"<Analysis of law {law} on {self.device.id}: q = {self.q.value:.4g}, {verdict}>"

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number; infinity is the string "inf"."""
        surface = self.surface
        fields = (
            "device q one_sided curl curl_density conservative conservative_reason "
            "energy_balance leak v_star "
            "continuity passivity merit rendering assumptions"
        )
        return {
            "schema": SCHEMA,
            "answer": self.answer,
            "texture": to_plain_data(surface.texture.describe()),
            "law": surface.law.letter,
            "law_name": surface.law.name,
            **attributes_to_dict(surface, "law_parameters", "clamp", "stiffness", "max_depth"),
            "friction": to_plain_data(surface.contact_friction),
            "friction_force": to_plain_data(self.friction_force),
            **attributes_to_dict(self, *fields.split()),
        }


def analyze(
    surface: Surface | TextureLike,
    device: DeviceLike = DEFAULT_DEVICE,
    *,
    direction: tuple[float, float] | None = None,
    tolerance: float | None = None,
    work_limit: int = DEFAULT_WORK_LIMIT,
    extent: tuple[float, float] | None = None,
    progress: Progress | None = None,
    rendering: str = FIELD,
    **surface_arguments: Any,
) -> Analysis:
    """Analyze one law on one surface and one device.

    q = sup ‖J‖₂/k, q⁺ = sup λ_max(-sym J)/k and sup |curl f|/k between proved bounds, each with
    the point that attains it; the worst simple loop, and v* = f_c*/σ₀ with the
    greatest energy per length f_c*; the jumps of the
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
        rendering: how law H of a texture is rendered: ``"field"`` or ``"search"``; see
            :func:`~asperity.rendering.rendered_surface`. A surface is analyzed as it is.
        **surface_arguments: of :class:`~asperity.surface.Surface` (law, stiffness, max_depth, ...),
            for a texture.

    Returns:
        An :class:`Analysis`. Undecidable criteria are listed with the missing device data.

    Raises:
        ParameterError: for a value that cannot be used; it names the argument. Also for a finite
            measured surface pressed deeper than it is wide.

    Reference:
        Campion and Hayward, (1), (5), III.B and III.C; docs/theory/jacobians.md and numbers.md.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> paper = Surface(Sinusoid(amplitude=0.8e-3, period=1e-3), "A")
        >>> result = analyze(paper, "pantograph")
        >>> round(result.q.value, 4), result.passivity.decided_by, result.continuity.continuous
        (5.1251, 'leak', True)
        >>> round(result.leak.energy * 1e3, 3), round(result.v_star, 3)
        (1.6, 0.346)
    """
    device = load_device(device)
    surface = _resolve_surface(surface, device, rendering, extent, surface_arguments)
    _check_depth(surface)
    search = make_options(surface, tolerance, work_limit, extent)
    report_step: Progress = progress or (lambda _step: None)
    report_step(STEPS[0])
    q = cached_number(surface, NORM, search)
    report_step(STEPS[1])
    one_sided = cached_number(surface, ONE_SIDED, search)
    report_step(STEPS[2])
    curl = None if surface.law.stateful else curl_number(surface, tolerance, work_limit, extent)
    report_step(STEPS[3])
    leak = find_leak(surface, direction)
    report_step(STEPS[4])
    force = continuity(surface, q)
    _ = force.jumps  # located now, so that no picture has to wait for them
    report_step(STEPS[5])
    scan = merit(surface)
    report_step(STEPS[6])
    return Analysis(
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
        extent=extent,
    )


def _resolve_surface(
    surface: Surface | TextureLike,
    device: Device,
    rendering: str,
    extent: tuple[float, float] | None,
    arguments: dict[str, Any],
) -> Surface:
    """Return the surface, of a texture as rendered, by default as recommended."""
    keywords = {name: value for name, value in arguments.items() if value is not None}
    if isinstance(surface, Surface):
        for name in keywords:
            raise ParameterError(
                name, "belongs to the surface: give a texture, or change it by to_law, to_stiffness"
            )
        return surface
    check_keywords(keywords, SURFACE_KEYWORDS, analyze)
    texture = as_texture(surface, name="surface")
    if "law" not in keywords:
        keywords["law"] = recommended_law(texture, device, rendering=rendering, **keywords)
    surface = render_on_device(Surface(texture, **keywords), device, rendering, extent)
    if "stiffness" in keywords:
        return surface
    numbers = cached_number(surface, NORM), cached_number(surface, ONE_SIDED)
    return surface.to_stiffness(recommend_stiffness(surface, device, *numbers).start)


def _check_depth(surface: Surface) -> None:
    """Refuse a depth at which only mirror images of a finite surface are in contact.

    The default depth of a texture is always accepted; the assumptions state when it is too deep.
    """
    width = surface_width(surface.texture)
    if surface.max_depth > width and surface.max_depth != default_max_depth(surface.texture):
        limit = f"must not exceed the width of the surface, {format_quantity(width, 'm')}"
        reason = "further down only its mirror images are in contact"
        raise ParameterError("max_depth", f"{limit}: {reason} [m]", surface.max_depth)


PASSIVITY_FIELDS = (
    *("max_stiffness", "update_rate", "damping", "delay_samples", "virtual_damping"),
    *("position_resolution", "force_resolution", "least_friction"),
)
"""Device data used by the criteria of passivity."""


def surface_width(texture: Texture) -> float:
    """Return the shorter side of a finite surface [m]; infinity for an unbounded one."""
    if not texture.is_mirrored:
        return math.inf
    return float(np.hypot(*texture.domain.spans.T).min())
