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
# Starts of which all must be quiet for a stiffness to be believed to be, until the end.
SOUNDED = 2

Path = Generator[tuple[float, bool], bool, tuple[float, float]]
"""Yields a stiffness and whether all starts are to be known there, is sent whether any of them
cycles, and returns the greatest stiffness found quiet and the least found cycling [N/m]."""


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

    Most stiffnesses of a search are quiet, and each from all starts, only to say on which side of
    them the onset lies. Where the path asks for no more they are sounded: believed to be quiet as
    soon as ``SOUNDED`` starts are, those first that cycled elsewhere. The quiet end of the bracket
    is looked at from all starts before it is believed; if one of them cycles, the path is taken
    anew with what is known. So the two ends are facts, and where loops cycle above one stiffness
    only they are those that are found with all starts everywhere. What is known of one start waits
    for those before it: which others run beside them, and how fast, changes no answer.

    Args:
        start: returns the run of a start, by number, at a stiffness [N/m].
        count: of starts.
        path: returns a path such as :func:`bracket`.
        ahead: whether starts run that may not be needed, where there is room for them.
        progress: called after every stiffness.
    """

    def __init__(
        self,
        start: Callable[[float, int], Start],
        count: int,
        path: Callable[[], Path],
        ahead: bool,
        progress: Callable[[], None] | None,
    ) -> None:
        self._start, self._count, self._path = start, count, path
        self._ahead, self._progress = ahead, progress
        self._known: dict[tuple[float, int], tuple[bool, FloatArray]] = {}
        self._going: dict[tuple[float, int], Start] = {}
        self._answers: dict[float, bool] = {}  # of all starts, or of one that cycles
        self._sounded: set[float] = set()
        self._first = 0  # the start that cycled last: the likeliest to do so again
        self._bracket: tuple[float, float] | None = None
        self._ask()

    def wanted(self) -> list[tuple[int, Start]]:
        """Return starts that are to go on, and how little urgent each is, 0 or 1."""
        keys = [(self._stiffness, i) for i in self._numbers()]
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
        for key, start in list(self._going.items()):
            if start.verdict is not None:
                self._known[key] = start.verdict, start.box
                del self._going[key]
        while self._bracket is None:
            cycles = self._cycles_here()
            if cycles is None:
                return False
            if cycles or self._whole:
                self._answers[self._stiffness] = cycles
            else:
                self._sounded.add(self._stiffness)
            self._told()
            self._ask()
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

    def _ask(self) -> None:
        """Take the path as far as answers are known: to a stiffness that is to be looked at."""
        path = self._path()
        self._stiffness, self._whole = next(path)
        try:
            while self._stiffness in self._answers or (
                self._stiffness in self._sounded and not self._whole
            ):
                cycles = self._answers.get(self._stiffness, False)
                self._stiffness, self._whole = path.send(cycles)
        except StopIteration as end:
            quiet, least = end.value
            self._stiffness, self._whole = quiet, True
            if quiet == 0.0 or quiet in self._answers:
                self._bracket = quiet, least
                self._stiffness = quiet if math.isinf(least) else least

    def _numbers(self) -> list[int]:
        """Return the starts that are asked for at the stiffness, in the order in which they are."""
        asked = self._count if self._whole else min(SOUNDED, self._count)
        return [(self._first + step) % self._count for step in range(asked)]

    def _cycles_here(self) -> bool | None:
        """Return whether one of those starts cycles; ``None`` while it is not known."""
        for i in self._numbers():
            if (self._stiffness, i) not in self._known:
                return None
            if self._known[self._stiffness, i][0]:
                self._first = i
                # At what is stiffer nothing more is to be known.
                here = self._stiffness
                self._going = {key: one for key, one in self._going.items() if key[0] <= here}
                return True
        return False

    def _here(self) -> dict[int, tuple[bool, FloatArray]]:
        """Return what the starts came to at the stiffness."""
        every = {i: self._known.get((self._stiffness, i)) for i in range(self._count)}
        return {i: one for i, one in every.items() if one is not None}

    def _told(self) -> None:
        if self._progress is not None:
            self._progress()


def bracket(lowest: float, highest: float, width: float, near: float | None = None) -> Path:
    """Go upwards from the lowest stiffness in steps of a factor of 2 until something cycles.

    Then bisection; with ``near``, from the step nearest to it, downwards first if that one cycles.
    Of what is gone past on the way up all starts are to be known: nothing that cycles there is
    climbed over.
    """
    steps = _steps(lowest, highest)
    index = 0
    if near is not None and near > 0.0:
        index = int(np.argmin(np.abs(np.log(steps) - math.log(near))))
    if (yield steps[index], True):
        while index > 0 and (yield steps[index - 1], False):
            index -= 1
    else:
        index += 1
        while index < len(steps) and not (yield steps[index], True):
            index += 1
        if index == len(steps):
            return steps[-1], math.inf
    quiet, cycling = (steps[index - 1] if index else 0.0), steps[index]
    while quiet > 0.0 and cycling > quiet * (1.0 + width):
        middle = math.sqrt(quiet * cycling)
        if (yield middle, False):
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
