"""The stiffness at which limit cycles begin, by bisection over many starts."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, field, replace
from fractions import Fraction
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.analysis.gain import characteristic
from asperity.analysis.gain.surface_cache import surface_content
from asperity.analysis.passivity.device_loop import add_friction
from asperity.core.cache import get_or_compute_each
from asperity.core.checks import FloatArray, check_array, check_positive
from asperity.core.errors import ParameterError
from asperity.core.files import (
    OMITTED,
    Serializable,
    attributes_to_dict,
    is_shipped,
    json_text,
    to_plain_data,
)
from asperity.laws.w_smooth_wall import LAW as SMOOTH_WALL
from asperity.simulation import onset_search
from asperity.simulation.hands import Hand, Motion
from asperity.simulation.lanes import MAX_LANES, BatchSimulation, Trajectory
from asperity.simulation.plants import Plant
from asperity.simulation.servo import Servo
from asperity.simulation.simulate import count_samples
from asperity.surface import Surface

MIN_STIFFNESS = 1.0  # stiffness [N/m]
MAX_STIFFNESS = 1e6
_MIN_TOLERANCE = 1e-9
_MIN_SAMPLES = 16
_MAX_STARTS = 10_000


@dataclass(frozen=True)
class Onset(Serializable):
    """The stiffness at which limit cycles begin.

    Attributes:
        law: letter of the law.
        delay: delay of the servo [samples].
        quiet: largest stiffness tried, below ``cycling``, at which no start ended in a limit cycle
            [N/m]; 0 if the lowest one cycled already.
        cycling: least stiffness tried at which a start did [N/m]; infinite if none did up to the
            highest. The onset of these starts lies between the two, unless it is not monotone: of
            the stiffnesses a factor of 2 apart, see :func:`find_onset`, the first pair is taken of
            which the upper one cycles.
        starts: number of starts tried at each stiffness.
        cycles: number of starts that ended in a limit cycle at ``cycling``.
        low: least position in the runs at ``cycling`` (at the highest stiffness if nothing cycled),
            per axis [m].
        high: greatest position there [m].
        is_smooth_wall: whether the law is the smooth wall.
    """

    law: str
    delay: int
    quiet: float
    cycling: float
    starts: int
    cycles: int
    low: tuple[float, float, float]
    high: tuple[float, float, float]
    is_smooth_wall: bool = field(default=False, metadata=OMITTED)

    @property
    def value(self) -> float:
        """Geometric mean of the bracket [N/m].

        It is the upper end if the lowest stiffness cycled, infinite if nothing did.
        """
        if self.quiet == 0.0:
            return self.cycling
        return math.sqrt(self.quiet * self.cycling)


def is_at_rest(motion: Motion, duration: float) -> bool:
    """Return whether a hand is at rest in the second half of a run [s]."""
    times = np.linspace(0.5, 1.0, 33) * duration
    return bool(np.ptp(motion.at(times), axis=0).max() == 0.0)


def run_starts(
    batch: BatchSimulation, stiffness: float, servo: Servo, offsets: FloatArray, duration: float
) -> list[Trajectory]:
    """Return the trajectories for each shift of the start [m], (n, 3), with their verdicts."""
    samples = _samples_for(duration, servo)
    runs = []
    for shift in offsets:
        rule = onset_search.limit_cycle_rule(samples, servo.period)
        runs.append(batch.new_trajectory(stiffness, servo.delay, shift, rule))
    while active := [run for run in runs if run.verdict is None][:MAX_LANES]:
        batch.run(active)
    return runs


def _samples_for(duration: float, servo: Servo) -> Callable[[float], int]:
    return lambda factor: count_samples(factor * duration, servo.period)


def start_offsets(surface: Surface, count: int) -> FloatArray:
    """Return starting phases along the scan line [m], shape (count, 3).

    They divide one period evenly; for a texture that is not periodic, its scan line.
    """
    line = surface.texture.scan_line()
    along = np.append(line.direction, 0.0)
    return np.asarray(np.arange(count)[:, None] / count * line.length * along)


def find_onset(
    surface: Surface,
    plant: Plant,
    hand: Hand,
    servo: Servo,
    motion: Motion,
    *,
    near: float | None = None,
    **options: Any,
) -> Onset:
    """Find the stiffness at which limit cycles begin, by bisection over many starting phases.

    Args:
        surface: the surface; its stiffness is not used.
        plant: the device.
        hand: the hand that holds it.
        servo: period, delay, resolutions.
        motion: motion of the hand's anchor; it must be at rest in the second half of the run.
        near: expected onset [N/m]. The search then starts at the nearest of the stiffnesses a
            factor of 2 apart, and goes up from a quiet one, down from one that cycles. For loops
            that cycle above a single stiffness the answer is the same, with a quarter of the runs;
            a window of cycles below a quiet stiffness is missed.
        **options: ``start``, ``velocity``, ``duration``, ``starts``, ``tolerance``, ``threshold``,
            ``lowest``, ``highest`` and ``progress``; see :func:`find_onsets`.

    Raises:
        ParameterError: for a prescribed motion of the handle, a motion that does not come to rest,
            or an invalid number.
    """
    (onset,) = find_onsets(surface, plant, hand, servo, motion, [servo.delay], [near], **options)
    return onset


def find_onsets(
    surface: Surface,
    plant: Plant,
    hand: Hand,
    servo: Servo,
    motion: Motion,
    delays: Sequence[int],
    nears: Sequence[float | None],
    *,
    start: ArrayLike | None = None,
    velocity: ArrayLike | None = None,
    duration: float = 0.5,
    starts: int = 24,
    tolerance: float = 0.02,
    threshold: float | None = None,
    lowest: float = MIN_STIFFNESS,
    highest: float = MAX_STIFFNESS,
    progress: Callable[[], None] | None = None,
    onset_callback: Callable[[], None] | None = None,
) -> list[Onset]:
    """Find the onsets for several delays [samples], each with its expected onset [N/m].

    The searches run together, so that as many runs as possible are simulated at once.

    Args:
        surface: see :func:`find_onset`.
        plant: see :func:`find_onset`.
        hand: see :func:`find_onset`.
        servo: see :func:`find_onset`; its delay is replaced.
        motion: see :func:`find_onset`.
        delays: delays [samples].
        nears: expected onset of each [N/m], or ``None``; see :func:`find_onset`.
        start: initial position of the handle [m], shape (3,); default: where the motion starts.
        velocity: initial velocity of the handle [m/s], shape (3,); default: at rest.
        duration: duration of a run [s]; a run that still oscillates is extended, up to 256 times as
            long.
        starts: number of phases of the texture at which the handle starts.
        tolerance: width of the bracket over its lower end.
        threshold: sum over the axes of the standard deviations of the velocity above which an
            oscillation counts as a limit cycle [m/s]. By default an oscillation counts that a hand
            feels (:func:`~asperity.simulation.onset_search.felt_speed`) and that lasts
            without steps of position and force, whose chatter belongs to the encoder.
        lowest: stiffness at which the search starts [N/m]; a surface too soft for the hand's force
            lets the handle sink to depths at which the numbers of the law do not hold.
        highest: stiffness at which the search ends [N/m].
        progress: called after every stiffness; not for an onset from the cache.
        onset_callback: called after every onset.

    Raises:
        ParameterError: see :func:`find_onset`.
    """
    _check_arguments(hand, motion, servo, duration, starts)
    width = check_positive("tolerance", tolerance)
    if width < _MIN_TOLERANCE:
        raise ParameterError("tolerance", f"must be at least {_MIN_TOLERANCE:g}", tolerance)
    if not check_positive("lowest", lowest, "N/m") < check_positive("highest", highest, "N/m"):
        raise ParameterError("lowest", f"must be below the highest, {highest:g} N/m", lowest)
    if threshold is None:
        servo = servo.without_steps()
    else:
        threshold = check_positive("threshold", threshold, "m/s")
    if start is None:
        start = motion.at(np.zeros(1))[0]
    origin = check_array("start", start, (3,), "m")
    samples = _samples_for(duration, servo)

    def search_all(numbers: Sequence[int]) -> Iterator[tuple[int, Onset]]:
        batch = BatchSimulation(surface, plant, hand, servo, motion, origin, velocity)
        offsets = start_offsets(surface, int(starts))

        def search(number: int) -> onset_search.OnsetSearch:
            def trajectory(stiffness: float, start: int) -> Trajectory:
                rule = onset_search.limit_cycle_rule(samples, servo.period, threshold)
                return batch.new_trajectory(stiffness, delays[number], offsets[start], rule)

            bracketing = onset_search.bracket_onset(lowest, highest, width, nears[number])
            return onset_search.OnsetSearch(trajectory, len(offsets), bracketing, progress)

        searches = {number: search(number) for number in numbers}
        for number in onset_search.run_searches(batch, searches):
            yield (
                number,
                Onset(
                    surface.law.letter,
                    delays[number],
                    starts=len(offsets),
                    is_smooth_wall=surface.law is SMOOTH_WALL,
                    **searches[number].result()._asdict(),
                ),
            )
            if onset_callback is not None:
                onset_callback()

    contents = []
    for delay, near in zip(delays, nears, strict=True):
        numbers = tuple(origin), velocity, duration, starts, width, threshold, lowest, highest, near
        parts = plant, hand, replace(servo, delay=delay), motion
        contents.append(_cache_key(surface, parts, numbers))
    return get_or_compute_each("onset", contents, search_all)


def _cache_key(surface: Surface, parts: Sequence[Any], numbers: Sequence[Any]) -> str | None:
    """Return the content that an onset depends on; ``None`` for user-defined parts."""
    if not all(is_shipped(type(part)) for part in parts):
        return None
    values = [np.asarray(number).tolist() for number in numbers]
    return surface_content(surface, json_text([*parts, values]))


def _check_arguments(
    hand: Hand, motion: Motion, servo: Servo, duration: float, starts: int
) -> None:
    if hand.is_prescribed:
        raise ParameterError("hand", "must not prescribe the motion: such a handle never cycles")
    if check_positive("duration", duration, "s") < _MIN_SAMPLES * servo.period:
        raise ParameterError(
            "duration",
            f"must be at least {_MIN_SAMPLES} samples, {_MIN_SAMPLES * servo.period:g} s",
            duration,
        )
    if not is_at_rest(motion, duration):
        raise ParameterError("motion", "must be at rest in the second half of the run")
    if isinstance(starts, bool) or not (1 <= starts <= _MAX_STARTS and starts == int(starts)):
        raise ParameterError("starts", f"must be a whole number, 1 to {_MAX_STARTS}", starts)


# Relative tolerance of the characteristic numbers: far below the bracket of an onset.
TOLERANCE = 0.01


@dataclass(frozen=True)
class Prediction:
    """Stiffnesses that criteria allow, and the onset of limit cycles.

    Attributes:
        onset: onset in the simulation.
        depth: depth of the handle in the cycle [m], below the highest crest, or below z = 0 for
            laws
            on the nominal contact; the numbers hold for this depth.
        damping: σ₀ [N s/m], the least in the region that the handle reached.
        q: upper bound of the characteristic number, or its value if no bound is proved.
        one_sided: the same for the one-sided number.
        conservative: whether the law is conservative; only then is the delay rule a proof.
        paper_limit: limit of the paper's (1), σ₀/(2 T q) [N/m].
        delay_rule: σ₀/(T (q⁺/2 + d q)) [N/m], with friction that of its rule.
        wall_rule: the onset of the smooth wall at the same delay over q [N/m]; ``None`` if it was
            not simulated.
    """

    onset: Onset
    depth: float
    damping: float
    q: float
    one_sided: float
    conservative: bool
    paper_limit: float
    delay_rule: float
    wall_rule: float | None

    @property
    def violates_delay_rule(self) -> bool:
        """Whether a conservative law cycled below the delay rule.

        With exact positions it cannot; the proof does not cover encoder steps.
        """
        cycling = self.onset.cycling
        return self.conservative and math.isfinite(cycling) and cycling <= self.delay_rule

    @property
    def violates_wall_rule(self) -> bool:
        """Whether a loop cycled at a stiffness below K₀/q, with K₀ the onset of the wall."""
        return self.wall_rule is not None and self.onset.cycling < self.wall_rule

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        return {
            **self.onset.to_dict(),
            **attributes_to_dict(self, "depth", "damping", "q", "one_sided"),
            "paper_1": to_plain_data(self.paper_limit),  # equation (1) of the paper
            **attributes_to_dict(self, "delay_rule", "wall_rule", "conservative"),
            **attributes_to_dict(self, "violates_delay_rule", "violates_wall_rule"),
        }


def expected_onset(
    surface: Surface, plant: Plant, hand: Hand, servo: Servo, start: ArrayLike
) -> float | None:
    """Return the expected onset of limit cycles [N/m], by the delay rule.

    It uses the numbers at the surface's max_depth and the damping at the start; ``None`` without
    damping, or for a law without a Jacobian.

    Args:
        surface: texture, law and depth; its stiffness is not used.
        plant: plant of the simulation.
        hand: hand of the simulation.
        servo: servo with the delay of the simulation.
        start: initial position of the handle [m], shape (3,).
    """
    top = surface.law.contact.extremes(surface.texture)[1]
    damping = plant.min_damping(start, start, hand, top)
    plus = characteristic.one_sided_number(surface, TOLERANCE).value
    q = characteristic.characteristic_number(surface, TOLERANCE).value
    # Below a medial axis q is unbounded; most trajectories never reach it.
    if not math.isfinite(q):
        q = plus
    limit = _delay_rule(surface, damping / servo.period, plus, q, servo.delay)
    return limit if 0.0 < limit < math.inf else None


def predict(
    surface: Surface,
    plant: Plant,
    hand: Hand,
    servo: Servo,
    onset: Onset,
    wall: Onset | None = None,
) -> Prediction:
    """Return the stiffnesses that the criteria allow, with the simulated onset.

    Args:
        surface: texture and law; stiffness and max_depth are not used.
        plant: plant of the simulation.
        hand: hand of the simulation.
        servo: servo with the delay of the simulation.
        onset: simulated onset.
        wall: simulated onset of the smooth wall at the same delay.

    Reference:
        The paper's (1) and III.B; the delay rule is derived on the page "Passivity".
    """
    bottom, top = surface.law.contact.extremes(surface.texture)
    depth = max(top - onset.low[2], 0.0)
    limit = surface.texture.depth_limit
    damping = plant.min_damping(onset.low, onset.high, hand, top)
    q = 0.0
    plus = 0.0
    if onset.low[2] < bottom - limit:  # below a baked field nothing is certified
        q = math.inf
        plus = math.inf
    elif depth > 0.0:
        # Below the depth of a clamp the numbers are those of the clamped force.
        if depth <= surface.max_depth or not surface.effective_clamp.changes_force:
            surface = surface.to_depth(min(depth, limit))
        q = characteristic.characteristic_number(surface, TOLERANCE).value
        plus = characteristic.one_sided_number(surface, TOLERANCE).value
    budget = damping / servo.period
    wall_rule = None
    if wall is not None and q != 0.0:
        wall_rule = wall.quiet / q
    return Prediction(
        onset=onset,
        depth=depth,
        damping=damping,
        q=q,
        one_sided=plus,
        conservative=surface.facts.conservative,
        paper_limit=_limit(0.5 * budget, q),
        delay_rule=_delay_rule(surface, budget, plus, q, servo.delay),
        wall_rule=wall_rule,
    )


def _delay_rule(surface: Surface, budget: float, plus: float, q: float, delay: int) -> float:
    """Return the limit of k (q⁺/2 + d q) + (3d + 1)/2 κ <= budget [N/m]."""
    weight = 0.5 * plus
    if delay:  # q may be infinite
        weight += delay * q
    if surface.contact_friction is not None:
        gain, rest = add_friction(surface, weight, Fraction(budget), Fraction(3 * delay + 1, 2))
        return _limit(max(float(rest), 0.0), float(gain))
    return _limit(budget, weight)


def _limit(budget: float, weight: float) -> float:
    """Return the stiffness whose weight uses up a budget [N/m]; infinite without a weight."""
    if weight > 0.0:
        return budget / weight
    return math.inf


def smooth_wall_onset(onsets: Sequence[Onset], delay: int) -> Onset | None:
    """Return the onset of the smooth wall at a delay, if there is one."""
    return next((onset for onset in onsets if onset.is_smooth_wall and onset.delay == delay), None)
