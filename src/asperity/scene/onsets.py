"""Onsets of a scene, by law and delay, beside what the criteria allow."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from concurrent.futures import ThreadPoolExecutor

from asperity.scene.setup import Setup
from asperity.simulation.onset import LOWEST, Onset, find_onset
from asperity.simulation.prediction import Prediction, predict, with_wall

WORKERS = 2


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

    def one(job: tuple[str, int]) -> Onset:
        law, delay = job
        loop = setup.with_law(law).with_delay(delay)
        found = find_onset(
            loop.surface, loop.plant, loop.hand, loop.servo, loop.motion, start=loop.start,
            velocity=loop.velocity, duration=loop.duration, starts=starts, tolerance=tolerance,
            lowest=lowest,
        )  # fmt: skip
        if progress is not None:
            progress()
        return found

    jobs = [(law, delay) for law in laws for delay in delays]
    with ThreadPoolExecutor(WORKERS) as pool:
        found = list(pool.map(one, jobs))
    return tuple(
        predict(
            setup.with_law(law).surface, setup.plant, setup.hand, setup.with_delay(delay).servo,
            onset, with_wall(found, delay),
        )
        for (law, delay), onset in zip(jobs, found, strict=True)
    )  # fmt: skip
