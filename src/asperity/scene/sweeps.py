"""Many runs of one scene: onsets by law and delay, energy per stroke by law, speed and depth."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from concurrent.futures import CancelledError, ThreadPoolExecutor
from dataclasses import replace
from functools import partial
from threading import Event
from typing import Any, TypeVar

import numpy as np

from asperity.errors import ParameterError
from asperity.processes import cores
from asperity.scene.setup import Setup
from asperity.simulation.hands import SpringHand
from asperity.simulation.motions import Strokes
from asperity.simulation.onset import LOWEST, Onset, find_onsets
from asperity.simulation.prediction import Prediction, expected, predict, with_wall
from asperity.simulation.scan import Stroke, scan_strokes

DEFAULT_SPEEDS = (0.02, 0.05, 0.1, 0.2)  # m/s
DEFAULT_STROKES = 5


Found = TypeVar("Found")


def side_by_side(
    function: Callable[..., Found], jobs: Iterable[tuple[Any, ...]], over: Event | None = None
) -> tuple[Found, ...]:
    """Return what a function makes of the arguments of each job, computed at the same time.

    Args:
        function: called in threads.
        jobs: its arguments.
        over: set when nobody waits for what is still computed: after an interrupt or an error.
    """
    with ThreadPoolExecutor(cores()) as pool:
        try:
            return tuple(pool.map(lambda job: function(*job), jobs))
        finally:  # before the pool waits for its threads
            if over is not None:
                over.set()


def onsets(
    setup: Setup,
    laws: Sequence[str],
    delays: Sequence[int],
    *,
    starts: int = 12,
    tolerance: float = 0.05,
    lowest: float = LOWEST,
    progress: Callable[[], None] | None = None,
) -> tuple[Prediction, ...]:
    """Return the onset of limit cycles for every law and delay, laws first.

    Args:
        setup: the closed loop; its law, stiffness and delay do not count.
        laws: letters.
        delays: in samples.
        starts: phases of the texture at which the handle starts.
        tolerance: width of the bracket over its lower end.
        lowest: stiffness from which the search goes up [N/m].
        progress: called after every law and delay.

    Raises:
        ParameterError: for a hand that does not come to rest, see
            :func:`~asperity.simulation.find_onset`.
    """
    jobs, over = [(law, delay) for law in laws for delay in delays], Event()
    several = side_by_side(
        partial(_law_onsets, setup, delays, starts, tolerance, lowest, progress, over),
        [(law,) for law in laws],
        over,
    )
    found = [onset for some in several for onset in some]
    return tuple(
        predict(
            setup.with_law(law).surface, setup.plant, setup.hand, setup.with_delay(delay).servo,
            onset, with_wall(found, delay),
        )
        for (law, delay), onset in zip(jobs, found, strict=True)
    )  # fmt: skip


def _law_onsets(
    setup: Setup, delays: Sequence[int], starts: int, tolerance: float, lowest: float,
    progress: Callable[[], None] | None, over: Event, law: str,
) -> list[Onset]:  # fmt: skip
    """Return the onsets of a law for every delay; see :func:`onsets`."""

    def go_on() -> None:
        if over.is_set():
            raise CancelledError

    loop = setup.with_law(law)
    begin = loop.motion.at(np.zeros(1))[0] if loop.start is None else loop.start
    nears = [
        expected(loop.surface, loop.plant, loop.hand, loop.with_delay(delay).servo, begin)
        for delay in delays
    ]
    return find_onsets(
        loop.surface, loop.plant, loop.hand, loop.servo, loop.motion, delays, nears,
        start=loop.start, velocity=loop.velocity, duration=loop.duration, starts=starts,
        tolerance=tolerance, lowest=lowest, progress=go_on, told=progress,
    )  # fmt: skip


def scans(
    setup: Setup,
    laws: Sequence[str],
    *,
    speeds: Sequence[float] = DEFAULT_SPEEDS,
    depths: Sequence[float] | None = None,
    strokes: int | None = None,
    progress: Callable[[float], None] | None = None,
) -> tuple[Stroke, ...]:
    """Return the energy per stroke for every law, speed and depth, laws first.

    Args:
        setup: the closed loop; its law does not count.
        laws: letters.
        speeds: of the hand [m/s].
        depths: of the hand below z = 0 [m]; default: the motion's.
        strokes: per run; default: the motion's, at least 5.
        progress: is told the part that is done.

    Raises:
        ParameterError: for a motion that is not made of strokes, or depths for a hand that does
            not hold a height.
    """
    motion = setup.motion
    if not isinstance(motion, Strokes):
        raise ParameterError("motion", 'must be kind = "strokes" to be scanned')
    deepest = -min(motion.start[2], motion.end[2])
    if depths is None:
        if deepest <= 0.0:
            raise ParameterError("depths", "are needed: the motion of the scene is not below z = 0")
        depths = (deepest,)
    elif isinstance(setup.hand, SpringHand) and setup.hand.stiffness[2] == 0.0:
        raise ParameterError("depths", "mean nothing: the hand has no stiffness along z")
    count = max(motion.count, DEFAULT_STROKES) if strokes is None else strokes
    way = replace(motion, count=count)
    jobs = [(law, speed, depth) for law in laws for speed in speeds for depth in depths]
    done = [0]

    def one(law: str, speed: float, depth: float) -> Stroke:
        (found,) = scan_strokes(
            setup.with_law(law).surface, setup.plant, setup.hand, setup.servo, way,
            speeds=[speed], depths=[depth], start=setup.start, velocity=setup.velocity,
        )  # fmt: skip
        done[0] += 1
        if progress is not None:
            progress(done[0] / len(jobs))
        return found

    return side_by_side(one, jobs)
