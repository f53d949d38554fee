"""From rows of a loop to numbers of its device, each with its uncertainty.

Motion is fitted in a form that needs no velocity: m p'' = u(t - d T) - b p' - F_c sign p' + c,
integrated twice over a stretch of time, is

    ∬u = m p + b ∫p + F_c ∬sign p' + a₀ + a₁ t + a₂ t²,

linear in what is looked for. ∬u of a force that is held from sample to sample is exact; where a
stretch began, how fast, and a constant force are in a₀, a₁ and a₂. The delay is the whole number
of samples of which the sum of squares is least.

Reference:
    Integrating a model instead of differentiating a record: Young, "Parameter estimation for
    continuous-time models: a survey", Automatica 17(1), 1981, section 3.
"""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np

from asperity.checks import FloatArray
from asperity.files import Record

LONGEST_DELAY = 20
"""Samples of delay that are tried."""
STRETCHES = 8
"""Of a record that are fitted each on its own: their scatter is the uncertainty."""
_LEAST = 1e-10  # [m] steps below are none: the last bits of a position
_ON_GRID = 0.1  # of a step: positions further from its multiples lie on no grid
_SMOOTHED = 8
_FAST = 3.0  # steps from one sample to the next: a handle that is read afresh moves before, too


Equations = FloatArray
"""Squares and products of what multiplies mass, damping and friction, and of ∬u, summed (4, 4)."""


@dataclass(frozen=True)
class Estimate(Record):
    """A number that was measured.

    Attributes:
        value: in SI units.
        uncertainty: its standard uncertainty, in the same unit.
    """

    value: float
    uncertainty: float


@dataclass(frozen=True)
class Motion(Record):
    """What moves along an axis.

    Attributes:
        mass: as felt [kg].
        damping: physical [N s/m].
        friction: dry [N].
    """

    mass: Estimate
    damping: Estimate
    friction: Estimate


@dataclass(frozen=True)
class Delay(Record):
    """Whole samples between a reading and its force.

    Attributes:
        samples: of which all records together are fitted best.
        others: those that are fitted best when a part of the records is left out.
    """

    samples: int
    others: tuple[int, ...]


@dataclass(frozen=True)
class Pushes:
    """A record of a handle that was pushed to and fro along an axis.

    Attributes:
        positions: at the samples (n,) [m].
        forces: that were commanded at them (n,) [N].
        span: samples that a push lasts, on average.
    """

    positions: FloatArray
    forces: FloatArray
    span: int


def position_step(positions: FloatArray) -> Estimate | None:
    """Return the step in which positions are read [m]; ``None`` where they are read exactly.

    Args:
        positions: along an axis, of a handle that moves, (n,) [m].

    The readings of an encoder are multiples of its step, which their differences show far better
    than their scatter. Where an arm turns angles into positions they are not: then the step is that
    of most readings that differ from the one before, among those that stand still in between.

    Example:
        >>> position_step(2e-5 * np.array([0, 1, 3, 2, 5, 5, 4])).value
        2e-05
    """
    apart = np.diff(np.unique(positions))
    apart = apart[apart > _LEAST]
    moves = np.abs(np.diff(positions))
    moves = moves[moves > _LEAST]
    if len(apart) < 2:
        return None
    for part in (1, 2, 3):
        step = float(apart.min()) / part
        counts = np.rint(apart / step)
        step = float(apart @ counts / (counts @ counts))
        rest = np.abs(apart / step - counts)
        if rest.max() < _ON_GRID and len(apart) > 2:
            return Estimate(step, step * max(float(rest.std()), 1e-6) / math.sqrt(len(apart)))
    if len(moves) > 0.9 * (len(positions) - 1):
        return None
    return Estimate(float(np.median(moves)), float(np.subtract(*np.percentile(moves, [75, 25]))))


def rest_noise(positions: FloatArray) -> Estimate:
    """Return the standard deviation of readings at rest [m], without what they drift.

    Args:
        positions: along an axis, (n,) [m].
    """
    count = len(positions)
    times = np.linspace(-1.0, 1.0, count)
    line = np.polynomial.Polynomial.fit(times, positions, 1)
    spread = float(np.std(positions - line(times)))
    return Estimate(spread, spread / math.sqrt(2.0 * count))


def fresh_share(positions: FloatArray, step: float) -> float:
    """Return the share of readings that are fresh; 1 where no reading tells.

    A device that is asked more often than it measures repeats itself between two moves of several
    steps in one direction. One that measures each time cannot.

    Args:
        positions: along an axis, of a handle that moves fast, (n,) [m].
        step: in which they are read [m]; 0 for exact ones.
    """
    moves = np.diff(positions)
    changes = np.flatnonzero(np.abs(moves) > _LEAST)
    far = moves[changes] * (np.abs(moves[changes]) > _FAST * step)
    on = far[1:] * far[:-1] > 0.0
    return 1.0 / float(np.diff(changes)[on].mean()) if on.any() else 1.0


def twice_integrated(force: FloatArray, period: float) -> FloatArray:
    """Return ∬ of a force that is held over each sample, at the samples."""
    once = period * np.concatenate([[0.0], np.cumsum(force)[:-1]])
    inner = period * once + 0.5 * period**2 * force
    return np.concatenate([[0.0], np.cumsum(inner)[:-1]])


