"""How far below K₀/q to begin: what simulated onsets of a law leave of the smooth wall's.

That a smooth wall held says nothing of damping sideways, of the mass that a texture shakes, or of
the grip. ``margins.toml`` holds, law by law, the least stiffness over K₀/q at which it began to
cycle in the loops of ``python -m bench.margins``.
"""

from __future__ import annotations

import math
import tomllib
from dataclasses import dataclass
from functools import cache
from pathlib import Path

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.passivity.allowed import allowed_stiffness
from asperity.analysis.passivity.judgement import Allowed
from asperity.arguments import DEFAULT_STIFFNESS
from asperity.devices import Device
from asperity.files import Record
from asperity.laws import Law, find_law
from asperity.surface import Surface
from asperity.units import rounded_down

_TABLE = Path(__file__).with_name("margins.toml")
# Of what a known stiffness is worth without a margin: these are proved, or no more than half.
_PROVED = ("proved", "bounded")


@dataclass(frozen=True)
class Margin(Record):
    """The share of what a law may have at most at which to begin.

    Attributes:
        factor: of the stiffness that is allowed, at most 1.
        law: letter of the law whose simulations it comes from; of a law of your own the one of
            the shipped laws with the least.
        loop: in which the law began to cycle first, in words; empty if nothing was simulated.
        surface: of that loop.
        delay: of that loop, in samples.
        below: in how many of the loops it began to cycle below K₀/q.
        cases: how many loops there were.
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
def margins(along_lightest: bool = False) -> dict[Law, Margin]:
    """Return what was simulated of each law.

    Args:
        along_lightest: whether K₀ is that of the lightest direction.
    """
    table = tomllib.loads(_TABLE.read_text(encoding="utf-8"))
    name = "along_lightest" if along_lightest else "factor"
    return {
        find_law(law): Margin(
            entry[name], law, entry["loop"], entry["surface"], entry["delay"], entry["below"],
            entry["cases"],
        )
        for law, entry in table.items()
    }  # fmt: skip


def margin(surface: Surface, device: Device, allowed: Allowed) -> Margin:
    """Return the share of the allowed stiffness at which to begin.

    Nothing is taken off what is proved. Where K₀ is known along the device's lightest direction,
    what is left to take off is less.

    Args:
        surface: whose law counts.
        device: the device.
        allowed: up to which stiffness, and how well that is known.
    """
    if allowed.basis in _PROVED or not surface.feels_texture:
        return NO_MARGIN
    test = device.wall_test
    known = margins(along_lightest=test is not None and test.lightest is not None)
    return known.get(surface.law) or min(known.values(), key=lambda one: one.factor)


@dataclass(frozen=True)
class Start:
    """Where to begin with a law on a device.

    Attributes:
        allowed: up to which stiffness the law may be rendered, and how well that is known.
        margin: the share of that at which to begin.
        stiffness: the stiffness to begin with [N/m], rounded down to three digits; 0 if none is
            known to do, or if there is no limit.
        wall: the K₀ that counts for this law [N/m], see :func:`allowed_stiffness`.
    """

    allowed: Allowed
    margin: Margin
    stiffness: float
    wall: float | None


def start(surface: Surface, device: Device, q: Bound, one_sided: Bound) -> Start:
    """Return the stiffness to begin with; see :func:`margin`.

    Args:
        surface: its stiffness does not count.
        device: the device.
        q: its characteristic number.
        one_sided: its one-sided number.
    """
    allowed, wall = allowed_stiffness(surface, device, q, one_sided)
    share = margin(surface, device, allowed)
    known = allowed.stiffness or 0.0
    begin = rounded_down(share.factor * known) if math.isfinite(known) else 0.0
    return Start(allowed, share, begin, wall)


def at_start(surface: Surface, device: Device, found: Start) -> Surface:
    """Return the surface at the stiffness to begin with.

    Where none is known to do it is the smooth wall's K₀, and 1000 N/m where that is not known: a
    law is then judged at it.
    """
    if found.stiffness:
        return surface.to_stiffness(found.stiffness)
    test = device.wall_test
    return surface.to_stiffness(DEFAULT_STIFFNESS if test is None else test.value)
