"""What would turn a verdict: something else in the place of what a claim rests on.

A claim that nothing could turn says nothing. So each names a small change of a formula, a kernel
or a result under which its verdict is another one; a test makes every one of them.
"""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import partial
from types import ModuleType
from typing import Any

import asperity.surface
from asperity.surface import Surface

Other = Callable[[Any], Any]
"""Makes what takes the place of a function, a method or a value from the one that is there."""

_ROOM = "asperity.paper"


@dataclass(frozen=True)
class Swap:
    """One name that gets another meaning.

    Attributes:
        name: of a function, a method or a value.
        other: makes its replacement.
        owner: the class or module that has it; without one, every module of the paper's claims.
    """

    name: str
    other: Other
    owner: type | ModuleType | None = None

    def owners(self) -> list[type | ModuleType]:
        """Return the classes or modules in which the name is replaced."""
        if self.owner is not None:
            return [self.owner]
        return [module for module in _modules() if self.name in vars(module)]


@dataclass(frozen=True)
class Change:
    """Something else in the place of what a claim rests on.

    Attributes:
        says: what is other, in words.
        swaps: the names that get another meaning.
    """

    says: str
    swaps: tuple[Swap, ...]

    @contextmanager
    def made(self) -> Iterator[None]:
        """Make the change for a while; what claims have kept is forgotten before and after.

        Raises:
            LookupError: for a name that nothing has.
        """
        was = []
        try:
            for swap in self.swaps:
                owners = swap.owners()
                if not owners:
                    raise LookupError(f"no claim uses {swap.name!r}")
                was += [(owner, swap.name, vars(owner)[swap.name]) for owner in owners]
                for owner in owners:
                    setattr(owner, swap.name, swap.other(vars(owner)[swap.name]))
            _forget()
            yield
        finally:
            for owner, name, value in reversed(was):
                setattr(owner, name, value)
            _forget()


def _modules() -> list[ModuleType]:
    return [module for name, module in sys.modules.items() if f"{name}.".startswith(f"{_ROOM}.")]


def _forget() -> None:
    """Clear what functions of the paper's claims have kept."""
    for module in _modules():
        for value in vars(module).values():
            clear = getattr(value, "cache_clear", None)
            if clear is not None:
                clear()


# --- kernels --------------------------------------------------------------------------------------


def _scaled(factor: float, original: Callable[..., Any]) -> Callable[..., Any]:
    """Return a function whose result is multiplied."""
    return lambda *given, **named: factor * original(*given, **named)


def forces(factor: float) -> Change:
    """Compiled forces, multiplied; along a path of a law with memory too."""

    def traced(original: Callable[..., Any]) -> Callable[..., Any]:
        # Without memory a trace asks for forces, which are multiplied already.
        return lambda surface, path: (
            (factor if surface.law.stateful else 1.0) * original(surface, path)
        )

    swaps = Swap("force", partial(_scaled, factor), Surface), Swap("trace", traced, Surface)
    return Change(f"compiled forces times {factor:g}", swaps)


def jacobians(factor: float) -> Change:
    """Compiled Jacobians, multiplied, and what a search over them finds."""

    def second(original: Callable[..., Any]) -> Callable[..., Any]:
        def both(*given: Any, **named: Any) -> tuple[Any, Any]:
            force, jacobian = original(*given, **named)
            return force, factor * jacobian

        return both

    swaps = (
        Swap("force_and_jacobian", second, Surface),
        Swap("greatest_norm", partial(_scaled, factor)),
    )
    return Change(f"compiled Jacobians times {factor:g}", swaps)


FORCES, JACOBIANS = forces(1.001), jacobians(1.001)


def laws(**others: str) -> Change:
    """Other laws in the place of some, by letter."""

    def found(original: Callable[..., Any]) -> Callable[..., Any]:
        return lambda law: original(others.get(law, law) if isinstance(law, str) else law)

    said = ", ".join(f"law {other} in the place of {law}" for law, other in others.items())
    return Change(said, (Swap("find_law", found, asperity.surface), Swap("find_law", found)))


# --- numbers and energies -------------------------------------------------------------------------


def numbers(factor: float, shorter: float = 0.0) -> Change:
    """Characteristic numbers, multiplied, of textures with a period above one [m]."""

    def scaled(original: Callable[..., Any]) -> Callable[..., Any]:
        def number(surface: Surface, *given: Any) -> Any:
            found = original(surface, *given)
            if getattr(surface.texture, "period", 1.0) <= shorter:
                return found
            return replace(found, lower=factor * found.lower, upper=factor * found.upper)

        return number

    which = f" of periods above {shorter * 1e3:g} mm" if shorter else ""
    return Change(
        f"characteristic numbers{which} times {factor:g}", (Swap("characteristic_number", scaled),)
    )


def works(factor: float, more: float = 0.0) -> Change:
    """The work around closed paths, multiplied, and something added [J]."""

    def other(original: Callable[..., Any]) -> Callable[..., Any]:
        return lambda *given: factor * original(*given) + more

    added = f" plus {more:g} J" if more else ""
    return Change(f"work around a path times {factor:g}{added}", (Swap("loop_work", other),))


def observed(name: str) -> Change:
    """An observation that a claim is right, where there is none."""
    return other("somebody observing so", "OBSERVED", lambda was: was | {name: True})


def other(says: str, name: str, value: Other, owner: type | ModuleType | None = None) -> Change:
    """Something else under one name."""
    return Change(says, (Swap(name, value, owner),))


def instead(says: str, name: str, value: Any) -> Change:
    """A value in the place of what a name of the claims stands for."""
    return other(says, name, lambda _was: value)
