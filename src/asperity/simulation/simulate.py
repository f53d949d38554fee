"""Texture, device and hand in one loop: one run, or many at once."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from concurrent.futures import ThreadPoolExecutor
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.arguments import whole
from asperity.checks import FloatArray, array, positive
from asperity.errors import ParameterError
from asperity.files import plain
from asperity.recording.field import describe_field, field_files
from asperity.simulation.ending import Ending
from asperity.simulation.hands import BandHand, Hand, MovedHand, SpringHand
from asperity.simulation.loop import Simulation
from asperity.simulation.motions import Motion
from asperity.simulation.plants import Cartesian, Pantograph, Plant
from asperity.simulation.run import Run, Stop
from asperity.simulation.sampled_plant import LEAST_SINE, sampled_plant
from asperity.simulation.servo import Servo
from asperity.simulation.trace import (
    FileTrace,
    MemoryTrace,
    TextTrace,
    ThinTrace,
    Trace,
    is_text,
)
from asperity.surface import Surface

# Samples at a time: memory does not depend on the duration, progress is told in between.
CHUNK = 16_384
# Samples of a run: a day and more of computing.
MOST_SAMPLES = 10**12


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
    most_rows: int | None = None,
    progress: Callable[[float], None] | None = None,
    about: Mapping[str, Any] | None = None,
) -> Run:
    """Return what happens when a hand explores a surface on a device.

    At every sample the servo reads the position, computes the force, delays it, and holds it while
    plant and hand move on.

    Args:
        surface: the surface; its stiffness is what is rendered.
        plant: the device.
        hand: what holds it.
        servo: its electronics.
        motion: of the hand's anchor; between samples it moves at constant velocity.
        duration: [s]; the nearest whole number of samples is done.
        start: where the handle is at first [m], shape (3,); default: where the motion begins.
        velocity: of the handle at first [m/s], shape (3,); default: at rest.
        trace: whether to keep the trace in memory, or the path of a file for it: a recording
            (.mcap), or a table of text (.csv). Rows are written as they come, so memory does not
            depend on the duration.
        every: samples per row of the trace.
        most_rows: rows that are kept in memory at most, thinned out evenly; by default all, so that
            memory grows with the duration. How the run ends is told from all rows nevertheless.
        progress: is told the part that is done, in [0, 1], now and then.
        about: what a recording is to say of itself besides surface, servo and hand; plain data.

    Returns:
        The run; its ledger covers every sample, traced or not.

    Raises:
        ParameterError: for parts that do not fit together, or a trace file that cannot be written
            (what was written stays, in whole lines or blocks).

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> from asperity.simulation import Cartesian, Servo, SpringHand, Still
        >>> surface = Surface(Sinusoid(amplitude=0.4e-3, period=1e-3), "W", stiffness=500.0)
        >>> hand = SpringHand(stiffness=200.0, damping=2.0)
        >>> run = simulate(
        ...     surface, Cartesian(0.05), hand, Servo(1e-4), Still((0.0, 0.0, -1e-3)), 2.0
        ... )
        >>> run.samples, run.stopped, round(1e3 * float(run.state[2]), 6)
        (20000, '', -0.285714)
    """
    check_parts(surface, plant, hand, servo, motion)
    samples = whole_samples(positive("duration", duration, "s"), servo.period)
    if isinstance(every, bool) or not isinstance(every, (int, np.integer)) or every < 1:
        raise ParameterError("every", "must be a whole number of samples, 1 or more", every)
    every = min(int(every), samples)
    simulation = loop_of(surface, plant, hand, servo, motion, start, velocity)
    anchor_from = partial(_anchor, motion, servo.period, samples, plant)
    rows = -(-samples // every)
    said = partial(_said, surface, plant, hand, servo, motion, every, about or {})
    kept = _trace(trace, rows, most_rows, said, surface)
    ending = None if trace is False else Ending(rows)
    try:
        stop = _go(simulation, anchor_from, samples, kept, ending, every, progress)
    finally:
        kept.close()
    short, gap = simulation.uncertain
    return Run(
        kept.table(), simulation.state, simulation.samples, float(servo.period),
        simulation.ledger(), surface, stop, left_at(stop, simulation.state, plant),
        path="" if isinstance(trace, bool) else os.fspath(trace),
        ending=ending, notes=plant.notes, short=short, gap=gap,
    )  # fmt: skip


def simulate_many(jobs: Sequence[Mapping[str, Any]], workers: int | None = None) -> list[Run]:
    """Return many runs, computed at the same time.

    Args:
        jobs: the arguments of :func:`simulate`, by name, of each run.
        workers: threads; default: as many as there are processors.

    Returns:
        The runs, in the order of the jobs.

    Raises:
        ParameterError: for a job that cannot be run, see :func:`simulate`.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> from asperity.simulation import Cartesian, Servo, SpringHand, Still
        >>> surface = Surface(Sinusoid(amplitude=0.4e-3, period=1e-3), "W", stiffness=500.0)
        >>> job = dict(
        ...     surface=surface, plant=Cartesian(0.05), hand=SpringHand(stiffness=200.0),
        ...     servo=Servo(1e-4), motion=Still((0.0, 0.0, -1e-3)), duration=0.1, trace=False,
        ... )
        >>> [run.samples for run in simulate_many([job, job])]
        [1000, 1000]
    """
    count = os.cpu_count() or 1 if workers is None else whole("workers", workers, 1)
    with ThreadPoolExecutor(count) as pool:
        return list(pool.map(lambda job: simulate(**job), jobs))


def check_parts(surface: Surface, plant: Plant, hand: Hand, servo: Servo, motion: Motion) -> None:
    """Refuse what is no part of a closed loop.

    Raises:
        ParameterError: for the first that is none.
    """
    for name, value, kinds, words in (
        ("surface", surface, Surface, "a Surface"),
        ("plant", plant, (Cartesian, Pantograph), "a Cartesian or a Pantograph"),
        ("hand", hand, (SpringHand, BandHand, MovedHand), "a SpringHand, BandHand or MovedHand"),
        ("servo", servo, Servo, "a Servo"),
        ("motion", motion, Motion, "a motion such as Still, Strokes or Path"),
    ):
        if not isinstance(value, kinds):
            raise ParameterError(name, f"must be {words}", value)


def whole_samples(duration: float, period: float) -> int:
    """Return how many samples a duration has [s].

    Raises:
        ParameterError: for one that has none, or more than can be.
    """
    if not duration / period <= MOST_SAMPLES:
        limit = f"must be at most {MOST_SAMPLES:g} samples of {period:g} s"
        raise ParameterError("duration", limit, duration)
    samples = round(duration / period)
    if samples < 1:
        raise ParameterError("duration", f"must be at least one period, {period} s", duration)
    return samples


def loop_of(
    surface: Surface, plant: Plant, hand: Hand, servo: Servo, motion: Motion,
    start: ArrayLike | None, velocity: ArrayLike | None,
) -> Simulation:  # fmt: skip
    """Return a loop before its first sample; see :func:`simulate`."""
    place, speed = begin(plant, hand, servo, motion, start, velocity)
    return Simulation(surface, sampled_plant(plant, hand, servo), servo, place, speed)


def begin(
    plant: Plant, hand: Hand, servo: Servo, motion: Motion,
    start: ArrayLike | None, velocity: ArrayLike | None,
) -> tuple[FloatArray, FloatArray]:  # fmt: skip
    """Return where a handle begins [m], and how fast [m/s]; see :func:`simulate`.

    Raises:
        ParameterError: for a beginning that the hand or the plant does not allow.
    """
    origin = motion.at(np.zeros(1))[0]
    place = origin if start is None else array("start", start, (3,), "m")
    speed = np.zeros(3) if velocity is None else array("velocity", velocity, (3,), "m/s")
    if isinstance(hand, MovedHand):
        if (place != origin).any() or velocity is not None:
            raise ParameterError("start", "is where the motion begins, if the hand is moved")
        speed = (motion.at(np.array([servo.period]))[0] - origin) / servo.period
    if isinstance(plant, Pantograph):
        _check_plane("start", place)
        _check_plane("velocity", speed)
        reason = "" if isinstance(hand, MovedHand) else left_workspace(plant, place)
        if reason:
            raise ParameterError("start", f"must be in the workspace: {reason}", place.tolist())
    return place, speed


def _check_plane(name: str, values: FloatArray) -> None:
    if (values[..., 1] != 0.0).any():
        raise ParameterError(name, "must stay at y = 0: a pantograph moves in the x-z plane")


def _anchor(motion: Motion, period: float, samples: int, plant: Plant, first: int) -> FloatArray:
    """Return the anchor's positions from a sample on, one more than the samples of the chunk."""
    return anchor_points(motion, period, plant, first, min(first + CHUNK, samples))


