"""Energy gained or lost in strokes along a surface, against speed and depth."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError
from asperity.core.files import attributes_to_dict
from asperity.simulation.hands import Hand, Strokes
from asperity.simulation.plants import Plant
from asperity.simulation.servo import Servo
from asperity.simulation.simulate import simulate
from asperity.simulation.trace import Run
from asperity.surface import Surface

# Share of the work done back and forth that is negligible.
_NEGLIGIBLE = 1e-3


@dataclass(frozen=True)
class Stroke:
    """Energy of a stroke at one speed and depth.

    Attributes:
        law: letter of the law.
        speed: speed of the hand [m/s].
        depth: depth of the hand below z = 0 [m].
        mean_depth: mean depth of the handle below z = 0 [m].
        energy: energy that the texture supplies per stroke, along x, y and z [J]: the mean over
            whole cycles, back and forth, after the first stroke, which includes the start.
        field: the part that the law itself supplies per stroke [J]: the work of its force along the
            true path, without sampling and delay. The rest is due to sampling, delay and encoder
            steps; for a conservative law that is all of it.
        error: error of the field's work [J]: quadrature error by halving the steps, a thousandth of
            the work done back and forth, and the energy stored in cycles that do not close.
        spread: standard deviation of the field's work from cycle to cycle [J]; 0 for a single one.
        same_sample: the paper's sum per stroke, along x, y and z [J]: commanded force times the
            measured displacement of the same sample.
        lost_contact: contact losses per stroke.
        closure: closure error of the whole run over the energy exchanged [1].
        stop_message: why the run ended early; empty if it did not.
        slipped: energy that the surface's friction took by slip, mean per stroke [J].
    """

    law: str
    speed: float
    depth: float
    mean_depth: float
    energy: tuple[float, float, float]
    field: float
    error: float
    spread: float
    same_sample: tuple[float, float, float]
    lost_contact: float
    closure: float
    stop_message: str
    slipped: float = 0.0

    @property
    def total(self) -> float:
        """Energy per stroke, all axes [J]; > 0: the hand gains energy."""
        return float(sum(self.energy))

    energy_sum = total  # its name in JSON

    @property
    def gains_energy(self) -> bool:
        """Whether the law itself delivers energy, by more than its spread and its error."""
        return self.field > self.spread + self.error

    @property
    def same_sample_sum(self) -> float:
        """The paper's sum per stroke, all axes [J]."""
        return float(sum(self.same_sample))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units; ``None`` for an unknown number or an overflow."""
        names = (
            "law speed depth mean_depth energy energy_sum field error spread same_sample"
            " same_sample_sum lost_contact closure stop_message slipped"
        )
        return attributes_to_dict(self, *names.split(), infinity=None)


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
        plant: the device.
        hand: the hand that holds it.
        servo: the electronics.
        motion: the strokes; their speed and depth are replaced.
        speeds: [m/s].
        depths: depths of the hand below z = 0 [m].
        start: initial position of the handle [m], shape (3,); default: where the motion starts.
        velocity: initial velocity of the handle [m/s], shape (3,); default: at rest.
        progress: called after every run.

    Raises:
        ParameterError: for a motion that does not consist of strokes, or an invalid number.
    """
    if not isinstance(motion, Strokes):
        raise ParameterError("motion", "must be strokes to be scanned", type(motion).__name__)
    result = []
    for speed in speeds:
        for depth in depths:
            check_positive("speeds", speed, "m/s")
            (x0, y0, _) = motion.start
            (x1, y1, _) = motion.end
            strokes = Strokes((x0, y0, -depth), (x1, y1, -depth), speed, motion.count)
            run = simulate(
                surface,
                plant,
                hand,
                servo,
                strokes,
                strokes.duration,
                start=start,
                velocity=velocity,
            )
            result.append(_analyze_stroke(surface, strokes, run, depth))
            if progress is not None:
                progress()
    return tuple(result)


