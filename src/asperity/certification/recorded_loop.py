"""What a recording of a loop shows: energy, gain, stiffness, limit cycles, late samples.

Nothing can be tried on a recording; everything in it is accounted for. The force of a servo loop is
held between samples, so the work on the hand in sample i is f_i · (p_{i+1} − p_i), which is the
trapezoidal work less ½ Δf·Δp (docs/theory/black_box.md).
"""

from __future__ import annotations

import csv
import math
import re
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.files import Serializable, open_input
from asperity.core.units import parse_quantity
from asperity.recording.recorded_field import LimitCounts
from asperity.recording.recording import is_recording, open_recording
from asperity.recording.replay import omitted_delay, recorded_limits, rounded_step

MAX_LAG = 3
_MAX_BYTES = 2**31
_AXES = "xyz"
_HEADING = re.compile(r"\s*(.+?)\s*[\[(]\s*(.*?)\s*[\])]\s*")
_NAMES = ("t", "x", "y", "z", "fx", "fy", "fz")
_UNITS = ("s", "m", "m", "m", "N", "N", "N")
_LATE = 1.5
_WINDOWS = 8
_CYCLE_STEPS = 3.0
"""Amplitude of a limit cycle in steps of the encoder, at least."""


@dataclass(frozen=True, eq=False)
class RecordedSamples:
    """Samples of a loop.

    Attributes:
        name: of the file.
        times: [s], shape (n,).
        positions: [m], shape (n, 3).
        forces: [N], shape (n, 3), held from each sample to the next.
        limits: samples at the force limit and below ``max_depth``; ``None`` where these are not
            known.
        position_resolution: step to which the loop rounded positions that are recorded exactly [m].
        measured_energy: work on the hand that the loop measured in such steps [J], or ``None``.
        is_moved: whether the hand followed a prescribed motion.
    """

    name: str
    times: FloatArray
    positions: FloatArray
    forces: FloatArray
    limits: LimitCounts | None = None
    position_resolution: float = 0.0
    measured_energy: float | None = None
    is_moved: bool = False


@dataclass(frozen=True)
class LimitCycle(Serializable):
    """A sustained oscillation.

    Attributes:
        axis: ``"x"``, ``"y"`` or ``"z"``.
        frequency: [Hz].
        amplitude: of the position [m].
        since: time after which it does not end any more [s].
        is_moved: whether the hand followed a prescribed motion, which may be the oscillation.
    """

    axis: str
    frequency: float
    amplitude: float
    since: float
    is_moved: bool


@dataclass(frozen=True, eq=False)
class RecordedCertification(Serializable):
    """What a recording shows.

    Attributes:
        name: of the file.
        samples: number of samples.
        duration: [s].
        period: median time between samples [s].
        late_samples: intervals longer than 1.5 periods.
        missing_samples: samples that these intervals lack.
        energy: held-force work on the hand [J].
        trapezoidal_energy: trapezoidal work on the hand [J].
        axis_energies: held-force work along each axis [J].
        measured_energy: held-force work that the loop measured along positions that it rounded [J];
            ``None`` for a loop that rounded none.
        violated_since: first time at which more energy had been given than taken, for good or not
            [s]; ``None`` if never.
        violation: greatest energy given in all up to some time [J].
        violated_at: position at that time [m].
        gain: largest change of force per change of position between neighbours in time, of those
            that moved ten steps of the encoder or more [N/m].
        largest_force: [N].
        largest_force_step: greatest change of force between samples [N].
        stiffness: of the regression of the normal force on the height, in contact [N/m]; NaN
            without contact.
        lag: delay of the force at which this regression fits best [samples].
        position_step: least change of position on each axis [m].
        limit_cycle: a sustained oscillation at the end; ``None`` for none.
        limits: samples at the force limit and below ``max_depth``; ``None`` where these are not
            known.
        energy_trace: held-force work along each axis up to each sample [J], shape (n, 3).
        times: of the samples [s], shape (n,).
    """

    name: str
    samples: int
    duration: float
    period: float
    late_samples: int
    missing_samples: int
    energy: float
    trapezoidal_energy: float
    axis_energies: tuple[float, ...]
    measured_energy: float | None
    violated_since: float | None
    violation: float
    violated_at: tuple[float, ...] | None
    gain: float
    largest_force: float
    largest_force_step: float
    stiffness: float
    lag: int
    position_step: tuple[float, ...]
    limit_cycle: LimitCycle | None
    limits: LimitCounts | None
    energy_trace: FloatArray
    times: FloatArray


