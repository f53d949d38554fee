"""Simulation of texture, device and hand in a closed loop: one run, or several in parallel."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import cached_property
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.contacts.warm_start import MAX_ERROR_BOUND, TRUNCATED_TICKS, new_warm_start
from asperity.core.arguments import check_integer
from asperity.core.checks import FloatArray, check_array, check_positive
from asperity.core.errors import ParameterError
from asperity.core.files import to_plain_data
from asperity.core.processes import available_cores
from asperity.kernels import tick
from asperity.kernels.fuse import fuse_on_texture
from asperity.loop import no_guards, servo_loop
from asperity.loop.interface import LoopState
from asperity.recording.recorded_field import field_attachments, field_metadata
from asperity.recording.writer import RecordingWriter
from asperity.simulation.hands import Hand, Motion
from asperity.simulation.kernels import energy_trace, simulated_device
from asperity.simulation.kernels.body_interface import LEFT_WORKSPACE
from asperity.simulation.kernels.body_parts import LEDGER_SIZE
from asperity.simulation.kernels.energy_trace import TraceRows
from asperity.simulation.kernels.simulated_device import SimulatedDevice
from asperity.simulation.plants import Plant, SampledPlant, sampled_plant
from asperity.simulation.servo import Servo
from asperity.simulation.trace import (
    COLUMNS,
    DecimatedTrace,
    Ledger,
    Run,
    StopReason,
    TailStatistics,
    TraceWriter,
)
from asperity.surface import Surface

# Why the compiled loop stops, by its error code.
STOP_REASONS = tuple(StopReason)
# Largest delay [samples]: a second at a megahertz.
MAX_DELAY = 1_000_000


def check_delay(delay: int) -> int:
    """Return a delay [samples].

    Raises:
        ParameterError: for a delay of more than ``MAX_DELAY``.
    """
    if delay > MAX_DELAY:
        raise ParameterError("delay", f"must be at most {MAX_DELAY} samples", delay)
    return delay


class Simulation:
    """A surface on a body with a servo, run chunk by chunk.

    Args:
        surface: the surface, rendered at its stiffness.
        plant: the device and the hand that holds it.
        servo: the servo.
        start: position [m], shape (3,).
        velocity: [m/s], shape (3,); default: at rest.
        max_evaluations: evaluation budget of a tick in its search for closest points; default: that
            of the law's contact. A larger budget takes longer, and truncates fewer searches.

    Attributes:
        memory: warm start of that search, see :mod:`asperity.contacts.warm_start`.
        ledger_sums: sums of the ledger since the start, see ``kernels/body_parts.py``.
        samples: samples done.

    Raises:
        ParameterError: for a delay of more than ``MAX_DELAY`` samples.
    """

    def __init__(
        self, surface: Surface, plant: SampledPlant, servo: Servo, start: FloatArray,
        velocity: FloatArray | None = None, max_evaluations: float | None = None,
    ) -> None:  # fmt: skip
        self._plant = plant
        self._servo = servo
        self._surface = surface
        self.state = plant.initial_state(start, np.zeros(3) if velocity is None else velocity)
        self.queue = np.zeros((check_delay(servo.delay) + 1, 3))
        budget = surface.law.contact.max_evaluations
        self.memory = new_warm_start(budget if max_evaluations is None else max_evaluations)
        self.samples = 0
        self._counters = np.zeros(3, np.int64)
        self._loop_state = LoopState()
        self.ledger_sums = np.zeros(LEDGER_SIZE)
        self._energy_at_start = 0.0

    @cached_property
    def _kernels(self) -> ModuleType:
        surface = self._surface
        parts = servo_loop, energy_trace, no_guards, simulated_device
        return fuse_on_texture(
            surface.law, surface.texture.sampler, surface.effective_clamp,
            (*parts, *self._plant.modules, tick),
        )  # fmt: skip

    def stored_energy(self, anchor: FloatArray) -> float:
        """Return the stored energy [J] with the hand's anchor at a position [m]."""
        return float(self._kernels.stored_energy_at(self.state, anchor, self._plant.record))

    def run(
        self, anchor: FloatArray, trace: FloatArray | None = None, every: int = 1
    ) -> StopReason:
        """Run one sample for each row of the anchor's motion but the last.

        Args:
            anchor: positions of the hand's anchor at the samples [m], shape (k + 1, 3), contiguous;
                it moves at constant velocity in between. The first row is its current position.
            trace: rows to write, shape (at least k/every + 1, columns); none for no trace.
            every: samples per row.

        Returns:
            Why the run stopped before the end.

        Raises:
            ParameterError: for a trace whose rows have another length.
        """
        if self.samples == 0:
            self._energy_at_start = self.stored_energy(anchor[0])
        table = np.empty((0, len(COLUMNS))) if trace is None else trace
        if table.ndim != 2 or table.shape[1] != len(COLUMNS):
            words = f"must have rows of {len(COLUMNS)} numbers, got shape {table.shape}"
            raise ParameterError("trace", words)
        first = self.samples
        surface = self._surface
        self._counters[2] = first
        device = SimulatedDevice(
            self.state, self.queue, self._counters, anchor, self.ledger_sums,
            1.0 / self._servo.period, self._plant.record,
        )  # fmt: skip
        rows = TraceRows(table, np.array([0, -first % every]), every)
        _cause, stop, self._loop_state = self._kernels.servo_loop(
            self._loop_state, first + len(anchor) - 1, self._servo.settings, (), (), device, rows,
            self.memory, surface.texture.arguments, surface.law_arguments,
        )  # fmt: skip
        self.rows_written = int(rows.counters[0])
        # The sample in which a body leaves its workspace is not done.
        self.samples = self._loop_state.timing.sample - (stop == LEFT_WORKSPACE)
        self._anchor = anchor[self.samples - first].copy()
        return STOP_REASONS[int(stop)]

    @property
    def search_truncation(self) -> tuple[int, float]:
        """Number of truncated searches, and their largest error bound [m]."""
        return int(self.memory[TRUNCATED_TICKS]), float(self.memory[MAX_ERROR_BOUND])

    def ledger(self) -> Ledger:
        """Return the energies since the start."""
        end = self.stored_energy(self._anchor)
        return Ledger.from_sums(self.ledger_sums, self._energy_at_start, end)


