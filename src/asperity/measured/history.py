"""What each step of a preparation made of a surface, in parameters."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.files import Record
from asperity.measured.parameters import Values, declared, parameters
from asperity.measured.parts import Part


@dataclass(frozen=True)
class Stage(Record):
    """A surface after a step of its preparation.

    Attributes:
        name: of the step, short: "levelled", "S-filter 10 µm".
        values: parameters of the surface after it, by symbol, see
            :mod:`asperity.measured.parameters`.
        removed: RMS about the mean and range of what the step took away [m]; None where that is
            nothing (a fill), or cannot be said (another size).
        nesting: nesting index L of the L-filter that it went through, with this step or before
            [m]; None for none.
    """

    name: str
    values: Values
    removed: Part | None = None
    nesting: float | None = None


Watch = Callable[[Stage, tuple[float, ...], FloatArray, FloatArray | None], None]
"""Told each stage, the pitch, the heights after it, and before it if it took something away [m]."""


class Recorder:
    """Writes down a preparation, step by step.

    Args:
        watch: is told each stage as well.
    """

    def __init__(self, watch: Watch | None = None) -> None:
        self.stages: list[Stage] = []
        self._watch = watch
        self._before: FloatArray | None = None
        self._nesting: float | None = None

    def __call__(
        self,
        name: str,
        heights: FloatArray,
        pitch: tuple[float, ...],
        *,
        removes: bool = False,
        nesting: float | None = None,
    ) -> None:
        """Write down the surface after a step.

        Args:
            name: of the step.
            heights: after it [m].
            pitch: [m].
            removes: whether it took something away that is worth a number.
            nesting: L of an L-filter [m], if the step is one.
        """
        self._nesting = nesting or self._nesting
        before = self._before
        removed = _removed(before, heights) if removes and before is not None else None
        values = parameters(heights, pitch, self._nesting)
        stage = Stage(name, values, removed, self._nesting)
        self.stages.append(stage)
        if self._watch is not None:
            self._watch(stage, pitch, heights, before if removes else None)
        self._before = heights.copy()


def stages_of(data: Any) -> tuple[Stage, ...]:
    """Return the stages of plain data, as :meth:`Stage.to_dict` gives them.

    Raises:
        ValueError: for data that are no stages.
    """
    try:
        return tuple(_stage(one) for one in data)
    except (AttributeError, KeyError, TypeError) as error:
        raise ValueError(f"no stages of a preparation: {error}") from None


def _stage(data: dict[str, Any]) -> Stage:
    values = {name: _number(value) for name, value in data["values"].items() if declared(name)}
    removed = data["removed"]
    if removed is not None:
        removed = Part(float(removed["rms"]), float(removed["range"]))
    return Stage(str(data["name"]), values, removed, _number(data["nesting"]))


def _number(value: Any) -> float | None:
    return None if value is None else float(value)


def resized(
    name: str, heights: FloatArray, pitch: tuple[float, ...], last: Stage, factor: float
) -> Stage:
    """Return the stage of a surface that has only become larger or smaller.

    Args:
        name: of the step.
        heights: after it [m].
        pitch: after it [m].
        last: the stage before.
        factor: of its lengths along x and y.
    """
    nesting = None if last.nesting is None else factor * last.nesting
    return Stage(name, parameters(heights, pitch, nesting), None, nesting)


def _removed(before: FloatArray, after: FloatArray) -> Part | None:
    """Return RMS about the mean and range of the difference, where both are known."""
    difference = before - after
    known = difference[~np.isnan(difference)]
    return Part(float(known.std()), float(np.ptp(known))) if known.size else None
