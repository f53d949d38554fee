"""What a stroke along the surface gains or costs, against speed and depth."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.checks import FloatArray, positive
from asperity.errors import ParameterError
from asperity.files import plain, record
from asperity.simulation.hands import Hand
from asperity.simulation.motions import Strokes
from asperity.simulation.plants import Plant
from asperity.simulation.run import Run
from asperity.simulation.servo import Servo
from asperity.simulation.simulate import simulate
from asperity.surface import Surface

# Of the work that goes to and fro, what counts as nothing.
_NEGLIGIBLE = 1e-3


@dataclass(frozen=True)
class Stroke:
    """Energy of a stroke at one speed and depth.

    Attributes:
        law: letter of the law.
        speed: of the hand [m/s].
        depth: of the hand below z = 0 [m].
        reached: mean depth of the handle below z = 0 [m].
        energy: that the texture supplies per stroke, along x, y and z [J]: the mean over whole
            turns, there and back, after the first stroke, which has the start in it.
        field: of it what the law itself supplies per stroke [J]: the work of its force along the
            true path, at every place at once. The rest is due to sampling, delay and the steps of
            the encoder; of a conservative law all is.
        error: of the field's work [J]: of its quadrature by halving the steps, a thousandth of
            all that goes there and back, and what turns store that do not end where they began.
        spread: standard deviation of the field's work from turn to turn [J]; 0 for a single one.
        same_sample: the paper's sum per stroke, along x, y and z [J]: commanded force times the
            measured displacement of the same sample.
        lost_contact: how often per stroke the force ended.
        closure: energy of the whole run that does not add up, over what was exchanged [1].
        stopped: why the run ended early; empty if it did not.
    """

    law: str
    speed: float
    depth: float
    reached: float
    energy: tuple[float, float, float]
    field: float
    error: float
    spread: float
    same_sample: tuple[float, float, float]
    lost_contact: float
    closure: float
    stopped: str

    @property
    def total(self) -> float:
        """Energy per stroke, all axes [J]; > 0 feeds the hand."""
        return float(sum(self.energy))

    @property
    def feeds(self) -> bool:
        """Whether the law itself feeds the hand: by more than its spread and its error."""
        return self.field > self.spread + self.error

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units; what is not known, or overflowed, is ``None``."""
        return {
            **record(self, "law", "speed", "depth", "reached", "energy", infinity=None),
            "energy_sum": plain(self.total, infinity=None),
            **record(self, "field", "error", "spread", "same_sample", infinity=None),
            "same_sample_sum": plain(sum(self.same_sample), infinity=None),
            **record(self, "lost_contact", "closure", "stopped", infinity=None),
        }


def scan_strokes(
    surface: Surface,
    plant: Plant,
    hand: Hand,
    servo: Servo,
    motion: Strokes,
    *,
    speeds: Sequence[float],
    depths: Sequence[float],
    start: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    progress: Callable[[], None] | None = None,
) -> tuple[Stroke, ...]:
    """Return the energy per stroke for every speed and depth.

    Args:
        surface: texture, law and stiffness.
        plant: what moves.
        hand: what holds it.
        servo: what the electronics do.
        motion: the strokes; their speed and depth are replaced.
        speeds: [m/s].
        depths: of the hand below z = 0 [m].
        start: of the handle [m], shape (3,); default: where the motion begins.
        velocity: of the handle at the start [m/s], shape (3,); default: none.
        progress: called after every run.

    Raises:
        ParameterError: for a motion that is not made of strokes, or a wrong number.
    """
    if not isinstance(motion, Strokes):
        raise ParameterError("motion", "must be strokes to be scanned", type(motion).__name__)
    result = []
    for speed in speeds:
        for depth in depths:
            positive("speeds", speed, "m/s")
            way = _at_depth(motion, speed, depth)
            run = simulate(
                surface, plant, hand, servo, way, way.duration, start=start, velocity=velocity
            )
            result.append(_stroke(surface, way, run, depth))
            if progress is not None:
                progress()
    return tuple(result)


