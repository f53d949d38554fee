"""Identification of a device from the rows of its loop, with uncertainties.

The equation of motion is fitted in a form without velocities:
m p'' = u(t - d T) - b p' - F_c sign p' + c, integrated twice over a segment of time, is

    ∬u = m p + b ∫p + F_c ∬sign p' + a₀ + a₁ t + a₂ t²,

linear in the unknowns. ∬u of a force that is held from sample to sample is exact; a₀, a₁ and a₂
contain initial position, initial velocity and a constant force. The delay is the whole number of
samples with the least sum of squares, with the sign of displacements. That sign is late where the
velocity reverses, and friction then counts as damping: the numbers of the body are therefore fitted
with the sign of the motion that they cause themselves, which is simulated.

Reference:
    Integrating a model instead of differentiating a record: Young, "Parameter estimation for
    continuous-time models: a survey", Automatica 17(1), 1981, section 3.
"""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.optimize import least_squares

from asperity.core.checks import FloatArray
from asperity.core.files import Serializable

MAX_DELAY = 20
"""Largest delay tried [samples]."""
SEGMENTS = 8
"""Number of segments of a record; the scatter of their fits is the uncertainty."""
_MIN_STEP = 1e-10  # [m] smaller steps are rounding errors of a position
_GRID_TOLERANCE = 0.1  # of a step: positions further from its multiples are not on a grid
_SMOOTHING_DIVISOR = 8  # pushes over which the sign of a displacement is taken
_LEAST_START = np.array([1e-3, 1e-2, 1e-3])  # [kg], [N s/m] and [N]
_MAX_EVALUATIONS = 30  # of a fit, besides derivatives
_UNCERTAIN_SHARE = 0.2  # of the change that simulated reversals make
_LEAST_UNCERTAINTY = 1e-3  # relative: no friction acts exactly as it is simulated
_FAST_STEPS = 3.0  # steps per sample of a handle that moves in every fresh reading


NormalEquations = FloatArray
"""Sums of products of the regressors of mass, damping and friction, and of ∬u (4, 4)."""


@dataclass(frozen=True)
class Estimate(Serializable):
    """A measured number.

    Attributes:
        value: in SI units.
        uncertainty: its standard uncertainty, in the same unit.
    """

    value: float
    uncertainty: float


@dataclass(frozen=True)
class AxisDynamics(Serializable):
    """The dynamics along an axis.

    Attributes:
        mass: mass as felt [kg].
        damping: physical damping [N s/m].
        friction: dry friction [N].
    """

    mass: Estimate
    damping: Estimate
    friction: Estimate


@dataclass(frozen=True)
class DelayEstimate(Serializable):
    """The delay between a reading and its force, in whole samples.

    Attributes:
        samples: delay of the best fit of all records together.
        alternatives: delays of the best fits when a part of the records is left out.
    """

    samples: int
    alternatives: tuple[int, ...]


@dataclass(frozen=True)
class PushRecord:
    """A record of a handle that was pushed back and forth along an axis.

    Attributes:
        positions: positions at the samples (n,) [m].
        forces: commanded forces (n,) [N].
        push_samples: mean duration of a push [samples].
    """

    positions: FloatArray
    forces: FloatArray
    push_samples: int


def position_step(positions: FloatArray) -> Estimate | None:
    """Return the step of the positions [m]; ``None`` if they are exact.

    Args:
        positions: positions of a moving handle along an axis (n,) [m].

    The readings of an encoder are multiples of its step, which their differences show far better
    than their scatter. The positions of an arm with joint encoders are not: then the step is the
    median change between readings, provided that the readings repeat in between.

    Example:
        >>> position_step(2e-5 * np.array([0, 1, 3, 2, 5, 5, 4])).value
        2e-05
    """
    apart = np.diff(np.unique(positions))
    apart = apart[apart > _MIN_STEP]
    moves = np.abs(np.diff(positions))
    moves = moves[moves > _MIN_STEP]
    if len(apart) < 2:
        return None
    for part in (1, 2, 3):
        step = float(apart.min()) / part
        counts = np.rint(apart / step)
        step = float(apart @ counts / (counts @ counts))
        rest = np.abs(apart / step - counts)
        if rest.max() < _GRID_TOLERANCE and len(apart) > 2:
            return Estimate(step, step * max(float(rest.std()), 1e-6) / math.sqrt(len(apart)))
    if len(moves) > 0.9 * (len(positions) - 1):
        return None
    return Estimate(float(np.median(moves)), float(np.subtract(*np.percentile(moves, [75, 25]))))