def _analyze_stroke(surface: Surface, motion: Strokes, run: Run, depth: float) -> Stroke:
    law = surface.law.letter
    speed = float(motion.speed)
    ledger = run.ledger
    mean_depth = -float(run.position[:, 2].mean())
    closure = abs(ledger.closure) / max(ledger.exchanged, 1e-300)
    if run.stop_message:
        return _stopped_stroke(law, speed, depth, mean_depth, closure, run.stop_message)
    ends = motion.period * np.arange(1, motion.count) - 1e-9 * run.period
    starts = np.searchsorted(run.time, ends)

    def mean(name: str) -> tuple[float, float, float]:
        """Return the mean over whole cycles of a sum of the ledger, per stroke."""
        last = np.array([getattr(ledger, name)], dtype=float)
        sums = np.concatenate([run.energies[name][starts], last])
        strokes = np.diff(sums, axis=0, prepend=np.zeros_like(sums[:1]))
        x, y, z = (float(value) for value in _whole_cycles(strokes).mean(axis=0))
        return x, y, z

    def sum_strokes(pieces: FloatArray) -> FloatArray:
        return _whole_cycles(np.array([part.sum() for part in np.split(pieces, starts)]))

    fine, coarse = field_work(surface, np.vstack([run.position, run.state[:3]]))
    works = sum_strokes(fine)
    error = np.abs(works - sum_strokes(coarse)).mean()
    error += _NEGLIGIBLE * sum_strokes(np.abs(fine)).mean()
    error += _closing_error(run, np.array([0, *starts]), len(works))
    contact = np.any(run.applied != 0.0, axis=1)
    losses = float(np.count_nonzero(contact[:-1] & ~contact[1:]))
    return Stroke(
        law,
        speed,
        depth,
        mean_depth,
        mean("supplied"),
        float(works.mean()),
        float(error),
        _cycle_spread(works),
        mean("same_sample"),
        losses / motion.count,
        closure,
        "",
        run.slipped / motion.count,
    )


def _stopped_stroke(
    law: str, speed: float, depth: float, mean_depth: float, closure: float, message: str
) -> Stroke:
    """Return the stroke of a run that ended early, whose energies are unknown."""
    nan = math.nan
    return Stroke(
        law,
        speed,
        depth,
        mean_depth,
        energy=(nan, nan, nan),
        field=nan,
        error=nan,
        spread=nan,
        same_sample=(nan, nan, nan),
        lost_contact=nan,
        closure=closure,
        stop_message=message,
    )


def _whole_cycles(strokes: FloatArray) -> FloatArray:
    """Return the strokes of whole cycles, back and forth, without the first one if possible.

    A field returns on the way back what it stores on the way out.
    """
    count = (len(strokes) - 1) // 2 * 2 or len(strokes)
    return strokes[-count:]


def _cycle_spread(works: FloatArray) -> float:
    """Return the standard deviation of the mean work from cycle to cycle."""
    cycles = works.reshape(-1, 2).mean(axis=1) if len(works) % 2 == 0 else works
    return float(cycles.std())


def _closing_error(run: Run, starts: FloatArray, count: int) -> float:
    """Return the energy that a field may have stored because cycles do not close [J].

    Per stroke: the distance between both ends of a cycle, times the force there.
    """
    first = [int(i) for i in starts[-count::2]]
    ends = np.vstack([run.position[first[1:]], run.state[:3]])
    gaps = np.linalg.norm(ends - run.position[first], axis=1)
    forces = np.linalg.norm(run.applied[first], axis=1)
    return float((gaps * forces).mean() / 2.0) if count % 2 == 0 else 0.0


def field_work(surface: Surface, path: FloatArray) -> tuple[FloatArray, FloatArray]:
    """Return the work of a law's force along a polygonal path.

    Args:
        surface: the surface; the state of its law is carried along the path.
        path: points [m], shape (n + 1, 3).

    Returns:
        Work of each segment [J], shape (n,): by Simpson's rule, and by the trapezoidal rule.
    """
    middle = 0.5 * (path[1:] + path[:-1])
    points = np.empty((2 * len(path) - 1, 3))
    points[::2] = path
    points[1::2] = middle
    force = surface.trace(points)
    step = np.diff(path, axis=0)
    ends = np.einsum("ij,ij->i", force[:-2:2] + force[2::2], step)
    between = np.einsum("ij,ij->i", force[1::2], step)
    return np.asarray((ends + 4.0 * between) / 6.0), np.asarray(0.5 * ends)
