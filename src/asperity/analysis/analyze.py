"""One law on one surface and one device: every number with its pedigree."""

from __future__ import annotations

import html
import math
import os
from collections.abc import Callable
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.bounds.branch_and_bound import DEFAULT_WORK_LIMIT
from asperity.analysis.compare import DEFAULT_DEVICE
from asperity.analysis.energy.continuity import Continuity, continuity
from asperity.analysis.energy.leak import Leak, worst_loop
from asperity.analysis.energy.merit import Merit, merit
from asperity.analysis.gain.characteristic import (
    characteristic_number,
    curl_number,
    one_sided_number,
)
from asperity.analysis.passivity.criteria import LEAK
from asperity.analysis.passivity.judgement import Passivity, passivity
from asperity.derive.facts import law_facts
from asperity.devices import Device, load_device
from asperity.errors import ParameterError
from asperity.files import plain
from asperity.surface import (
    DEFAULT_STIFFNESS,
    Surface,
    default_max_depth,
)
from asperity.textures.texture import Texture
from asperity.units import engineering, rounded_down

SCHEMA = 1
STEPS = ("q", "q⁺", "curl", "worst loop", "continuity", "strength and support", "passivity")
# What the criteria of passivity look at.
_USED = ("max_stiffness", "update_rate", "damping", "delay_samples", "virtual_damping")

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Analysis:
    """What is known of one law on one surface and one device.

    Attributes:
        surface: the surface, with its law, stiffness and depth.
        device: the device.
        q: characteristic number [1].
        one_sided: one-sided number q⁺ [1].
        curl: sup |curl f|/k [1]; ``None`` for a law with state, whose force is no field.
        conservative: whether the work around every closed path is zero.
        conservative_reason: one sentence.
        leak: the worst simple loop, in a vertical plane.
        continuity: whether the force jumps inside the working region, and where.
        passivity: what each criterion says of the device, and which one decides.
        merit: strength and support on a straight scan.
        answer: the verdict in one sentence.
        assumptions: defaults that were used, device data that are not verified, the steps of
            preparing the surface, in sentences.
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
    answer: str
    assumptions: tuple[str, ...]

    @property
    def curl_density(self) -> Bound | None:
        """Sup |curl f| [N/m]: the greatest work of a small loop per area [J/m²]."""
        if self.curl is None:
            return None
        k, upper = self.surface.stiffness, self.curl.upper
        # One unit in the last place covers the rounding of the product.
        top = math.nextafter(k * upper, math.inf) if upper > 0.0 else 0.0
        return replace(self.curl, lower=k * self.curl.lower, upper=top)

    @property
    def v_star(self) -> float | None:
        """v* [m/s], the speed below which damping does not absorb the worst loop.

        0 for a conservative law; ``None`` where the device's damping is not known.
        """
        return self.passivity.critical_speed

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number; infinity is the string "inf"."""
        surface = self.surface
        return plain(
            {
                "schema": SCHEMA,
                "answer": self.answer,
                "texture": surface.texture.describe(),
                "law": surface.law.letter,
                "law_name": surface.law.name,
                "law_parameters": surface.law_parameters,
                "clamp": surface.clamp,
                "stiffness": surface.stiffness,
                "max_depth": surface.max_depth,
                "device": self.device,
                "q": self.q,
                "one_sided": self.one_sided,
                "curl": self.curl,
                "curl_density": self.curl_density,
                "conservative": self.conservative,
                "conservative_reason": self.conservative_reason,
                "leak": self.leak,
                "v_star": self.v_star,
                "continuity": self.continuity,
                "passivity": self.passivity,
                "merit": self.merit,
                "assumptions": self.assumptions,
            }
        )

    def _repr_html_(self) -> str:
        """Return the answer, the numbers and the criteria for a notebook."""
        bounds = (("q", self.q), ("q⁺", self.one_sided), ("sup |curl|/k", self.curl))
        numbers = [
            [name, f"{bound.lower:.6g}", f"{bound.upper:.6g}", bound.method, str(bound.at or "")]
            for name, bound in bounds
            if bound is not None
        ]
        rules = [[c.name, c.formula, c.says] for c in self.passivity.criteria]
        return (
            f"<p>{html.escape(self.answer)}</p>"
            + _table(["number", "lower", "upper", "method", "at [m]"], numbers)
            + _table(["criterion", "condition", "says"], rules)
        )


def _table(head: list[str], rows: list[list[str]]) -> str:
    titles = "".join(f"<th>{html.escape(title)}</th>" for title in head)
    body = "".join(
        f"<tr>{''.join(f'<td>{html.escape(cell)}</td>' for cell in row)}</tr>" for row in rows
    )
    return f"<table><tr>{titles}</tr>{body}</table>"