def read_samples(path: str | Path) -> RecordedSamples:
    """Return the samples of a recording (MCAP), or of a table (CSV) with units in its headings.

    Raises:
        ParameterError: for a file that cannot be read, without units, with gaps in its rows, or
            whose time runs backwards.
    """
    place = Path(path)
    samples = _read_rows(place) if is_recording(place) else _named_samples(place, _read_csv(place))
    backwards = np.flatnonzero(np.diff(samples.times) <= 0.0)
    if len(backwards):
        number = int(backwards[0]) + 1
        raise ParameterError("recording", f"{place}: time does not increase after row {number}")
    if len(samples.times) < 16:
        rows = len(samples.times)
        raise ParameterError("recording", f"{place} has {rows} rows; 16 are needed")
    return samples


def _named_samples(path: Path, table: FloatArray) -> RecordedSamples:
    """Return the samples of a table of time, position and force, shape (n, 7)."""
    return RecordedSamples(path.name, table[:, 0], table[:, 1:4], table[:, 4:7])


def _read_rows(path: Path) -> RecordedSamples:
    """Return the samples of a recording (MCAP), and what it says of them."""
    recording = open_recording(path)
    names = recording.names
    force = "applied" if "applied x" in names else "commanded"
    columns = ["time", *_AXES, *[f"{force} {axis}" for axis in _AXES]]
    rows = recording.table()
    table = rows[:, [names.index(column) for column in columns if column in names]]
    if table.shape[1] != len(columns):
        raise ParameterError("recording", f"{path} lacks one of the columns {columns}")
    early = omitted_delay(recording)
    table[early:, 4:] = table[: len(table) - early, 4:].copy()
    table[:early, 4:] = 0.0
    resolution = rounded_step(recording)
    measured_energy = None
    if resolution and not early and "supplied" in names and len(rows):
        supplied = names.index("supplied")
        measured_energy = float(rows[-1, supplied] - rows[0, supplied])
    motion = recording.metadata.get("motion")
    return replace(
        _named_samples(path, table),
        limits=recorded_limits(recording),
        position_resolution=resolution,
        measured_energy=measured_energy,
        is_moved=isinstance(motion, dict) and motion.get("kind") != "still",
    )


def _read_csv(path: Path) -> FloatArray:
    """Return time, position and force in SI units, shape (n, 7)."""
    try:
        with open_input(path, _MAX_BYTES) as stream:
            rows = list(csv.reader(stream.read().decode("utf-8-sig").splitlines()))
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise ParameterError("recording", f"{path} cannot be read: {reason}") from None
    headings = rows[0] if rows else []
    order = []
    scales = []
    for name, unit in zip(_NAMES, _UNITS, strict=True):
        index, scale = _find_column(path, headings, name, unit)
        order.append(index)
        scales.append(scale)
    try:
        table = np.array([[float(row[index]) for index in order] for row in rows[1:] if row])
    except (ValueError, IndexError):
        raise ParameterError("recording", f"{path} has a row without seven numbers") from None
    if not np.isfinite(table).all():
        raise ParameterError("recording", f"{path} has numbers that are not finite")
    return np.asarray(table.reshape(-1, len(_NAMES)) * scales)


def _find_column(path: Path, headings: list[str], name: str, unit: str) -> tuple[int, float]:
    """Return the position of a column and the SI value of its unit."""
    names = {name, {"t": "time"}.get(name, f"applied {name[1:]}")}
    for index, heading in enumerate(headings):
        match = _HEADING.fullmatch(heading)
        if match is not None and match[1].lower() in names:
            return index, parse_quantity("recording", f"1 {match[2]}", unit)
    example = "t [s], x [m], y [m], z [m], fx [N], fy [N], fz [N]"
    raise ParameterError(
        "recording", f"{path} has no column {name} with its unit; headings such as {example}"
    )


