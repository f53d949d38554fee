"""The search for an onset: which starts are to run next, at which stiffness."""

from __future__ import annotations

import math
from collections.abc import Callable, Generator, Iterator, Mapping
from itertools import islice
from typing import NamedTuple

import numpy as np

from asperity.checks import FloatArray
from asperity.simulation.kernels.body_functions import LANES
from asperity.simulation.together import Start, Together

_COARSE = 2.0  # factor from one stiffness to the next while the onset is looked for


class Found(NamedTuple):
    """What a search has found.

    Attributes:
        quiet: the greatest stiffness at which no start cycled [N/m]; 0 if there is none.
        cycling: the least at which one did [N/m]; infinite if there is none.
        cycles: how many starts cycle there; at the highest stiffness if there is none.
        low: least position reached there [m], shape (3,).
        high: greatest position [m], shape (3,).
    """

    quiet: float
    cycling: float
    cycles: int
    low: FloatArray
    high: FloatArray


def run_searches(loop: Together, searches: Mapping[int, Search]) -> Iterator[int]:
    """Run the starts that searches want, the most urgent ones of each; yield what has found."""
    left = dict(searches)
    while left:
        wanted = [
            (rank, place, start)
            for search in left.values()
            for place, (rank, start) in enumerate(search.wanted())
        ]
        wanted.sort(key=lambda one: one[:2])
        loop.run([start for _rank, _place, start in wanted[:LANES]])
        for number, search in list(left.items()):
            if search.ended():
                del left[number]
                yield number


class Search:
    """What the starts came to at each stiffness, none run twice, and which are to be run next.

    Args:
        start: returns the run of a start, by number, at a stiffness [N/m].
        count: of starts.
        path: yields stiffnesses, is sent whether any start cycles there, and returns the bracket.
        ahead: whether starts run that may not be needed, where there is room for them.
        progress: called after every stiffness.
    """

    def __init__(
        self,
        start: Callable[[float, int], Start],
        count: int,
        path: Generator[float, bool, tuple[float, float]],
        ahead: bool,
        progress: Callable[[], None] | None,
    ) -> None:
        self._start, self._count, self._path = start, count, path
        self._ahead, self._progress = ahead, progress
        self._known: dict[tuple[float, int], tuple[bool, FloatArray]] = {}
        self._going: dict[tuple[float, int], Start] = {}
        self._wanted: list[tuple[int, Start]] | None = None  # the same until a start has ended
        self._first = 0  # the start that cycled last: the likeliest to do so again
        self._bracket: tuple[float, float] | None = None
        self._stiffness = next(path)

    def wanted(self) -> list[tuple[int, Start]]:
        """Return starts that are to go on, and how little urgent each is, 0 or 1."""
        if self._wanted is None:
            self._wanted = self._next()
        return self._wanted

    def _next(self) -> list[tuple[int, Start]]:
        order = [(self._first + step) % self._count for step in range(self._count)]
        keys = [(self._stiffness, i) for i in order]
        new = list(islice((key for key in keys if key not in self._known), LANES))
        # One alone at first: if it cycles, nothing else is to be known.
        alone = self._bracket is None and new[0] == keys[0]
        for key in new[: 1 if alone and not self._ahead else None]:
            if key not in self._going:
                self._going[key] = self._start(*key)
        return [
            (int(alone and key != new[0]), self._going[key]) for key in new if key in self._going
        ]

    def ended(self) -> bool:
        """Take in what is known of the starts, and return whether there is nothing more to know."""
        ended = [key for key, start in self._going.items() if start.verdict is not None]
        if not ended:
            return False
        for key in ended:
            start = self._going.pop(key)
            self._known[key] = bool(start.verdict), start.box
        self._wanted = None
        while self._bracket is None:
            found = self._here()
            cycling = [i for i, (ended, _box) in found.items() if ended]
            if not cycling and len(found) < self._count:
                return False
            if cycling:
                self._first = cycling[0]
                # Those that have not come so far may be wanted here in the end, and nowhere else.
                here = self._stiffness
                self._going = {key: one for key, one in self._going.items() if key[0] == here}
            self._told()
            try:
                self._stiffness = self._path.send(bool(cycling))
            except StopIteration as end:
                self._bracket = end.value
                quiet, least = end.value
                self._stiffness = quiet if math.isinf(least) else least
        if len(self._here()) < self._count:
            return False
        self._told()
        return True

    def found(self) -> Found:
        """Return what was found."""
        assert self._bracket is not None
        ends = self._here().values()
        low = np.fmin.reduce([box[0] for _, box in ends])
        high = np.fmax.reduce([box[1] for _, box in ends])
        return Found(*self._bracket, sum(ended for ended, _ in ends), low, high)

    def _here(self) -> dict[int, tuple[bool, FloatArray]]:
        """Return what the starts came to at the stiffness."""
        numbers = [(self._first + step) % self._count for step in range(self._count)]
        every = {i: self._known.get((self._stiffness, i)) for i in numbers}
        return {i: one for i, one in every.items() if one is not None}

    def _told(self) -> None:
        if self._progress is not None:
            self._progress()


def bracket(
    lowest: float, highest: float, width: float, near: float | None = None
) -> Generator[float, bool, tuple[float, float]]:
    """Return the greatest stiffness found quiet and the least found cycling [N/m].

    Yields stiffnesses, and is sent whether any start cycles there: upwards from the lowest in steps
    of a factor of 2 until something does, then bisection; with ``near``, from the step nearest to
    it, downwards first if that one cycles.
    """
    steps = _steps(lowest, highest)
    index = 0
    if near is not None and near > 0.0:
        index = int(np.argmin(np.abs(np.log(steps) - math.log(near))))
    if (yield steps[index]):
        while index > 0 and (yield steps[index - 1]):
            index -= 1
    else:
        index += 1
        while index < len(steps) and not (yield steps[index]):
            index += 1
        if index == len(steps):
            return steps[-1], math.inf
    quiet, cycling = (steps[index - 1] if index else 0.0), steps[index]
    while quiet > 0.0 and cycling > quiet * (1.0 + width):
        middle = math.sqrt(quiet * cycling)
        if (yield middle):
            cycling = middle
        else:
            quiet = middle
    return quiet, cycling


def _steps(lowest: float, highest: float) -> list[float]:
    """Return stiffnesses a factor of 2 apart, the last step shorter [N/m]."""
    steps = [lowest]
    while steps[-1] < highest:
        steps.append(min(steps[-1] * _COARSE, highest))
    return steps