def analyze(
    surface: Surface,
    device: str | os.PathLike[str] | Device = DEFAULT_DEVICE,
    *,
    direction: tuple[float, float] | None = None,
    tolerance: float | None = None,
    work_limit: int = DEFAULT_WORK_LIMIT,
    extent: tuple[float, float] | None = None,
    progress: Progress | None = None,
) -> Analysis:
    """Return everything that is known of one law on one surface and one device.

    q = sup ‖J‖₂/k, q⁺ = sup λ_max(-sym J)/k and sup |curl f|/k between proved bounds, each with
    the point that attains it; the worst simple loop and v* = W/(σ₀ · length); where the force
    jumps; every criterion of passivity, and which one decides.

    Args:
        surface: the surface with its law, stiffness k [N/m] and max_depth [m].
        device: id of the catalogue, TOML file, or a :class:`~asperity.devices.Device`.
        direction: (x, y) of the vertical plane of the worst loop; by default that of the
            texture's scan line, which is x unless the heights vary along another line.
        tolerance: relative gap at which the search for a number stops; see
            :func:`~asperity.analysis.characteristic_number`.
        work_limit: greatest number of cells that the search for a number looks at; if it is
            reached, the bounds found by then are returned and their note says so.
        extent: width and depth [m] of the part of the plane that counts, for sums of waves.
        progress: called with the name of each of ``STEPS`` before it begins.

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
    if not isinstance(surface, Surface):
        raise ParameterError("surface", "must be a Surface", surface)
    _refuse_beyond(surface)
    known = load_device(device)
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
    facts, judged = law_facts(surface.law), passivity(surface, known, q, one_sided, leak)
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
    return replace(result, answer=_answer(result), assumptions=_assumptions(result, extent))


# --- words ----------------------------------------------------------------------------------------


def _refuse_beyond(surface: Surface) -> None:
    """Refuse a depth at which a finite surface is felt through its mirror images only.

    The default depth of a texture is always answered; ``_assumptions`` says when it is too deep.
    """
    width = _width(surface.texture)
    if surface.max_depth > width and surface.max_depth != default_max_depth(surface.texture):
        limit = f"must not exceed the width of the surface, {engineering(width, 'm')}"
        reason = "further down only its mirror images are felt"
        raise ParameterError("max_depth", f"{limit}: {reason} [m]", surface.max_depth)


def _width(texture: Texture) -> float:
    """Return how wide a finite surface is, the shorter way [m]; infinite where it goes on."""
    if not texture.ends:
        return math.inf
    return float(np.hypot(*texture.domain.spans.T).min())


def _answer(result: Analysis) -> str:
    """Return the verdict in one sentence."""
    surface, judged = result.surface, result.passivity
    depth = engineering(surface.max_depth, "m")
    subject = (
        f"law {surface.law.letter} at {surface.stiffness:g} N/m, pressed to {depth}, "
        f"on the {result.device.name}"
    )
    rule = judged.criterion(judged.decided_by)
    if judged.verdict == "passive":
        limit = "infinite" if rule.limit == math.inf else f"{rounded_down(rule.limit or 0.0):.10g}"
        said = f"{_capital(subject)} is passive by {rule.formula}, whose limit is {limit} N/m"
    elif judged.verdict == "not passive":
        reason = judged.reason
        if rule.name == LEAK:
            reason = reason.removeprefix("does not hold: ")
        said = f"{_capital(subject)} is not passive: {reason}"
    else:
        said = f"Whether {subject} is passive is undecided: {judged.reason}"
    return f"{said}; {_of_jumps(result)}."


def _of_jumps(result: Analysis) -> str:
    smooth = result.continuity
    if smooth.continuous:
        return "its force is continuous"
    if not smooth.jumps:
        return f"its force is not continuous ({smooth.reason})"
    largest = engineering(max(jump.size for jump in smooth.jumps), "N")
    return f"its force jumps, by up to {largest} where that was located"


def _capital(words: str) -> str:
    return words[:1].upper() + words[1:]


def _assumptions(result: Analysis, extent: tuple[float, float] | None) -> tuple[str, ...]:
    surface, leak = result.surface, result.leak
    texture, depth = surface.texture, engineering(surface.max_depth, "m")
    said = [*texture.preparation, *_defaults(surface)]
    region = texture.domain.description
    if extent is not None:
        region = " x ".join(engineering(side, "m") for side in extent) + " from the origin"
    said.append(f"The numbers are suprema over {region} and depths to {depth}")
    x, y = (float(part) for part in leak.line.direction)
    said.append(f"Loops in the vertical plane along ({x:g}, {y:g}) are compared")
    bounds = (result.q, result.one_sided, result.curl)
    if any(bound is not None and math.isinf(bound.upper - bound.lower) for bound in bounds):
        said.append("A number without an upper bound is the greatest one found, not a proof")
    if not result.continuity.continuous:
        said.append("Jumps are located where contact begins and below the sharpest crest only")
    said += _of_the_device(result.device)
    said.append("Dry friction and quantisation of the device are in none of the criteria")
    return tuple(said)


def _defaults(surface: Surface) -> list[str]:
    """Return which numbers are the ones taken unless told otherwise."""
    said = []
    if surface.stiffness == DEFAULT_STIFFNESS:
        said.append(f"Default stiffness {surface.stiffness:g} N/m")
    if surface.max_depth == default_max_depth(surface.texture):
        depth = engineering(surface.max_depth, "m")
        said.append(f"Default max depth {depth}: the peak-to-valley height, at most 1 mm")
    if surface.max_depth > _width(surface.texture):
        width = engineering(_width(surface.texture), "m")
        said.append(f"Below {width}, the surface's width, only its mirror images are felt")
    return said + surface.parameters_said()


def _of_the_device(device: Device) -> list[str]:
    """Return what the criteria use of the device without its being verified, and its notes."""
    unverified = [
        f"{field.replace('_', ' ')} {device.data[field].text}"
        for field in _USED
        if field in device.data and not device.data[field].verified
    ]
    said = [f"Not verified for the {device.name}: {', '.join(unverified)}"] if unverified else []
    return [*said, *device.notes]