def certify_recording(samples: RecordedSamples) -> RecordedCertification:
    """Return what the samples of a loop show.

    Reference:
        Campion and Hayward, section V.B and figure 6, for the energies.
    """
    steps = np.diff(samples.positions, axis=0)
    held = samples.forces[:-1] * steps
    middle = 0.5 * (samples.forces[1:] + samples.forces[:-1]) * steps
    energy_trace = np.concatenate([np.zeros((1, 3)), np.cumsum(held, axis=0)])
    total = energy_trace.sum(axis=1)
    greatest = int(np.argmax(total))
    is_violated = total > 1e-12 + 1e-9 * np.abs(total).max()
    intervals = np.diff(samples.times)
    period = float(np.median(intervals))
    late = intervals > _LATE * period
    missing = np.round(intervals[late] / period).astype(int) - 1
    found = _position_steps(steps)
    position_step = tuple([max(step, samples.position_resolution) for step in found])
    stiffness, lag = _contact_stiffness(samples)
    changes = np.sqrt(np.square(np.diff(samples.forces, axis=0)).sum(axis=1))
    lengths = np.sqrt(np.square(steps).sum(axis=1))
    moved = lengths >= 10.0 * math.hypot(*position_step) + 1e-12
    gains = changes[moved] / lengths[moved]
    since = float(samples.times[np.argmax(is_violated)]) if is_violated.any() else None
    place = tuple(samples.positions[greatest].tolist()) if is_violated.any() else None
    return RecordedCertification(
        name=samples.name,
        samples=len(samples.times),
        duration=float(samples.times[-1] - samples.times[0]),
        period=period,
        late_samples=int(late.sum()),
        missing_samples=int(missing.sum()),
        energy=float(total[-1]),
        trapezoidal_energy=float(middle.sum()),
        axis_energies=tuple(energy_trace[-1].tolist()),
        measured_energy=samples.measured_energy,
        violated_since=since,
        violation=max(float(total[greatest]), 0.0),
        violated_at=place,
        gain=float(gains.max(initial=0.0)),
        largest_force=float(np.sqrt(np.square(samples.forces).sum(axis=1)).max()),
        largest_force_step=float(changes.max()),
        stiffness=stiffness,
        lag=lag,
        position_step=position_step,
        limit_cycle=_find_limit_cycle(samples, held, period, position_step),
        limits=samples.limits,
        energy_trace=energy_trace,
        times=samples.times,
    )


def _position_steps(steps: FloatArray) -> tuple[float, ...]:
    """Return the step of the encoder on each axis; 0 where positions are not in steps."""
    found = []
    for column in np.abs(steps.T):
        moved = column[column > 0.0]
        step = float(moved.min(initial=np.inf))
        multiples = moved / step
        is_stepped = len(moved) > 8 and np.abs(multiples - np.round(multiples)).max() < 1e-3
        found.append(step if is_stepped else 0.0)
    return tuple(found)


def _contact_stiffness(samples: RecordedSamples) -> tuple[float, int]:
    """Return the stiffness by regression in contact, and the lag at which it fits best."""
    fits = []
    for lag in range(MAX_LAG + 1):
        forces = samples.forces[lag:, 2]
        heights = samples.positions[: len(forces), 2]
        in_contact = forces > 0.02 * forces.max(initial=0.0)
        if in_contact.sum() < 16 or np.ptp(heights[in_contact]) == 0.0:
            continue
        slope, offset = np.polyfit(heights[in_contact], forces[in_contact], 1)
        rest = forces[in_contact] - slope * heights[in_contact] - offset
        fits.append((float(np.square(rest).mean()), lag, -float(slope)))
    _misfit, lag, stiffness = min(fits, default=(math.inf, 0, math.nan))
    return stiffness, lag


def _find_limit_cycle(
    samples: RecordedSamples, held: FloatArray, period: float, steps: tuple[float, ...]
) -> LimitCycle | None:
    """Return the strongest oscillation that lasts to the end and is fed by the force."""
    from scipy.signal import periodogram

    windows = np.array_split(np.arange(len(held)), _WINDOWS)
    cycles = []
    for axis in range(3):
        amplitudes = []
        for window in windows:
            position = samples.positions[window, axis]
            line = np.polyval(np.polyfit(window, position, 2), window)
            amplitudes.append(math.sqrt(2.0) * float(np.std(position - line)))
        tail = windows[-1]
        amplitude = amplitudes[-1]
        frequency, power = periodogram(samples.positions[tail, axis], 1.0 / period, "hann")
        power[:2] = 0.0
        peak = int(np.argmax(power))
        is_narrow = power[max(peak - 2, 0) : peak + 3].sum() > 0.5 * power.sum()
        is_sustained = min(amplitudes[-2:]) > 0.5 * max(amplitudes[-2:]) and amplitude > 1e-12
        is_fed = held[tail, axis].sum() > 0.0
        if is_narrow and is_sustained and is_fed and amplitude > _CYCLE_STEPS * steps[axis]:
            quiet = np.flatnonzero(np.array(amplitudes) < 0.5 * amplitude)
            first = int(quiet[-1]) + 1 if len(quiet) else 0
            since = float(samples.times[windows[first][0]])
            place = _AXES[axis], float(frequency[peak]), amplitude, since
            cycles.append(LimitCycle(*place, samples.is_moved))
    return max(cycles, key=lambda cycle: cycle.amplitude, default=None)
