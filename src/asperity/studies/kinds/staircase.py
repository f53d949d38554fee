"""The weighted up-down staircase."""

from __future__ import annotations

from typing import Protocol

from asperity.core.errors import ParameterError

_FASTER = (4.0, 2.0, 2.0)  # multiples of the step before each of the first reversals


class Track(Protocol):
    """A procedure that chooses levels x, the natural logarithm of an increment."""

    def level(self) -> float:
        """Return the level to present now."""

    def record(self, correct: bool) -> None:
        """Record whether the answer was right."""


class Staircase:
    """The weighted up-down staircase, which settles where a share p of the answers is right.

    A right answer lowers the level by a step s, a wrong one raises it by s p/(1 − p); where a
    share p is right, the level stays. Before the first reversals the steps are greater.

    Args:
        start: first level.
        low: lowest level.
        high: highest level.
        step: s, in the unit of the levels.
        target: p; it must be above the share of right answers of a guess.
        guess: share of right answers of a guess.

    Raises:
        ParameterError: for a target that a guess reaches.

    References:
        C. Kaernbach: Simple adaptive testing with the weighted up-down method. Perception &
        Psychophysics 49 (1991) 227–229, https://doi.org/10.3758/BF03214307.

    Example:
        >>> track = Staircase(start=0.0, low=-9.0, high=9.0, step=0.1, target=0.75, guess=0.5)
        >>> track.record(True)
        >>> track.level()
        -0.4
    """

    def __init__(
        self, start: float, low: float, high: float, step: float, target: float, guess: float
    ) -> None:
        if target <= guess:
            words = f"must be above {guess:.3g}, the share of right answers of a guess"
            raise ParameterError("method.target", words, target)
        self._level, self._low, self._high = start, low, high
        self._down, self._up = step, step * target / (1.0 - target)
        self._reversals, self._last = 0, True

    def level(self) -> float:
        """Return the level to present now."""
        return self._level

    def record(self, correct: bool) -> None:
        """Move the level."""
        self._reversals += correct != self._last
        self._last = correct
        factor = _FASTER[self._reversals] if self._reversals < len(_FASTER) else 1.0
        moved = self._level + factor * (-self._down if correct else self._up)
        self._level = min(max(moved, self._low), self._high)