def rest_noise(positions: FloatArray) -> Estimate:
    """Return the standard deviation of readings at rest [m], without drift.

    Args:
        positions: positions along an axis (n,) [m].
    """
    count = len(positions)
    times = np.linspace(-1.0, 1.0, count)
    line = np.polynomial.Polynomial.fit(times, positions, 1)
    spread = float(np.std(positions - line(times)))
    return Estimate(spread, spread / math.sqrt(2.0 * count))


def fresh_fraction(positions: FloatArray, step: float) -> float:
    """Return the share of fresh readings; 1 if it cannot be determined.

    A device that is read more often than it measures repeats a reading between two moves of several
    steps in one direction.

    Args:
        positions: positions of a fast handle along an axis (n,) [m].
        step: step of the positions [m]; 0 for exact ones.
    """
    moves = np.diff(positions)
    changes = np.flatnonzero(np.abs(moves) > _MIN_STEP)
    far = moves[changes] * (np.abs(moves[changes]) > _FAST_STEPS * step)
    on = far[1:] * far[:-1] > 0.0
    return 1.0 / float(np.diff(changes)[on].mean()) if on.any() else 1.0


def integrate_twice(force: FloatArray, period: float) -> FloatArray:
    """Return the double integral of a force held over each sample, at the samples."""
    once = period * np.concatenate([[0.0], np.cumsum(force)[:-1]])
    inner = period * once + 0.5 * period**2 * force
    return np.concatenate([[0.0], np.cumsum(inner)[:-1]])


def velocity_sign(positions: FloatArray, lag: int) -> FloatArray:
    """Return the sign of the velocity, by differences over a number of samples to both sides."""
    padded = np.pad(positions, lag, mode="edge")
    return np.asarray(np.sign(padded[2 * lag :] - padded[: -2 * lag]))


def fit_dynamics(
    records: Sequence[PushRecord], period: float
) -> tuple[DelayEstimate, list[AxisDynamics]]:
    """Return the delay of a device, and the dynamics along each of its axes.

    Args:
        records: one for each axis.
        period: T [s].
    """
    tables = [
        [_segments(record, delay, period) for delay in range(MAX_DELAY + 1)] for record in records
    ]
    whole = np.array([[_fit(parts)[1] for parts in table] for table in tables])
    delay = _best_delay(whole)
    others = set()
    for left_out in range(SEGMENTS):
        errors = np.array(
            [
                [_fit(parts[:left_out] + parts[left_out + 1 :])[1] for parts in table]
                for table in tables
            ]
        )
        others.add(_best_delay(errors))
    motions = [
        _estimate_dynamics(record, table[delay], delay, period)
        for record, table in zip(records, tables, strict=True)
    ]
    return DelayEstimate(delay, tuple(sorted(others - {delay}))), motions


def _best_delay(errors: FloatArray) -> int:
    """Return the delay with the least product of the errors of all axes (axes, delays)."""
    return int(np.argmin(np.log(errors + 1e-300).sum(axis=0)))


def _held_forces(record: PushRecord, delay: int) -> FloatArray:
    """Return the forces held at the samples, which were commanded ``delay`` samples before [N]."""
    return np.concatenate([np.zeros(delay), record.forces])[: len(record.forces)]


def _segment_edges(count: int) -> NDArray[np.int64]:
    """Return where segments begin and end; the ends of a record have no velocity."""
    return np.linspace(MAX_DELAY, count, SEGMENTS + 3).astype(np.int64)[1:-1]