def _at_depth(motion: Strokes, speed: float, depth: float) -> Strokes:
    (x0, y0, _), (x1, y1, _) = motion.start, motion.end
    return Strokes((x0, y0, -depth), (x1, y1, -depth), speed, motion.count)


def _stroke(surface: Surface, way: Strokes, run: Run, depth: float) -> Stroke:
    law, speed = surface.law.letter, float(way.speed)
    reached = -float(run.position[:, 2].mean())
    contact = np.any(run.applied != 0.0, axis=1)
    lost = float(np.count_nonzero(contact[:-1] & ~contact[1:]))
    ledger = run.ledger
    closure = abs(ledger.closure) / max(ledger.exchanged, 1e-300)
    if run.stopped:
        nan = math.nan
        energy = (nan, nan, nan)
        return Stroke(
            law, speed, depth, reached, energy, nan, nan, nan, energy, nan, closure, run.stopped
        )
    begins = np.searchsorted(run.time, way.period * np.arange(1, way.count) - 1e-9 * run.period)

    def each(name: str) -> FloatArray:
        """Return a sum of the ledger, stroke by stroke."""
        at = [run.energies[name][begins], np.array([getattr(ledger, name)], dtype=float)]
        summed = np.concatenate(at)
        return np.asarray(np.diff(summed, axis=0, prepend=np.zeros_like(summed[:1])))

    fine, coarse = field_work(surface, np.vstack([run.position, run.state[:3]]))

    def summed(pieces: FloatArray) -> FloatArray:
        return _kept(np.array([part.sum() for part in np.split(pieces, begins)]))

    works = summed(fine)
    error = np.abs(works - summed(coarse)).mean() + _NEGLIGIBLE * summed(np.abs(fine)).mean()
    error += _not_closed(run, np.array([0, *begins]), len(works))

    def mean(name: str) -> tuple[float, float, float]:
        x, y, z = (float(value) for value in _kept(each(name)).mean(axis=0))
        return x, y, z

    return Stroke(
        law, speed, depth, reached, mean("supplied"), float(works.mean()), float(error),
        _spread(works), mean("same_sample"), lost / way.count, closure, "",
    )  # fmt: skip


def _kept(strokes: FloatArray) -> FloatArray:
    """Return whole turns, there and back, without the first stroke where there are enough.

    What a field stores on the way there it gives on the way back.
    """
    count = (len(strokes) - 1) // 2 * 2 or len(strokes)
    return strokes[-count:]


def _not_closed(run: Run, begins: FloatArray, kept: int) -> float:
    """Return what a field may have given or stored because turns do not end where they began [J].

    Per stroke: the distance between both ends of a turn, times the force there.
    """
    first = [int(i) for i in begins[-kept::2]]
    ends = np.vstack([run.position[first[1:]], run.state[:3]])
    gaps = np.linalg.norm(ends - run.position[first], axis=1)
    forces = np.linalg.norm(run.applied[first], axis=1)
    return float((gaps * forces).mean() / 2.0) if kept % 2 == 0 else 0.0


def _spread(works: FloatArray) -> float:
    """Return the standard deviation of the mean from turn to turn."""
    turns = works.reshape(-1, 2).mean(axis=1) if len(works) % 2 == 0 else works
    return float(turns.std())


def field_work(surface: Surface, path: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the work of a law's force along a path, straight from point to point.

    Args:
        surface: whose law, with its state if it has one, follows the path.
        path: points [m], shape (n + 1, 3).

    Returns:
        Of each piece [J], shape (n,): by Simpson's rule, and by the trapezoidal rule.
    """
    middle = 0.5 * (path[1:] + path[:-1])
    points = np.empty((2 * len(path) - 1, 3))
    points[::2], points[1::2] = path, middle
    force = surface.trace(points)
    step = np.diff(path, axis=0)
    ends = np.einsum("ij,ij->i", force[:-2:2] + force[2::2], step)
    between = np.einsum("ij,ij->i", force[1::2], step)
    return np.asarray((ends + 4.0 * between) / 6.0), np.asarray(0.5 * ends)