def speed_sign(positions: FloatArray, lag: int) -> FloatArray:
    """Return the sign of the velocity, of differences over so many samples to both sides."""
    padded = np.pad(positions, lag, mode="edge")
    return np.asarray(np.sign(padded[2 * lag :] - padded[: -2 * lag]))


def fit_motions(records: Sequence[Pushes], period: float) -> tuple[Delay, list[Motion]]:
    """Return the delay of a device, and what moves along each of its axes.

    Args:
        records: one for each axis.
        period: T [s].
    """
    tables = [
        [_stretches(record, delay, period) for delay in range(LONGEST_DELAY + 1)]
        for record in records
    ]
    whole = np.array([[_fit(parts)[1] for parts in table] for table in tables])
    delay = _least(whole)
    others = set()
    for left_out in range(STRETCHES):
        errors = np.array([
            [_fit(parts[:left_out] + parts[left_out + 1 :])[1] for parts in table]
            for table in tables
        ])  # fmt: skip
        others.add(_least(errors))
    motions = [_motion(record, table[delay], delay, period)
               for record, table in zip(records, tables, strict=True)]  # fmt: skip
    return Delay(delay, tuple(sorted(others - {delay}))), motions


def _least(errors: FloatArray) -> int:
    """Return the delay of the least errors, each axis by its own measure (axes, delays)."""
    return int(np.argmin(np.log(errors + 1e-300).sum(axis=0)))


def _stretches(
    record: Pushes, delay: int, period: float, smoothed: int = _SMOOTHED
) -> list[Equations]:
    """Return the equations of the stretches of a record, for a delay.

    The sign of the velocity is told from the way of 1/smoothed of a push to both sides.
    """
    signs = speed_sign(record.positions, max(1, record.span // smoothed))
    # Held at sample k is what was commanded d samples before.
    held = np.concatenate([np.zeros(delay), record.forces[: len(record.forces) - delay]])
    edges = np.linspace(LONGEST_DELAY, len(held), STRETCHES + 3).astype(int)
    # The ends of the record have no velocity to both sides.
    parts = [slice(a, b) for a, b in pairwise(edges[1:-1])]
    return [_equations(record.positions[part], held[part], signs[part], period) for part in parts]


def _equations(
    positions: FloatArray, held: FloatArray, signs: FloatArray, period: float
) -> Equations:
    """Return the sums over a stretch.

    What a₀ + a₁ t + a₂ t² can be is taken from both: nothing of it is looked for.
    """
    moved = positions - positions[0]
    once = period * np.concatenate([[0.0], np.cumsum(0.5 * (moved[1:] + moved[:-1]))])
    rubbed = twice_integrated(0.5 * (signs + np.append(signs[1:], signs[-1])), period)
    given = twice_integrated(held, period)
    basis = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, len(moved)), 3))[0]
    table = np.column_stack([moved, once, rubbed, given])
    table -= basis @ (basis.T @ table)
    return np.asarray(table.T @ table)


def _fit(parts: Sequence[Equations]) -> tuple[FloatArray, float]:
    """Return mass, damping and friction of stretches (3,), and what is left, squared [m²]."""
    square = np.sum(parts, axis=0)
    size = np.sqrt(np.diag(square))
    size[size == 0.0] = 1.0
    scaled = square / np.outer(size, size)
    kept, answer = [0, 1, 2], np.full(3, -1.0)
    while kept and answer.min() < 0.0:
        answer = np.zeros(3)
        answer[kept] = np.linalg.lstsq(scaled[np.ix_(kept, kept)], scaled[kept, 3], rcond=None)[0]
        # None of them is negative: what comes out so is none.
        kept = [i for i in kept if i != int(np.argmin(answer))] if answer.min() < 0.0 else kept
    left = float(scaled[3, 3] - answer @ scaled[:3, 3]) * float(size[3]) ** 2
    whole = answer * size[3] / size[:3]
    # In metres: the fit of a light handle is not better because it is light.
    return whole, max(left, 0.0) / max(float(whole[0]) ** 2, 1e-12)


def _motion(record: Pushes, parts: Sequence[Equations], delay: int, period: float) -> Motion:
    """Return what moves, with its uncertainty.

    By chance: the jackknife's, the scatter without each stretch, or that of the least squares if
    that is greater, since damping and friction can hardly be told apart where every push is alike.
    By the fit: what changes when the sign of the velocity is told from twice the way.
    """
    whole, error = _fit(parts)
    count = len(parts)
    others = np.array([_fit([*parts[:i], *parts[i + 1 :]])[0] for i in range(count)])
    spread = np.sqrt((count - 1) ** 2 / count * others.var(axis=0, ddof=1))
    square = np.sum(parts, axis=0)[:3, :3]
    size = np.sqrt(np.diag(square))
    size[size == 0.0] = 1.0
    inverse = np.linalg.pinv(square / np.outer(size, size)) / np.outer(size, size)
    formal = float(whole[0]) * np.sqrt(error / len(record.positions) * np.abs(np.diag(inverse)))
    smoother, _error = _fit(_stretches(record, delay, period, _SMOOTHED // 2))
    unsure = np.hypot(np.maximum(spread, formal), whole - smoother)
    pairs = zip(whole, unsure, strict=True)
    return Motion(*(Estimate(float(value), float(around)) for value, around in pairs))