# Samples per chunk: memory does not depend on the duration, and progress is reported in between.
CHUNK_SAMPLES = 16_384
# Largest number of samples of a run: a day of computing and more.
MAX_SAMPLES = 10**12


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
        every: samples per row of the trace.
        max_rows: largest number of rows in memory, decimated evenly; by default all rows, so that
            memory grows with the duration. Tail statistics always use all rows.
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
    if isinstance(every, bool) or not isinstance(every, (int, np.integer)) or every < 1:
        raise ParameterError("every", "must be a whole number of samples, 1 or more", every)
    every = min(int(every), samples)
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

    rows = -(-samples // every)
    writer = _open_trace(trace, rows, max_rows, recording_metadata, surface)
    tail = None if trace is False else TailStatistics(rows)
    try:
        stop = _run_chunks(simulation, anchor_chunk, samples, writer, tail, every, progress)
    finally:
        writer.close()
    truncated, error = simulation.search_truncation
    left = stop is StopReason.LEFT_WORKSPACE
    table = writer.table if isinstance(writer, DecimatedTrace) else np.empty((0, len(COLUMNS)))
    return Run(
        table, simulation.state, simulation.samples, float(servo.period),
        simulation.ledger(), surface, stop, plant.describe_exit(simulation.state) if left else "",
        path="" if isinstance(trace, bool) else os.fspath(trace),
        tail=tail, notes=plant.notes, truncated_ticks=truncated, search_error=error,
    )  # fmt: skip


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
    count = available_cores() if workers is None else check_integer("workers", workers, 1)
    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(lambda job: simulate(**job), jobs))


