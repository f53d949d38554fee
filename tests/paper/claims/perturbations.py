"""The changes under which the verdicts of the paper's claims are different.

A claim that nothing can falsify is empty. Each claim therefore names a small change of a formula, a
kernel or a result in ``flips_under``; these are the changes, by that description.
"""

from __future__ import annotations

import math
import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from types import ModuleType
from typing import Any

import asperity.surface
from asperity.paper.cases import SCANNING, ExperimentCase, FrictionCase
from asperity.paper.claim import Check, check_statement
from asperity.paper.claims.design_limits import CORRECTED_LIMITS, Inequality
from asperity.paper.probes import ProbePoint
from asperity.surface import Surface

ReplacementFactory = Callable[[Any], Any]
"""Returns the replacement of a function, a method or a value."""

_PACKAGE = "asperity.paper"


@dataclass(frozen=True)
class Replacement:
    """The replacement of one name.

    Attributes:
        name: name of a function, a method or a value.
        factory: returns its replacement.
        owner: class or module that has it; by default every module of the paper's claims.
    """

    name: str
    factory: ReplacementFactory
    owner: type | ModuleType | None = None

    def find_owners(self) -> list[type | ModuleType]:
        """Return the classes or modules in which the name is replaced."""
        if self.owner is not None:
            return [self.owner]
        return [module for module in _loaded_modules() if self.name in vars(module)]


@dataclass(frozen=True)
class Perturbation:
    """A change of what a claim depends on.

    Attributes:
        description: the change in words.
        replacements: the replaced names.
    """

    description: str
    replacements: tuple[Replacement, ...]

    @contextmanager
    def apply(self) -> Iterator[None]:
        """Apply the change temporarily; caches of the claims are cleared before and after.

        Raises:
            LookupError: if no module has one of the names.
        """
        originals = []
        try:
            for one in self.replacements:
                owners = one.find_owners()
                if not owners:
                    raise LookupError(f"no claim uses {one.name!r}")
                originals += [(owner, one.name, vars(owner)[one.name]) for owner in owners]
                for owner in owners:
                    setattr(owner, one.name, one.factory(vars(owner)[one.name]))
            _clear_caches()
            yield
        finally:
            for owner, name, value in reversed(originals):
                setattr(owner, name, value)
            _clear_caches()


def _loaded_modules() -> list[ModuleType]:
    return [module for name, module in sys.modules.items() if f"{name}.".startswith(f"{_PACKAGE}.")]


def _clear_caches() -> None:
    """Clear the caches of functions of the paper's claims."""
    for module in _loaded_modules():
        for value in vars(module).values():
            clear = getattr(value, "cache_clear", None)
            if clear is not None:
                clear()


def replace_name(
    description: str, name: str, factory: ReplacementFactory, owner: type | ModuleType | None = None
) -> Perturbation:
    """Replace one name."""
    return Perturbation(description, (Replacement(name, factory, owner),))


# --- kernels --------------------------------------------------------------------------------------