def anchor_points(motion: Motion, period: float, plant: Plant, first: int, last: int) -> FloatArray:
    """Return the anchor's positions at the samples from one to another [m], both included.

    Raises:
        ParameterError: for a motion that is not finite, or that the plant does not allow.
    """
    times = np.arange(first, last + 1, dtype=np.float64) * float(period)
    points = array("motion", motion.at(times), (last + 1 - first, 3), "m")
    if isinstance(plant, Pantograph):
        _check_plane("motion", points)
    return points


def _trace(
    wanted: bool | str | os.PathLike[str], rows: int, most_rows: int | None,
    said: Callable[[], dict[str, Any]], surface: Surface,
) -> Trace:  # fmt: skip
    if isinstance(wanted, bool):
        if wanted and most_rows is not None:
            return ThinTrace(rows, whole("most_rows", most_rows))
        return MemoryTrace(rows if wanted else 0)
    if not isinstance(wanted, (str, os.PathLike)):
        raise ParameterError("trace", "must be True, False or a path", wanted)
    if is_text(Path(wanted)):
        return TextTrace(wanted)
    return FileTrace(wanted, said(), field_files(surface))


def _said(
    surface: Surface, plant: Plant, hand: Hand, servo: Servo, motion: Motion, every: int,
    about: Mapping[str, Any],
) -> dict[str, Any]:  # fmt: skip
    """Return what a recording says of itself."""
    parts = {"servo": servo, "plant": plant, "hand": hand, "motion": motion}
    return {
        "made_by": "simulate",
        "surface": describe_field(surface),
        **{name: plain(part) for name, part in parts.items()},
        "every": every,
        **about,
    }


