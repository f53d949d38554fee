"""Estimates and limits of the memory that a surface needs.

A surface with too many points is refused before its arrays are allocated. Only the command line
sets a limit.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from contextvars import ContextVar
from dataclasses import dataclass
from pathlib import Path

from asperity.core.errors import ParameterError

# Measured peaks of commands on maps of 256² to 2048² points, see tests/core/test_memory.py: base
# memory of libraries, compiled code and pictures; then heights, splines and their pyramids.
_BASE_MEMORY = 420_000_000
_PREPARATION_BASE_MEMORY = 100_000_000
_BYTES_PER_POINT = 70


@dataclass(frozen=True)
class MemoryBudget:
    """Memory available to a command.

    Attributes:
        limit: available memory [bytes].
        base: memory that the command needs on the smallest surface [bytes].
        source: origin of the limit, "given" or "free".
    """

    limit: int
    base: int
    source: str

    @property
    def max_points(self) -> int:
        """Number of points of the largest surface that fits."""
        return max(0, (self.limit - self.base) // _BYTES_PER_POINT)


_BUDGET: ContextVar[MemoryBudget | None] = ContextVar("budget", default=None)


@contextmanager
def limit_memory(command: str, limit: int | None) -> Iterator[None]:
    """Limit the memory of surfaces while a command runs.

    Args:
        command: name of the command.
        limit: limit [bytes]; ``None`` for the free memory of the machine, if it is known.

    Raises:
        ParameterError: for a limit below the memory that the command needs on any surface.
    """
    base = estimate_memory(command, 0)
    if limit is not None and limit < base:
        needed = f"must be at least {_format_size(base)} for {command}"
        raise ParameterError("memory", f"{needed}, got {_format_size(limit)}")
    source = "given"
    if limit is None:
        limit = free_memory()
        source = "free"
    budget = None
    if limit is not None:
        budget = MemoryBudget(limit, base, source)
    token = _BUDGET.set(budget)
    try:
        yield
    finally:
        _BUDGET.reset(token)


def estimate_memory(command: str, points: int) -> int:
    """Return an upper estimate of the peak memory of a command on a number of points [bytes]."""
    base = _PREPARATION_BASE_MEMORY if command == "prepare" else _BASE_MEMORY
    return base + _BYTES_PER_POINT * points


def require_memory(*counts: int) -> None:
    """Check that there is enough memory for a surface, before its arrays are allocated.

    Args:
        counts: points along each axis.

    Raises:
        ParameterError: if there is not; the message states the size that fits.
    """
    budget = _BUDGET.get()
    points = math.prod(counts)
    if budget is None or points <= budget.max_points:
        return
    needed = f"must be about {_format_size(budget.base + _BYTES_PER_POINT * points)}"
    available = f"{_format_size(budget.limit)} are {budget.source}"
    count = " x ".join(map(str, counts))
    advice = _suggest_size(points, budget, len(counts))
    raise ParameterError("memory", f"{needed} for {count} points, {available}; {advice}")


def _suggest_size(points: int, budget: MemoryBudget, axes: int) -> str:
    if budget.max_points < 4**axes:
        return "no surface would fit"
    side = " x ".join([str(int(budget.max_points ** (1.0 / axes)))] * axes)
    step = math.ceil((points / budget.max_points) ** (1.0 / axes))
    return f"{side} points would fit: crop it, or take a pitch {step} times as long"


def _format_size(count: int) -> str:
    if count < 10**6:
        return f"{count} bytes"
    if count < 10**9:
        return f"{count / 1e6:.0f} MB"
    return f"{count / 1e9:.3g} GB"


def free_memory() -> int | None:
    """Return the free memory of the machine or of the control group [bytes], if it is known."""
    limits = [math.inf]
    with suppress(OSError, ValueError, IndexError):  # another system
        text = Path("/proc/meminfo").read_text(encoding="ascii")  # includes reclaimable caches
        limits.append(int(text.split("MemAvailable:")[1].split()[0]) * 1024)
    group = Path("/sys/fs/cgroup")
    for limit, used in (
        (group / "memory.max", group / "memory.current"),
        (group / "memory/memory.limit_in_bytes", group / "memory/memory.usage_in_bytes"),
    ):
        with suppress(OSError, ValueError):  # another version, or no limit: "max"
            limits.append(int(limit.read_text()) - int(used.read_text()))
    free = max(0, min(limits))
    return None if math.isinf(free) else int(free)