def _scale_result(factor: float, original: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function whose result is multiplied."""
    return lambda *arguments, **keywords: factor * original(*arguments, **keywords)


def scale_forces(factor: float) -> Perturbation:
    """Scale compiled forces, including those along a path of a law with state."""

    def scale_trace(original: Callable[..., Any]) -> Callable[..., Any]:
        # Without state a trace evaluates forces, which are scaled already.
        return lambda surface, path: (
            (factor if surface.law.stateful else 1.0) * original(surface, path)
        )

    replacements = (
        Replacement("force", partial(_scale_result, factor), Surface),
        Replacement("trace", scale_trace, Surface),
    )
    return Perturbation(f"compiled forces times {factor:g}", replacements)


def scale_jacobians(factor: float) -> Perturbation:
    """Scale compiled Jacobians and the result of a search over them."""

    def scale_jacobian(original: Callable[..., Any]) -> Callable[..., Any]:
        def scaled(*arguments: Any, **keywords: Any) -> tuple[Any, Any]:
            force, jacobian = original(*arguments, **keywords)
            return force, factor * jacobian

        return scaled

    replacements = (
        Replacement("force_and_jacobian", scale_jacobian, Surface),
        Replacement("find_max_norm", partial(_scale_result, factor)),
    )
    return Perturbation(f"compiled Jacobians times {factor:g}", replacements)


def _stiffen(original: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function of a surface whose result grows faster than the stiffness."""

    def stiffened(surface: Surface, *arguments: Any, **keywords: Any) -> Any:
        factor = 1.0 + 1e-6 * surface.stiffness
        return factor * original(surface, *arguments, **keywords)

    return stiffened


STIFFENED_JACOBIANS = replace_name(
    "searched Jacobians times 1 + κ₀/(1 MN/m)", "find_max_norm", _stiffen
)


def substitute_laws(**substitutes: str) -> Perturbation:
    """Replace laws by others, by letter."""

    def substitute(original: Callable[..., Any]) -> Callable[..., Any]:
        return lambda law: original(substitutes.get(law, law) if isinstance(law, str) else law)

    text = ", ".join(f"law {other} in the place of {law}" for law, other in substitutes.items())
    owners = (asperity.surface, None)
    return Perturbation(text, tuple(Replacement("find_law", substitute, owner) for owner in owners))


# --- numbers and energies -------------------------------------------------------------------------


def scale_numbers(factor: float, min_period: float = 0.0) -> Perturbation:
    """Scale the characteristic numbers of textures with a period above a limit [m]."""

    def scaled(original: Callable[..., Any]) -> Callable[..., Any]:
        def number(surface: Surface, *arguments: Any) -> Any:
            bound = original(surface, *arguments)
            if getattr(surface.texture, "period", 1.0) <= min_period:
                return bound
            return replace(bound, lower=factor * bound.lower, upper=factor * bound.upper)

        return number

    which = f" of periods above {min_period * 1e3:g} mm" if min_period else ""
    return replace_name(
        f"characteristic numbers{which} times {factor:g}", "characteristic_number", scaled
    )


def scale_work(factor: float, offset: float = 0.0) -> Perturbation:
    """Scale the work around closed paths, and add an offset [J]."""

    def scale(original: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *arguments: factor * original(*arguments) + offset

    added = f" plus {offset:g} J" if offset else ""
    return replace_name(f"work around a path times {factor:g}{added}", "loop_work", scale)


# --- single functions -----------------------------------------------------------------------------


def _replace_limit(description: str, number: int, inequality: Inequality) -> Perturbation:
    """Replace a printed inequality."""
    return replace_name(
        description, "PRINTED_LIMITS", lambda original: original | {number: inequality}
    )


def _observed(_original: Callable[..., Check]) -> Callable[..., Check]:
    return lambda numbers=None: check_statement(printed=True, numbers=numbers)


def _double_deflection(original: Callable[..., Surface]) -> Callable[..., Surface]:
    def surface(case: ExperimentCase, law: str, **changes: Any) -> Surface:
        changes |= {"max_deflection": 2.0 * case.deflection} if law == "F" else {}
        return original(case, law, **changes)

    return surface


def _without_curvature(probe: ProbePoint) -> Any:
    """Return the Jacobian of D as printed in (18)."""
    import numpy as np

    matrix = np.array([[probe.slope**2, -probe.slope], [-probe.slope, 1.0]])
    return -probe.k / (1.0 + probe.slope**2) * matrix


def _replace_clamp(name: str, original: Callable[..., float]) -> Callable[..., float]:
    """Replace the lateral clamp."""
    return lambda law, clamp, depth_factor: original(
        law, name if clamp == "lateral" else clamp, depth_factor
    )


def _count_as_printed(original: Callable[..., Any]) -> Callable[..., Any]:
    """Count no cycles for W and all starts for the other laws."""

    def count(law: str, divisor: float, delay: int) -> Any:
        counts = original(law, divisor, 0)
        return replace(counts, delay=delay, cycles=0 if law == "W" else counts.starts)

    return count


def _strokes_of(law: str) -> Perturbation:
    return replace_name(
        f"strokes of law {law}", "_simulated_strokes", lambda original: lambda _law: original(law)
    )


def _bumps_of(law: str, substitute: str) -> Perturbation:
    return replace_name(
        f"bumps of law {substitute} for {law}",
        "_simulated_bumps",
        lambda original: lambda requested: original(substitute if requested == law else requested),
    )


def _negate_sum(original: Callable[..., Any]) -> Callable[..., Any]:
    return lambda law: tuple(
        replace(one, same_sample=tuple(-part for part in one.same_sample)) for one in original(law)
    )


def _delay_onsets(original: Callable[..., Any]) -> Callable[..., Any]:
    def delay(onset: Any) -> Any:
        if onset.onset.is_smooth_wall:
            return onset
        return replace(onset, onset=replace(onset.onset, cycling=10.0 * onset.onset.cycling))

    return lambda laws, delays, _starts: tuple(delay(onset) for onset in original(laws, delays, 1))


SCALED_FORCES, SCALED_JACOBIANS = scale_forces(1.001), scale_jacobians(1.001)
_ALL = (
    SCALED_FORCES,
    SCALED_JACOBIANS,
    scale_forces(0.9),
    scale_forces(1.1),
    scale_jacobians(1.2),
    scale_numbers(0.99),
    STIFFENED_JACOBIANS,
    scale_numbers(0.999),
    scale_numbers(1.02),
    scale_numbers(1.1),
    scale_numbers(10.0, min_period=1.5e-3),
    scale_work(0.0),
    scale_work(1.0, offset=1e-3),
    *(
        substitute_laws(**{law: other})
        for law, other in zip("AABBCCCDEEFG", "BCACABWEADAA", strict=True)
    ),
    substitute_laws(A="C", E="W"),
    replace_name("an observation that confirms it", "check_observation", _observed),
    _replace_limit(
        "½ α v T/l < 1", 1, lambda v: (0.5 * v["alpha"] * v["v"] * v["T"] / v["l"], 1.0)
    ),
    _replace_limit("½ β δ/l < 1", 2, lambda v: (0.5 * v["beta"] * v["delta"] / v["l"], 1.0)),
    _replace_limit(
        "α (δ + v T)/l < 1",
        3,
        lambda v: (v["alpha"] * (v["delta"] + v["v"] * v["T"]) / v["l"], 1.0),
    ),
    _replace_limit("γ b < A", 4, CORRECTED_LIMITS[4]),
    _replace_limit("v l < F₀", 6, lambda v: (v["v"] * v["l"], v["resonance"])),
    replace_name("a hand of 0.4 m/s", "_SPEED", lambda _original: 0.4),
    replace_name(
        "one sample of delay for two",
        "_delayed_wall_gain",
        lambda original: lambda delay=2: original(1 if delay == 2 else delay),
    ),
    replace_name(
        "√2 times the norm of (26)",
        "sticking_norm",
        lambda original: lambda case: math.sqrt(2.0) * original(case),
        FrictionCase,
    ),
    replace_name(
        "three times the damping", "_handle_damping", lambda original: lambda x: 3.0 * original(x)
    ),
    replace_name(
        "each force held over the step before it",
        "held_force_work",
        lambda original: lambda path, _force: original(path, SCANNING.surface("W").force(path[1:])),
    ),
    replace_name(
        "an anchor that is dragged from twice the deflection on",
        "surface",
        _double_deflection,
        ExperimentCase,
    ),
    Perturbation(
        "D's Jacobian without curvature, (18)",
        tuple(
            Replacement(name, lambda _original: _without_curvature, ProbePoint)
            for name in ("jacobian", "compiled_jacobian")
        ),
    ),
    replace_name(
        "2πA/l for every q",
        "q",
        lambda _original: lambda case, _law: 2.0 * math.pi * case.amplitude / case.period,
        ExperimentCase,
    ),
    replace_name(
        "A's q for every law",
        "q",
        lambda original: lambda case, _law: original(case, "A"),
        ExperimentCase,
    ),
    replace_name(
        "a lateral clamp that holds the whole force",
        "_max_norm_at_depth",
        partial(_replace_clamp, "whole"),
    ),
    replace_name(
        "a lateral clamp that holds nothing", "_max_norm_at_depth", partial(_replace_clamp, "none")
    ),
    replace_name(
        "∞ printed for q of D",
        "_printed_rows",
        lambda original: lambda: original() | {"D": replace(original()["D"], value=math.inf)},
    ),
    replace_name(
        "Jacobians of the paper's F times 1.2",
        "max_norm_ratio",
        lambda original: lambda case: 1.2 * original(case),
        FrictionCase,
    ),
    replace_name(
        "A and F cycling from every start, W from none", "count_cycles", _count_as_printed
    ),
    replace_name("the paper's sum with its sign turned", "_simulated_strokes", _negate_sum),
    _strokes_of("A"),
    _strokes_of("H"),
    _bumps_of("A", "D"),
    _bumps_of("D", "A"),
    replace_name(
        "every textured wall cycling at ten times the stiffness", "passivity_onsets", _delay_onsets
    ),
)
PERTURBATIONS = {one.description: one for one in _ALL}