def _go(
    simulation: Simulation, anchor_from: Callable[[int], FloatArray], samples: int, kept: Trace,
    ending: Ending | None, every: int, progress: Callable[[float], None] | None,
) -> Stop:  # fmt: skip
    while simulation.samples < samples:
        anchor = anchor_from(simulation.samples)
        room = kept.room(len(anchor) // every + 1)
        stop = simulation.run(anchor, room, every)
        kept.keep(simulation.rows)
        if ending is not None:
            ending.see(room[: simulation.rows])
        if progress is not None:
            progress(simulation.samples / samples)
        if stop:
            return stop
    return Stop.NOTHING


def left_workspace(plant: Pantograph, place: FloatArray) -> str:
    """Return why a place [m] is not in the workspace of a pantograph; empty if it is."""
    x, z = plant.centre[0] + place[0], plant.centre[1] + place[2]
    if z <= 0.0:
        return f"the handle is behind the motors, at ({x:.4g}, {z:.4g}) m"
    near, far = plant.linkage.proximal, plant.linkage.distal
    for name, motor in (("right", 0.0), ("left", -plant.linkage.base)):
        reach = float(np.hypot(x - motor, z))
        cosine = (near**2 + far**2 - reach**2) / (2.0 * near * far)
        if abs(cosine) >= np.sqrt(1.0 - LEAST_SINE**2):
            state = "folded" if cosine > 0.0 else "stretched"
            return f"the {name} arm is {state}, {reach:.4g} m from motor to handle"
    return ""


def left_at(stop: Stop, state: FloatArray, plant: Plant) -> str:
    """Return where the handle of a pantograph left the workspace."""
    if stop is not Stop.LEFT or not isinstance(plant, Pantograph):
        return ""
    x, z, vx, vz = state[0], state[2], state[3], state[5]
    place, speed = f"({x:.4g}, 0, {z:.4g}) m", f"({vx:.3g}, 0, {vz:.3g}) m/s"
    return f"at {place} with {speed} an arm is almost stretched or folded"
