"""Sweeps of one scene: onset by law and delay; energy per stroke by law, speed and depth."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from dataclasses import dataclass, replace
from threading import Event
from typing import Any, TypeVar

import numpy as np

from asperity.core.checks import check_items, check_positive, check_real
from asperity.core.display import Reportable, Tabular
from asperity.core.errors import ParameterError
from asperity.core.files import to_plain_data
from asperity.core.processes import available_cores
from asperity.laws import Law
from asperity.scene.setup import Setup
from asperity.simulation.hands import Strokes
from asperity.simulation.onset import (
    MIN_STIFFNESS,
    Onset,
    Prediction,
    expected_onset,
    find_onsets,
    predict,
    smooth_wall_onset,
)
from asperity.simulation.scan import Stroke, scan_strokes

DEFAULT_DELAYS = tuple(range(6))  # [samples]
DEFAULT_SPEEDS = (0.02, 0.05, 0.1, 0.2)  # m/s
DEFAULT_STROKES = 5
DEFAULT_STARTS = 12
DEFAULT_TOLERANCE = 0.05


ResultT = TypeVar("ResultT")


def map_threads(
    function: Callable[..., ResultT],
    jobs: Iterable[tuple[Any, ...]],
    cancelled: Event | None = None,
) -> tuple[ResultT, ...]:
    """Return the results of a function for the arguments of each job, computed in threads.

    Args:
        function: the function.
        jobs: its arguments.
        cancelled: event that is set at the end, also after an interrupt or an error, so that
            threads that still run can stop.
    """
    with ThreadPoolExecutor(available_cores()) as pool:
        try:
            return tuple(pool.map(lambda job: function(*job), jobs))
        finally:  # the pool waits for its threads afterwards
            if cancelled is not None:
                cancelled.set()


def sweep_onsets(
    setup: Setup,
    laws: Sequence[str | Law],
    delays: int | Sequence[int],
    *,
    n_phases: int = DEFAULT_STARTS,
    tolerance: float = DEFAULT_TOLERANCE,
    min_stiffness: float = MIN_STIFFNESS,
    progress: Callable[[], None] | None = None,
) -> OnsetSweep:
    """Find the onset of limit cycles for every law and delay, laws first.

    Args:
        setup: the closed loop; its law, stiffness and delay are replaced.
        laws: letters, or laws.
        delays: delays [samples].
        n_phases: phases of the texture at which the handle starts.
        tolerance: relative width of the bracket.
        min_stiffness: lower limit of the search [N/m].
        progress: called after every law and delay.

    Raises:
        ParameterError: the hand does not come to rest, see
            :func:`~asperity.simulation.find_onset`.
    """
    cancelled = Event()
    delays = check_items("delays", delays)

    def check_cancelled() -> None:
        if cancelled.is_set():
            raise CancelledError

    def find(law: str | Law) -> tuple[Setup, list[Onset]]:
        loop = setup.with_law(law).with_rendering()
        start = loop.motion.at(np.zeros(1))[0] if loop.start is None else loop.start
        rendered = loop.rendered
        nears = [
            expected_onset(rendered, loop.plant, loop.hand, loop.with_delay(delay).servo, start)
            for delay in delays
        ]
        return loop, find_onsets(
            rendered,
            loop.plant,
            loop.hand,
            loop.servo,
            loop.motion,
            delays,
            nears,
            start=loop.start,
            velocity=loop.velocity,
            duration=loop.duration,
            starts=n_phases,
            tolerance=tolerance,
            lowest=min_stiffness,
            progress=check_cancelled,
            onset_callback=progress,
        )

    by_law = map_threads(find, [(law,) for law in laws], cancelled)
    all_onsets = [onset for _, onsets in by_law for onset in onsets]
    predictions = tuple(
        predict(
            loop.rendered,
            loop.plant,
            loop.hand,
            loop.with_delay(onset.delay).servo,
            onset,
            smooth_wall_onset(all_onsets, onset.delay),
        )
        for loop, onsets in by_law
        for onset in onsets
    )
    return OnsetSweep(_with_notes(setup, [loop for loop, _ in by_law]), predictions)


def _with_notes(setup: Setup, loops: Sequence[Setup]) -> Setup:
    """Return the loop with what its copies of each law assume about their rendering."""
    known = setup.assumptions
    notes = [note for loop in loops for note in loop.assumptions if note not in known]
    return replace(setup, assumptions=(*dict.fromkeys(notes), *known))


def sweep_strokes(
    setup: Setup,
    laws: Sequence[str | Law],
    *,
    speeds: float | Sequence[float] = DEFAULT_SPEEDS,
    depths: float | Sequence[float] | None = None,
    strokes: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> StrokeSweep:
    """Simulate the energy per stroke for every law, speed and depth, laws first.

    Args:
        setup: the closed loop; its law is replaced.
        laws: letters, or laws.
        speeds: speeds of the hand [m/s].
        depths: depths of the hand below z = 0 [m]; default: the motion's.
        strokes: number of strokes per run; default: the motion's, at least 5.
        progress: called with the fraction done.

    Raises:
        ParameterError: the motion has no strokes, or depths are given for a hand without vertical
            stiffness.
    """
    motion = setup.motion
    if not isinstance(motion, Strokes):
        raise ParameterError("motion", 'must be kind = "strokes" to be scanned')
    deepest = -min(motion.start[2], motion.end[2])
    if depths is None:
        if deepest <= 0.0:
            raise ParameterError("depths", "are needed: the motion of the scene is not below z = 0")
        depths = deepest
    elif not setup.hand.holds_height:
        raise ParameterError("depths", "mean nothing: the hand has no stiffness along z")
    count = max(motion.count, DEFAULT_STROKES) if strokes is None else strokes
    path = replace(motion, count=count)
    speeds = [check_positive("speeds", speed, "m/s") for speed in check_items("speeds", speeds)]
    depths = [check_real("depths", depth, "m") for depth in check_items("depths", depths)]
    loops = map_threads(lambda law: setup.with_law(law).with_rendering(), [(law,) for law in laws])
    jobs = [(loop, speed, depth) for loop in loops for speed in speeds for depth in depths]
    done = [0]

    def scan(loop: Setup, speed: float, depth: float) -> Stroke:
        (stroke,) = scan_strokes(
            loop.rendered,
            setup.plant,
            setup.hand,
            setup.servo,
            path,
            speeds=[speed],
            depths=[depth],
            start=setup.start,
            velocity=setup.velocity,
        )
        done[0] += 1
        if progress is not None:
            progress(done[0] / len(jobs))
        return stroke

    return StrokeSweep(_with_notes(setup, loops), map_threads(scan, jobs))


SCHEMA = 2


@dataclass(frozen=True)
class OnsetSweep(Reportable, Tabular):
    """The onset of limit cycles of a scene, for each law and delay.

    Attributes:
        setup: the closed loop.
        onsets: one for each law and delay, laws first.
    """

    setup: Setup
    onsets: tuple[Prediction, ...]

    def __repr__(self) -> str:
        return f"<OnsetSweep of {len(self.onsets)} onsets on {self.setup.device.id}>"

    def table_rows(self) -> list[dict[str, Any]]:
        """Return law, delay, bracket of the onset and the rules; SI units."""
        return [
            {
                "law": prediction.onset.law,
                "delay [samples]": prediction.onset.delay,
                "quiet [N/m]": prediction.onset.quiet,
                "cycling [N/m]": prediction.onset.cycling,
                "cycling starts": prediction.onset.cycles,
                "starts": prediction.onset.starts,
                "depth [m]": prediction.depth,
                "q": prediction.q,
                "one-sided q": prediction.one_sided,
                "paper (1) [N/m]": prediction.paper_limit,
                "delay rule [N/m]": prediction.delay_rule,
                "wall rule [N/m]": prediction.wall_rule,
                "conservative": prediction.conservative,
            }
            for prediction in self.onsets
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        onsets = to_plain_data(self.onsets)
        return {"schema": SCHEMA, "scene": self.setup.to_dict(), "onsets": onsets}


@dataclass(frozen=True)
class StrokeSweep(Reportable, Tabular):
    """The energy per stroke of a scene, for each law, speed and depth.

    Attributes:
        setup: the closed loop.
        strokes: one for each law, speed and depth, laws first.
    """

    setup: Setup
    strokes: tuple[Stroke, ...]

    def __repr__(self) -> str:
        return f"<StrokeSweep of {len(self.strokes)} cases on {self.setup.device.id}>"

    def table_rows(self) -> list[dict[str, Any]]:
        """Return law, speed, depth and the energies per stroke; SI units."""
        return [
            {
                "law": stroke.law,
                "speed [m/s]": stroke.speed,
                "depth [m]": stroke.depth,
                "mean depth [m]": stroke.mean_depth,
                "energy per stroke [J]": stroke.total,
                "energy of the field [J]": stroke.field,
                "error of the field [J]": stroke.error,
                "spread of the field [J]": stroke.spread,
                "gains energy": stroke.gains_energy,
                "the paper's sum [J]": stroke.same_sample_sum,
                "contact losses per stroke": stroke.lost_contact,
                "stop message": stroke.stop_message,
            }
            for stroke in self.strokes
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        strokes = to_plain_data(self.strokes)
        return {"schema": SCHEMA, "scene": self.setup.to_dict(), "strokes": strokes}