def _segments(record: PushRecord, delay: int, period: float) -> list[NormalEquations]:
    """Return the normal equations of the segments of a record, for a delay.

    The sign of the velocity is that of the displacement over an eighth of a push to both sides.
    """
    signs = velocity_sign(record.positions, max(1, record.push_samples // _SMOOTHING_DIVISOR))
    means = 0.5 * (signs + np.append(signs[1:], signs[-1]))
    tables = _regressors(record.positions, _held_forces(record, delay), means, period)
    return [np.asarray(table.T @ table) for table in tables]


def _regressors(
    positions: FloatArray, held_forces: FloatArray, signs: FloatArray, period: float
) -> list[FloatArray]:
    """Return p, ∫p, ∬sign p' and ∬u of each segment (n, 4), without a₀ + a₁ t + a₂ t².

    Args:
        positions: positions of a record [m].
        held_forces: force held over each of its samples [N].
        signs: mean sign of the velocity over each sample.
        period: T [s].
    """
    tables = []
    for first, last in pairwise(_segment_edges(len(positions))):
        moved = positions[first:last] - positions[first]
        once = period * np.concatenate([[0.0], np.cumsum(0.5 * (moved[1:] + moved[:-1]))])
        rubbed = integrate_twice(signs[first:last], period)
        given = integrate_twice(held_forces[first:last], period)
        basis = np.linalg.qr(np.vander(np.linspace(-1.0, 1.0, len(moved)), 3))[0]
        table = np.column_stack([moved, once, rubbed, given])
        tables.append(table - basis @ (basis.T @ table))
    return tables


def _fit(segments: Sequence[NormalEquations]) -> tuple[FloatArray, float]:
    """Return mass, damping and friction of segments (3,), and the squared residual [m²]."""
    square = np.sum(segments, axis=0)
    size = np.sqrt(np.diag(square))
    size[size == 0.0] = 1.0
    scaled = square / np.outer(size, size)
    active = [0, 1, 2]
    answer = np.full(3, -1.0)
    while active and answer.min() < 0.0:
        answer = np.zeros(3)
        square_part = scaled[np.ix_(active, active)]
        answer[active] = np.linalg.lstsq(square_part, scaled[active, 3], rcond=None)[0]
        if answer.min() < 0.0:  # a negative number is not physical: zero in its place
            active.remove(int(np.argmin(answer)))
    left = float(scaled[3, 3] - answer @ scaled[:3, 3]) * float(size[3]) ** 2
    whole = answer * size[3] / size[:3]
    # In metres, so that the residual does not depend on the mass.
    return whole, max(left, 0.0) / max(float(whole[0]) ** 2, 1e-12)


def simulated_signs(
    held_forces: FloatArray, mass: float, damping: float, friction: float, period: float
) -> FloatArray:
    """Return the mean sign of the velocity over each sample, of a body that starts at rest.

    While it sticks, the sign is the share of the friction that holds it.

    Args:
        held_forces: force held over each sample [N].
        mass: [kg].
        damping: [N s/m].
        friction: dry friction, above zero [N].
        period: T [s].
    """
    gain = period / (mass + 0.5 * damping * period)
    decay = 1.0 - damping * gain
    velocity = 0.0
    signs = []
    for force in held_forces.tolist():
        at_rest = min(max(force / friction, -1.0), 1.0)
        sign = math.copysign(1.0, velocity) if velocity else at_rest
        end = decay * velocity + gain * (force - friction * sign)
        if end * velocity < 0.0:  # it reverses, or stops, within the sample
            before = velocity / (velocity - end)
            sign = before * sign + (1.0 - before) * at_rest
            end = (1.0 - before) * gain * (force - friction * at_rest)
        signs.append(sign)
        velocity = end
    return np.array(signs)


def _estimate_dynamics(
    record: PushRecord, segments: Sequence[NormalEquations], delay: int, period: float
) -> AxisDynamics:
    """Return the dynamics of a record, with uncertainties.

    The systematic part is a share of the change that simulated reversals make, and of the value.
    """
    first = _fit(segments)[0]
    start = np.maximum(first, _LEAST_START)
    values, random = _fit_simulated(record, _held_forces(record, delay), start, period)
    model = np.hypot(_UNCERTAIN_SHARE * (values - first), _LEAST_UNCERTAINTY * values)
    uncertainty = np.hypot(random, model)
    pairs = zip(values.tolist(), uncertainty.tolist(), strict=True)
    return AxisDynamics(*(Estimate(value, sigma) for value, sigma in pairs))


def _fit_simulated(
    record: PushRecord, held_forces: FloatArray, start: FloatArray, period: float
) -> tuple[FloatArray, FloatArray]:
    """Return mass, damping and friction that fit with simulated signs, and their random part.

    It contains the uncertainty of the least squares and the scatter over the segments.
    """

    def residuals(numbers: FloatArray) -> FloatArray:
        mass, damping, friction = map(float, numbers)
        signs = simulated_signs(held_forces, mass, damping, friction, period)
        table = np.concatenate(_regressors(record.positions, held_forces, signs, period))
        # In metres, since it is the positions that have steps and noise.
        return np.asarray(table @ np.array([-mass, -damping, -friction, 1.0]) / mass)

    found = least_squares(
        residuals,
        start,
        bounds=(1e-6 * start, math.inf),
        x_scale=start,
        diff_step=np.full(3, 1e-3),
        ftol=1e-7,
        xtol=1e-5,
        max_nfev=_MAX_EVALUATIONS,
    )
    slopes = np.asarray(found.jac, dtype=np.float64) * start
    inverse = np.linalg.pinv(slopes.T @ slopes)
    edges = _segment_edges(len(held_forces))
    gradients = np.add.reduceat(slopes * found.fun[:, np.newaxis], edges[:-1] - edges[0])
    scatter = np.square(gradients @ inverse).sum(axis=0) * SEGMENTS / (SEGMENTS - 1)
    formal = np.diag(inverse) * np.square(found.fun).mean()
    return found.x, start * np.sqrt(scatter + formal)


STIFFNESS_FACTOR = 1.3
"""Factor between stiffnesses until a wall cycles."""
BRACKET_RATIO = 1.03
"""Ratio of the bracket at which the bisection ends."""
MIN_STIFFNESS = 50.0
MAX_STIFFNESS = 50e3
"""Range of the search [N/m]."""
STEADY_RATIO = 0.99
"""Ratio of the amplitudes of two halves above which an oscillation persists."""
FLOOR_STEPS = 3.0
"""Multiple of step and noise below which an oscillation is that of the device itself."""


@dataclass(frozen=True)
class WallOnset(Serializable):
    """The walls that held along an axis.

    Attributes:
        stable_stiffness: largest stiffness below ``cycling_stiffness`` that held [N/m]; 0 if the
            lowest one cycled already.
        cycling_stiffness: least stiffness that cycled [N/m]; ``None`` if none did.
        trials: number of walls tried.
    """

    stable_stiffness: float
    cycling_stiffness: float | None
    trials: int


def oscillation_amplitudes(
    positions: FloatArray, period: float, frequency: float
) -> tuple[float, float]:
    """Return the amplitudes of an oscillation in the two halves of a record [m].

    Each is the product with a wave at the frequency of the highest peak of the spectrum, between a
    third and three times the expected one, in a Hann window, which suppresses steps and noise.

    Args:
        positions: positions (n,) [m].
        period: T [s].
        frequency: expected frequency [Hz].
    """
    count = len(positions)
    centred = positions - positions.mean()
    spectrum = np.abs(np.fft.rfft(centred * np.hanning(count), 8 * count))
    frequencies = np.fft.rfftfreq(8 * count, period)
    near = (frequencies > frequency / 3.0) & (frequencies < 3.0 * frequency)
    peak = frequencies[near][np.argmax(spectrum[near])] if near.any() else frequency
    half = count // 2
    window = np.hanning(half)
    wave = window * np.exp(-2j * math.pi * peak * period * np.arange(half))
    first, last = (
        2.0 * abs(np.dot(part - part.mean(), wave)) / window.sum()
        for part in (centred[:half], centred[-half:])
    )
    return float(first), float(last)


def is_limit_cycle(first: float, last: float, floor: float) -> bool:
    """Return whether an oscillation persists, above the floor of steps and noise [m].

    Args:
        first: amplitude in the first half of the time [m].
        last: amplitude in the second half [m].
        floor: least amplitude [m].
    """
    return last > floor and last >= STEADY_RATIO * first


def find_wall_onset(
    cycles: Callable[[float], bool], highest: float, lowest: float = MIN_STIFFNESS
) -> WallOnset:
    """Find the stiffest wall that holds: upwards from the lowest, then by bisection.

    Args:
        cycles: whether a wall of a stiffness [N/m] keeps cycling.
        highest: largest stiffness tried [N/m].
        lowest: least stiffness tried [N/m].
    """
    stable = 0.0
    cycling = math.inf
    trials = 0
    stiffness = lowest
    while math.isinf(cycling) and stiffness <= highest:
        trials += 1
        if cycles(stiffness):
            cycling = stiffness
        else:
            stable = stiffness
            stiffness = stiffness * STIFFNESS_FACTOR
    while stable > 0.0 and math.isfinite(cycling) and cycling > BRACKET_RATIO * stable:
        trials += 1
        middle = math.sqrt(stable * cycling)
        if cycles(middle):
            cycling = middle
        else:
            stable = middle
    return WallOnset(stable, cycling if math.isfinite(cycling) else None, trials)
