"""Memory known beforehand: what a surface of so many points will need, and what may be used.

Whoever knows how many points a surface has says so before there are arrays of them; above what a
command may use it is refused. Outside the command line nothing is limited.
"""

from __future__ import annotations

import math
import os
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path

from asperity.errors import ParameterError

# Measured peaks of commands on maps of 256² to 2048² points, see tests/test_memory.py: libraries
# and compiled code, the search for numbers, pictures; then heights, splines and their pyramids.
_BASE, _PREPARING_BASE = 420_000_000, 100_000_000
_PER_POINT = 70


@dataclass(frozen=True)
class Budget:
    """What a command may use.

    Attributes:
        limit: [bytes].
        base: what it needs on the smallest surface [bytes].
        words: where the limit is from, "of --memory".
    """

    limit: int
    base: int
    words: str

    @property
    def points(self) -> int:
        """Of the largest surface that fits."""
        return max(0, (self.limit - self.base) // _PER_POINT)


_BUDGET: ContextVar[Budget | None] = ContextVar("budget", default=None)


@contextmanager
def limited(command: str, limit: int | None) -> Iterator[None]:
    """Limit what surfaces may need while a command runs.

    Args:
        command: its name.
        limit: what was given [bytes]; ``None`` for what the machine has free, if that is known.

    Raises:
        ParameterError: for a given limit below what the command needs on any surface.
    """
    base = estimate(command, 0)
    if limit is not None and limit < base:
        words = f"must be at least {_size(base)} for {command}, got {_size(limit)}"
        raise ParameterError("memory", words)
    allowed, words = (limit, "given") if limit is not None else (free_memory(), "free")
    token = _BUDGET.set(None if allowed is None else Budget(allowed, base, words))
    try:
        yield
    finally:
        _BUDGET.reset(token)


def estimate(command: str, points: int) -> int:
    """Return an upper estimate of a command's peak memory on so many points [bytes]."""
    return (_PREPARING_BASE if command == "prepare" else _BASE) + _PER_POINT * points


def reserve(*counts: int) -> None:
    """Refuse a surface for which there is not enough memory, before there are arrays of it.

    Args:
        counts: points along each axis.

    Raises:
        ParameterError: with what is needed, what may be used, and what would fit.
    """
    budget, points = _BUDGET.get(), math.prod(counts)
    if budget is None or points <= budget.points:
        return
    wanted = f"must be about {_size(budget.base + _PER_POINT * points)}"
    given = f"{_size(budget.limit)} are {budget.words}"
    count = " x ".join(map(str, counts))
    advice = _advice(points, budget, len(counts))
    raise ParameterError("memory", f"{wanted} for {count} points, {given}; {advice}")


def _advice(points: int, budget: Budget, axes: int) -> str:
    if budget.points < 4**axes:
        return "no surface would fit"
    side = " x ".join([str(int(budget.points ** (1.0 / axes)))] * axes)
    step = math.ceil((points / budget.points) ** (1.0 / axes))
    return f"{side} points would fit: crop it, or take a pitch {step} times as long"


def _size(count: int) -> str:
    if count < 10**6:
        return f"{count} bytes"
    return f"{count / 1e9:.3g} GB" if count >= 10**9 else f"{count / 1e6:.0f} MB"


def free_memory() -> int | None:
    """Return what this machine, or the group of this process, has free [bytes], if it says so."""
    known = [_machine()]
    group = Path("/sys/fs/cgroup")
    for most, used in (
        (group / "memory.max", group / "memory.current"),
        (group / "memory/memory.limit_in_bytes", group / "memory/memory.usage_in_bytes"),
    ):
        with suppress(OSError, ValueError):  # another version, or no limit: "max"
            known.append(int(most.read_text()) - int(used.read_text()))
    sizes = [size for size in known if size is not None]
    return max(0, min(sizes)) if sizes else None


def _machine() -> int | None:
    with suppress(OSError, ValueError, IndexError):
        text = Path("/proc/meminfo").read_text(encoding="ascii")  # counts what caches give back
        return int(text.split("MemAvailable:")[1].split()[0]) * 1024
    with suppress(AttributeError, OSError, ValueError):  # not on Windows
        return os.sysconf("SC_AVPHYS_PAGES") * os.sysconf("SC_PAGE_SIZE")
    return None
