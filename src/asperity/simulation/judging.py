"""Whether a run ends in a limit cycle: it is made longer until that can be told."""

from __future__ import annotations

from collections.abc import Callable, Generator

from asperity.simulation.ending import FED
from asperity.simulation.run import Stop
from asperity.simulation.together import Judge, Seen

# The paper does not say when an oscillation counts; here above this restlessness [m/s].
CYCLE_SPEED = 15e-3
# A run that is restless at its end is made so many times longer, again and again up to the last.
PATIENCE = (1.0, 4.0, 16.0)
# A motion whose restlessness is below this part of what it was before is getting less.
_CALMER = 0.9
# Of fewer samples a quarter is one, which does not vary.
_LEAST = 8


def ends_in_cycle(samples: Callable[[float], int], threshold: float = CYCLE_SPEED) -> Judge:
    """Tell whether a run ends in a limit cycle: restless, and fed by the texture, or diverged.

    Restless: in its last quarter the standard deviations of the velocity come to more than the
    threshold, summed over the axes. For a cycle in place this is rms(vx) + rms(vy) + rms(vz);
    sinking at constant speed does not count. Fed: in that quarter the texture supplies at least a
    fifth of what damping and dry friction take, on average all of it. A handle that swings or falls
    on its own is no limit cycle; one that leaves the workspace while it is fed counts as one.

    A run that ends restless goes on, to 4 and 16 times as long, until what is left of the motion
    is not getting less, by a tenth or more from one quarter to the next.

    Args:
        samples: of a run, by how many times as long it is as the first.
        threshold: [m/s].
    """
    for patience in PATIENCE:
        rows = samples(patience)
        quarter = rows // 4
        # Quarters as NumPy splits: what is left over goes to the first ones.
        third = rows - 2 * quarter - (rows % 4 == 3)
        seen: list[Seen] = []
        for goal in (third, rows - quarter, rows):
            seen.append((yield goal))
            if seen[-1].stop:
                return (yield from _stopped(seen[-1], threshold))
        _, before, last = seen
        if last.restlessness <= threshold:
            return False
        if patience > 1.0 and not last.restlessness < _CALMER * before.restlessness:
            break
    return _fed(before, last)


def _stopped(seen: Seen, threshold: float) -> Generator[int, Seen, bool]:
    """Tell the same of a run that was stopped; of one that left, its last quarter is run again."""
    if seen.stop is Stop.DIVERGED:
        return True
    rows = seen.samples + 1  # with the sample that the body could not follow
    if rows < _LEAST:
        return False
    first = yield rows - rows // 4
    last = yield rows
    return last.restlessness > threshold and _fed(first, last)


def _fed(first: Seen, last: Seen) -> bool:
    """Return whether the texture feeds the handle from one sample to before another."""
    supplied = last.last[0] - first.energies[0]
    taken = last.last[1] - first.energies[1]
    return supplied > FED * taken
