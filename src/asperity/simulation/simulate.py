"""Simulation of texture, device and hand in a closed loop: one run, or several in parallel."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.contacts.warm_start import MAX_ERROR_BOUND, TRUNCATED_TICKS
from asperity.core.arguments import check_integer
from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
from asperity.core.files import to_plain_data
from asperity.core.processes import available_cores
from asperity.loop.simulated_device import FIRST_SAMPLE
from asperity.recording.recorded_field import field_attachments, field_metadata
from asperity.recording.writer import RecordingWriter
from asperity.simulation.hands import Hand, Motion
from asperity.simulation.lanes import (
    CHUNK_SAMPLES,
    NO_ROWS,
    Lane,
    LaneLoop,
    anchor_points,
    check_parts,
    initial_motion,
)
from asperity.simulation.plants import Plant, SampledPlant, sampled_plant
from asperity.simulation.servo import Servo
from asperity.simulation.trace import (
    COLUMNS,
    DecimatedTrace,
    Ledger,
    Run,
    RunCounts,
    StopReason,
    TailStatistics,
    TraceWriter,
)
from asperity.surface import Surface


class Simulation(Lane):
    """A surface on a body with a servo, run chunk by chunk: a single lane, with its ledger.

    Args:
        surface: the surface, rendered at its stiffness.
        plant: the device and the hand that holds it.
        servo: the servo.
        start: position [m], shape (3,).
        velocity: [m/s], shape (3,).

    Raises:
        ParameterError: for a delay of more than ``MAX_DELAY`` samples.
    """

    def __init__(
        self,
        surface: Surface,
        plant: SampledPlant,
        servo: Servo,
        start: FloatArray,
        velocity: FloatArray,
    ) -> None:
        state = plant.initial_state(start, velocity)
        max_evaluations = surface.law.contact.max_evaluations
        super().__init__(state, servo.delay, surface.stiffness, max_evaluations)
        self._loop = LaneLoop(surface, plant, servo)
        self._energy_at_start = 0.0

    def run(self, anchor: FloatArray, trace: FloatArray = NO_ROWS) -> StopReason:
        """Run one sample for each row of the anchor's motion but the last.

        Args:
            anchor: positions of the hand's anchor at the samples [m], shape (k + 1, 3), contiguous;
                it moves at constant velocity in between. The first row is its current position.
            trace: rows to write, shape (at least k, columns); none by default.

        Returns:
            Why the run stopped before the end.
        """
        first = self.samples
        if first == 0:
            self._energy_at_start = self._loop.stored_energy(self.state, anchor[0])
        self.counters[FIRST_SAMPLE] = first
        self.rows_written = self._loop.run([self], len(anchor) - 1, anchor, trace)
        self._anchor = anchor[self.samples - first].copy()
        return self.stop

    @property
    def search_truncation(self) -> tuple[int, float]:
        """Number of truncated searches, and their largest error bound [m]."""
        return int(self.memory[TRUNCATED_TICKS]), float(self.memory[MAX_ERROR_BOUND])

    def ledger(self) -> Ledger:
        """Return the energies since the start."""
        end = self._loop.stored_energy(self.state, self._anchor)
        return Ledger.from_sums(self.ledger_sums, self._energy_at_start, end)


# Largest number of samples of a run: a day of computing and more.
MAX_SAMPLES = 10**12


def _check_every(every: object) -> int:
    """Return a number of samples per row.

    Raises:
        ParameterError: unless it is a whole number, 1 or more.
    """
    if isinstance(every, bool) or not isinstance(every, (int, np.integer)) or every < 1:
        raise ParameterError("every", "must be a whole number of samples, 1 or more", every)
    return int(every)


def simulate(
    surface: Surface,
    plant: Plant,
    hand: Hand,
    servo: Servo,
    motion: Motion,
    duration: float,
    *,
    start: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    trace: bool | str | os.PathLike[str] = True,
    every: int = 1,
    max_rows: int | None = None,
    progress: Callable[[float], None] | None = None,
    metadata: Mapping[str, Any] | None = None,
) -> Run:
    """Simulate a hand that explores a surface on a device.

    At every sample the servo reads the position, computes the force, delays it, and holds it while
    plant and hand move on.

    Args:
        surface: the surface, rendered at its stiffness.
        plant: the device.
        hand: the hand that holds it.
        servo: the electronics of the device.
        motion: motion of the hand's anchor, at constant velocity between samples.
        duration: [s]; rounded to whole samples.
        start: initial position of the handle [m], shape (3,); default: where the motion starts.
        velocity: initial velocity of the handle [m/s], shape (3,); default: at rest.
        trace: whether to store the trace in memory, or the path of its file: a recording (.mcap),
            which :func:`~asperity.recording.table_export.export_recording` writes as a table. Rows
            are written as they come, so memory does not depend on the duration.
        every: samples per row of the trace; statistics and counts use every sample.
        max_rows: largest number of rows in memory, decimated evenly; by default all rows, so that
            memory grows with the duration.
        progress: called with the completed fraction, in [0, 1].
        metadata: metadata of a recording besides surface, servo and hand; plain data.

    Returns:
        The run; its ledger covers every sample, traced or not.

    Raises:
        ParameterError: for parts that do not fit together, or a trace file that cannot be written
            (what was written stays, in whole blocks).

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> from asperity.simulation import Cartesian, Servo, SpringHand, Stationary
        >>> surface = Surface(Sinusoid(amplitude=0.4e-3, period=1e-3), "W", stiffness=500.0)
        >>> hand = SpringHand(stiffness=200.0, damping=2.0)
        >>> run = simulate(
        ...     surface, Cartesian(0.05), hand, Servo(1e-4), Stationary((0.0, 0.0, -1e-3)), 2.0
        ... )
        >>> run.samples, run.stop_message, round(1e3 * float(run.state[2]), 6)
        (20000, '', -0.285714)
    """
    check_parts(surface, plant, hand, servo, motion)
    samples = count_samples(check_positive("duration", duration, "s"), servo.period)
    every = min(_check_every(every), samples)
    position, speed = initial_motion(plant, hand, servo, motion, start, velocity)
    simulation = Simulation(surface, sampled_plant(plant, hand, servo), servo, position, speed)

    def anchor_chunk(first: int) -> FloatArray:
        last = min(first + CHUNK_SAMPLES, samples)
        return anchor_points(motion, servo.period, plant, first, last)

    def recording_metadata() -> dict[str, Any]:
        parts = {"servo": servo, "plant": plant, "hand": hand, "motion": motion}
        data = {name: to_plain_data(part) for name, part in parts.items()}
        origin = {"made_by": "simulate", "surface": field_metadata(surface)}
        return {**origin, **data, "every": every, **(metadata or {})}

    rows = math.ceil(samples / every)
    writer = _open_trace(trace, rows, max_rows, recording_metadata, surface)
    tail = None
    counts = RunCounts(surface, servo)
    if trace is not False:
        tail = TailStatistics(samples)
    try:
        stop = _run_chunks(simulation, anchor_chunk, samples, writer, tail, counts, every, progress)
    finally:
        writer.close()
    stop_location = ""
    if stop is StopReason.LEFT_WORKSPACE:
        stop_location = plant.describe_exit(simulation.state)
    path = "" if isinstance(trace, bool) else os.fspath(trace)
    truncated, error = simulation.search_truncation
    return Run(
        writer.table if isinstance(writer, DecimatedTrace) else NO_ROWS,
        simulation.state,
        simulation.samples,
        float(servo.period),
        simulation.ledger(),
        surface,
        stop,
        stop_location,
        path,
        tail,
        plant.notes,
        truncated,
        error,
        *counts.totals,
    )


def simulate_many(jobs: Sequence[Mapping[str, Any]], workers: int | None = None) -> list[Run]:
    """Run several simulations in parallel.

    Args:
        jobs: the arguments of :func:`simulate`, by name, of each run.
        workers: number of threads; default: the number of processors.

    Returns:
        The runs, in the order of the jobs.

    Raises:
        ParameterError: for a job that cannot be run, see :func:`simulate`.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> from asperity.simulation import Cartesian, Servo, SpringHand, Stationary
        >>> surface = Surface(Sinusoid(amplitude=0.4e-3, period=1e-3), "W", stiffness=500.0)
        >>> job = dict(
        ...     surface=surface, plant=Cartesian(0.05), hand=SpringHand(stiffness=200.0),
        ...     servo=Servo(1e-4), motion=Stationary((0.0, 0.0, -1e-3)), duration=0.1, trace=False,
        ... )
        >>> [run.samples for run in simulate_many([job, job])]
        [1000, 1000]
    """
    if workers is None:
        workers = available_cores()
    with ThreadPoolExecutor(check_integer("workers", workers, 1)) as pool:
        return list(pool.map(lambda job: simulate(**job), jobs))


def count_samples(duration: float, period: float) -> int:
    """Return the number of samples of a duration [s].

    Raises:
        ParameterError: for a duration of no sample, or of too many.
    """
    if not duration / period <= MAX_SAMPLES:
        raise ParameterError(
            "duration", f"must be at most {MAX_SAMPLES:g} samples of {period:g} s", duration
        )
    samples = round(duration / period)
    if samples < 1:
        raise ParameterError("duration", f"must be at least one period, {period} s", duration)
    return samples


def _open_trace(
    trace: bool | str | os.PathLike[str],
    rows: int,
    max_rows: int | None,
    metadata: Callable[[], dict[str, Any]],
    surface: Surface,
) -> TraceWriter:
    if isinstance(trace, bool):
        if max_rows is not None:
            max_rows = check_integer("max_rows", max_rows)
        if not trace or max_rows == 0:
            rows = 0
        return DecimatedTrace(rows, max_rows)
    if not isinstance(trace, (str, os.PathLike)):
        raise ParameterError("trace", "must be True, False or a path", trace)
    if Path(trace).suffix.lower() not in (".mcap", ""):
        raise ParameterError(
            "trace", "must end in .mcap; such a recording can be exported as .csv", os.fspath(trace)
        )
    return RecordingWriter(trace, COLUMNS, metadata(), field_attachments(surface), "trace")


def _run_chunks(
    simulation: Simulation,
    anchor_chunk: Callable[[int], FloatArray],
    samples: int,
    trace: TraceWriter,
    tail: TailStatistics | None,
    counts: RunCounts,
    every: int,
    progress: Callable[[float], None] | None,
) -> StopReason:
    buffer = np.empty((CHUNK_SAMPLES, len(COLUMNS)))
    while simulation.samples < samples:
        first = simulation.samples
        stop = simulation.run(anchor_chunk(first), buffer)
        rows = buffer[: simulation.rows_written]
        counts.update(rows)
        if tail is not None:
            trace.append(rows[-first % every :: every])
            tail.update(rows)
        if progress is not None:
            progress(simulation.samples / samples)
        if stop:
            return stop
    return StopReason.NONE