def check_parts(surface: Surface, plant: Plant, hand: Hand, servo: Servo, motion: Motion) -> None:
    """Check the types of the parts of a closed loop.

    Raises:
        ParameterError: for the first part of another type.
    """
    for name, value, kind, words in (
        ("surface", surface, Surface, "a Surface"),
        ("plant", plant, Plant, "a plant such as Cartesian or Pantograph"),
        ("hand", hand, Hand, "a hand such as SpringHand, BandHand or PrescribedHand"),
        ("servo", servo, Servo, "a Servo"),
        ("motion", motion, Motion, "a motion such as Stationary, Strokes or Waypoints"),
    ):
        if not isinstance(value, kind):
            raise ParameterError(name, f"must be {words}", value)


def count_samples(duration: float, period: float) -> int:
    """Return the number of samples of a duration [s].

    Raises:
        ParameterError: for a duration of no sample, or of too many.
    """
    if not duration / period <= MAX_SAMPLES:
        limit = f"must be at most {MAX_SAMPLES:g} samples of {period:g} s"
        raise ParameterError("duration", limit, duration)
    samples = round(duration / period)
    if samples < 1:
        raise ParameterError("duration", f"must be at least one period, {period} s", duration)
    return samples


def initial_motion(
    plant: Plant, hand: Hand, servo: Servo, motion: Motion,
    start: ArrayLike | None, velocity: ArrayLike | None,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Return the initial position [m] and velocity [m/s] of a handle; see :func:`simulate`.

    Raises:
        ParameterError: for an initial state that the hand or the plant does not allow.
    """
    position = None if start is None else check_array("start", start, (3,), "m")
    speed = None if velocity is None else check_array("velocity", velocity, (3,), "m/s")
    position, speed = hand.initial_motion(motion, position, speed, servo.period)
    plant.check_points("start", position)
    plant.check_points("velocity", speed)
    reason = "" if hand.is_prescribed else plant.workspace_violation(position)
    if reason:
        raise ParameterError("start", f"must be in the workspace: {reason}", position.tolist())
    return position, speed


def anchor_points(motion: Motion, period: float, plant: Plant, first: int, last: int) -> FloatArray:
    """Return the positions of the anchor [m] at the samples from ``first`` to ``last``, included.

    Raises:
        ParameterError: for a motion that is not finite, or that the plant does not allow.
    """
    times = np.arange(first, last + 1, dtype=np.float64) * float(period)
    points = check_array("motion", motion.at(times), (last + 1 - first, 3), "m")
    plant.check_points("motion", points)
    return points


def _open_trace(
    trace: bool | str | os.PathLike[str], rows: int, max_rows: int | None,
    metadata: Callable[[], dict[str, Any]], surface: Surface,
) -> TraceWriter:  # fmt: skip
    if isinstance(trace, bool):
        most = None if max_rows is None or not trace else check_integer("max_rows", max_rows)
        return DecimatedTrace(rows if trace else 0, most)
    if not isinstance(trace, (str, os.PathLike)):
        raise ParameterError("trace", "must be True, False or a path", trace)
    if Path(trace).suffix.lower() not in (".mcap", ""):
        words = "must end in .mcap; such a recording can be exported as .csv"
        raise ParameterError("trace", words, os.fspath(trace))
    return RecordingWriter(trace, COLUMNS, metadata(), field_attachments(surface), "trace")


def _run_chunks(
    simulation: Simulation, anchor_chunk: Callable[[int], FloatArray], samples: int,
    trace: TraceWriter, tail: TailStatistics | None, every: int,
    progress: Callable[[float], None] | None,
) -> StopReason:  # fmt: skip
    buffer = None if tail is None else np.empty((CHUNK_SAMPLES // every + 1, len(COLUMNS)))
    while simulation.samples < samples:
        stop = simulation.run(anchor_chunk(simulation.samples), buffer, every)
        if tail is not None and buffer is not None:
            rows = buffer[: simulation.rows_written]
            trace.append(rows)
            tail.update(rows)
        if progress is not None:
            progress(simulation.samples / samples)
        if stop:
            return stop
    return StopReason.NONE
