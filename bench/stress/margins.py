"""How far below K₀/q a law must stay: the safety margins, from random admissible loops.

``python -m bench.stress.margins`` simulates random loops of every law in which a smooth wall of K₀
is just passive, and writes ``src/asperity/analysis/passivity/margins.toml``, which the program
reads.

A loop is admissible if the wall test may have been made on it: the handle is damped by
K₀ (1/2 + d) T against the wall. What the test does not tell is random: masses, the delay, the
damping along other directions (0.2 to 1 of that along the normal, in half of the loops about
oblique axes; a quarter isotropic), the grip (5 to 500 N/m or none, on every axis), the place on the
texture, the pressing force, and the texture. The handle starts at the surface, at up to 0.1 m/s.
A loop cycles if its motion lasts without steps of position and force and is one that a hand feels.

The factor is the greatest of ``FACTORS`` up to which at most 1 % of the loops cycle, at that factor
and at those below it. The share is then counted in further loops, and printed with the factor.

Above it the share is counted up to K₀/q itself: the curve, for other risks than 1 %. ``--rates``
counts at the factor in loops of 100 Hz to 10 kHz whose K₀ was tested at 1 kHz.
"""

from __future__ import annotations

import argparse
import itertools
import math
import sys
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from rich.console import Console

from asperity.analysis import characteristic_number
from asperity.analysis.passivity.recommended_stiffness import load_margins
from asperity.laws import LAWS as LAWS_BY_LETTER
from asperity.loop import lane_loop
from asperity.scene.sweeps import map_threads
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary
from asperity.simulation.lanes import BatchSimulation, StopRule, Trajectory
from asperity.simulation.onset_search import limit_cycle_rule
from asperity.simulation.trace import SegmentStatistics
from asperity.surface import Surface
from asperity.textures import Fourier, Sinusoid
from asperity.textures.texture import Texture

TARGET = Path(__file__).parents[2] / "src/asperity/analysis/passivity/margins.toml"
LAWS = "ABCDEFGH"
FACTORS = (0.02, 0.03, 0.05, 0.07, 0.1, 0.14, 0.2, 0.25, 0.3, 0.4, 0.5, 0.6, 0.7, 0.85, 1.0)
MAX_SHARE = 0.01
CEILINGS = {"A": 0.09, "E": 0.39}
"""Onset over K₀/q of the paper's pantograph held loosely, which is not among the random loops."""
SEARCH_LOOPS, LOOPS = 500, 2000
SEED = 20261124
DURATION = 1.0  # [s] of the first run; one that still moves is extended to 256 times as long
DELAYS = (0, 0, 1, 2, 6)
MAX_GAIN = 50.0  # a law whose q is greater has no start to speak of
CURVE_FACTORS = (0.1, 0.2, 0.3, 0.5, 0.7, 1.0)
CURVE_LOOPS = 1000
RATES = 100.0, 10_000.0  # [Hz] of the loops of ``--rates``
WALL_RATE = 1000.0  # [Hz] at which their K₀ was tested


@dataclass(frozen=True)
class RandomLoop:
    """A random admissible loop.

    Attributes:
        number: of the loop in its seed.
        texture: the surface.
        depth: max_depth [m].
        wall: K₀ [N/m].
        period: T [s].
        delay: [samples].
        mass: of the device along x, y, z [kg].
        shares: damping along the principal axes over that along the normal.
        axes: the principal axes of the damping, in rows.
        grip: stiffness of the hand along x, y, z [N/m].
        grip_damping: of the hand [N s/m].
        press: pressing force over that which the law gives at full depth.
        place: start along x over the period.
        velocity: at the start [m/s].
    """

    number: int
    texture: Texture
    depth: float
    wall: float
    period: float
    delay: int
    mass: tuple[float, ...]
    shares: tuple[float, ...]
    axes: np.ndarray
    grip: tuple[float, ...]
    grip_damping: float
    press: float
    place: float
    velocity: tuple[float, ...]

    @property
    def damping(self) -> np.ndarray:
        """Damping of the device [N s/m], shape (3, 3): a wall of K₀ is just passive.

        The wall pulls along z alone, and the handle may give way along it: it feels 1/(B⁻¹)_zz.
        """
        matrix = self.axes.T @ np.diag(self.shares) @ self.axes
        normal = 1.0 / np.linalg.inv(matrix)[2, 2]
        return np.asarray(matrix * self.wall * (0.5 + self.delay) * self.period / normal)

    @property
    def lightest(self) -> float:
        """Least damping of any direction over that which the wall needs."""
        needed = self.wall * (0.5 + self.delay) * self.period
        return float(np.linalg.eigvalsh(self.damping)[0] / needed)

    @property
    def weakest_axis(self) -> float:
        """Least damping that a wall along x, y or z feels, over that which the wall needs."""
        needed = self.wall * (0.5 + self.delay) * self.period
        return float(1.0 / np.linalg.inv(self.damping).diagonal().max() / needed)

    def surface(self, law: str) -> Surface:
        """Return the surface with a law, as a device renders it."""
        return Surface(self.texture, law, max_depth=self.depth)


@dataclass(frozen=True)
class Motion:
    """A motion that lasts.

    Attributes:
        loop: number of the loop.
        speed: RMS speed, summed over the axes [m/s].
        extent: RMS displacement, summed over the axes [m].
        norm: RMS of the norm of the velocity [m/s].
    """

    loop: int
    speed: float
    extent: float
    norm: float


AT_REST = Motion(0, 0.0, 0.0, 0.0)


@dataclass(frozen=True)
class MarginResult:
    """What was found for a law: the factor, the loops simulated there, and those that cycled."""

    factor: float
    loops: int
    motions: tuple[Motion, ...]

    @property
    def cycles(self) -> int:
        """How many loops cycled."""
        return len(self.motions)

    @property
    def share(self) -> float:
        """Share of the loops that cycled."""
        return self.cycles / self.loops


def random_texture(rng: np.random.Generator) -> Texture:
    """Return a sinusoid, or two harmonics whose profile is not symmetric."""
    period, steepness = _log_uniform(rng, 0.5e-3, 5e-3), _log_uniform(rng, 0.01, 0.8)
    amplitude = steepness * period
    if rng.random() < 0.8:
        return Sinusoid(amplitude, period)
    wave = 2.0 * math.pi / period
    share, phase = rng.uniform(0.1, 0.5), rng.uniform(0.0, 2.0 * math.pi)
    return Fourier([amplitude, share * amplitude], [[wave, 0.0], [2.0 * wave, 0.0]], [0.0, phase])


def _log_uniform(rng: np.random.Generator, low: float, high: float) -> float:
    return float(math.exp(rng.uniform(math.log(low), math.log(high))))


def random_loop(seed: int, number: int) -> RandomLoop:
    """Return a random loop; the same for the same numbers."""
    rng = np.random.default_rng([seed, number])
    texture = random_texture(rng)
    isotropic = rng.random() < 0.25
    mass = _log_uniform(rng, 0.03, 0.4)
    lateral = [1.0, 1.0] if isotropic else rng.uniform(0.2, 1.0, 2).tolist()
    ratios = [1.0, 1.0, 1.0] if isotropic else rng.uniform(0.5, 1.5, 3).tolist()
    firm = np.exp(rng.uniform(math.log(5.0), math.log(500.0), 3))
    firm *= rng.random(3) < (0.9, 0.9, 0.5)
    return RandomLoop(
        number,
        texture,
        min(texture.peak_to_valley, 1e-3),
        wall=_log_uniform(rng, 500.0, 10_000.0),
        period=float(rng.choice([1e-3, 2.5e-4])),
        delay=int(rng.choice(DELAYS)),
        mass=tuple(mass * one for one in ratios),
        shares=(*lateral, 1.0),
        axes=_random_axes(rng) if rng.random() < 0.5 else np.eye(3),
        grip=tuple(firm.tolist()),
        grip_damping=_log_uniform(rng, 0.02, 2.0),
        press=float(rng.uniform(0.05, 0.7)),
        place=float(rng.random()),
        velocity=tuple((rng.uniform(0.0, 0.1) * _random_axes(rng)[0]).tolist()),
    )


def to_random_rate(loop: RandomLoop, seed: int) -> RandomLoop:
    """Return a loop at an update rate between 100 Hz and 10 kHz, with the K₀ allowed there.

    Below ``WALL_RATE`` the damping is that of the test at ``WALL_RATE``; above it less, as if the
    same wall had been tested at the higher rate.
    """
    rate = _log_uniform(np.random.default_rng([seed, loop.number, 1]), *RATES)
    return replace(loop, period=1.0 / rate, wall=loop.wall * min(1.0, rate / WALL_RATE))


def _random_axes(rng: np.random.Generator) -> np.ndarray:
    return np.linalg.qr(rng.standard_normal((3, 3)))[0]


def admissible_loops(law: str, seed: int) -> Iterator[tuple[RandomLoop, float]]:
    """Yield random loops of a law that has a start to speak of, with q of its surface."""
    for number in itertools.count():
        loop = random_loop(seed, number)
        q = characteristic_number(loop.surface(law), 0.05).value
        if q <= MAX_GAIN:
            yield loop, q


def lasting_motion(
    loop: RandomLoop, law: str, stiffness: float, steps: tuple[float, float] = (0.0, 0.0)
) -> Motion | None:
    """Return the motion of a loop that lasts and that a hand feels; ``None`` if there is none.

    Args:
        loop: the loop.
        law: letter of the law.
        stiffness: [N/m].
        steps: steps of position [m] and force [N].
    """
    servo = Servo(loop.period, loop.delay, *steps)
    hand_force = loop.press * stiffness * loop.depth
    hand = SpringHand(loop.grip, loop.grip_damping, 0.0, (0.0, 0.0, -hand_force))
    surface = loop.surface(law)
    top = surface.law.contact.extremes(loop.texture)[1]
    x = loop.place * loop.texture.scan_line().length
    start = np.array([x, 0.0, top + 0.05 * loop.depth])
    if loop.grip[2] > 0.0:  # held at a height from which the spring presses as hard as the force
        start[2] = top
    batch = BatchSimulation(
        surface,
        Cartesian(loop.mass, loop.damping),
        hand,
        servo,
        Stationary(tuple(start)),
        start,
        loop.velocity,
    )
    seen: list[SegmentStatistics] = []
    rule = limit_cycle_rule(lambda times: round(times * DURATION / loop.period), loop.period)
    run = batch.new_trajectory(stiffness, loop.delay, np.zeros(3), _record(rule, seen))
    while run.verdict is None:
        batch.run([run])
    if not run.verdict:
        return None
    spread, extent = seen[-1].velocity_spread, seen[-1].position_spread
    return Motion(loop.number, spread, extent, _speed_norm(run, seen))


def _speed_norm(run: Trajectory, seen: list[SegmentStatistics]) -> float:
    """Return the RMS of the norm of the velocity since the last evaluation but one [m/s]."""
    count = seen[-1].samples - (seen[-2].samples if len(seen) > 1 else 0)
    sums, squares = (
        run.statistics[first : first + 3]
        for first in (lane_loop.VELOCITY_SUM, lane_loop.VELOCITY_SQUARES)
    )
    return math.sqrt(float(np.sum(squares / count - (sums / count) ** 2)))


def _record(rule: StopRule, seen: list[SegmentStatistics]) -> StopRule:
    """Evaluate a rule, and keep the statistics that it was given."""
    goal = next(rule)
    while True:
        seen.append((yield goal))
        try:
            goal = rule.send(seen[-1])
        except StopIteration as end:
            return bool(end.value)


def count_cycles(
    law: str,
    factor: float,
    count: int,
    seed: int,
    along_lightest: bool = False,
    any_rate: bool = False,
) -> MarginResult:
    """Return what becomes of random loops at a factor of K₀/q.

    Args:
        law: letter of the law.
        factor: stiffness over K₀/q.
        count: number of loops.
        seed: of the loops.
        along_lightest: whether K₀ is that of the weakest of the three axes, as a calibration
            measures it.
        any_rate: whether the loops have update rates from 100 Hz to 10 kHz.
    """
    loops = admissible_loops(law, seed)

    def motion(loop: RandomLoop, q: float) -> Motion | None:
        if any_rate:
            loop = to_random_rate(loop, seed)
        wall = loop.wall * (loop.weakest_axis if along_lightest else 1.0)
        return lasting_motion(loop, law, factor * wall / q)

    found = map_threads(motion, [next(loops) for _ in range(count)])
    return MarginResult(factor, count, tuple(one for one in found if one is not None))


def find_factor(law: str, along_lightest: bool, count: int, console: Console) -> float:
    """Return the greatest factor up to which at most 1 % of the loops cycle.

    Factors are tried upwards; the least is returned if more cycle there.
    """
    best = FACTORS[0]
    for factor in FACTORS:
        result = count_cycles(law, factor, count, SEED, along_lightest)
        console.print(f"{law}: {result.cycles} of {count} loops at {factor:g}")
        if result.share > MAX_SHARE:
            break
        best = factor
    return best


def measure(
    law: str, along_lightest: bool, console: Console, search: int, count: int
) -> MarginResult:
    """Return the factor of a law and the loops at it, reduced until at most 1 % of them cycle."""
    best = find_factor(law, along_lightest, search, console)
    ceiling = CEILINGS.get(law, 1.0)
    factors = [*(one for one in FACTORS if one <= min(best, ceiling)), min(best, ceiling)]
    while True:
        result = count_cycles(law, factors.pop(), count, SEED + 1, along_lightest)
        console.print(f"{law}: {result.cycles} of {count} further loops at {result.factor:g}")
        if result.share <= MAX_SHARE or not factors:
            return result


def measure_curve(
    law: str, along_lightest: bool, factor: float, console: Console, count: int
) -> list[str]:
    """Return lines of the curve of a law: factor, cycles, and the fastest motion there."""
    points = []
    for tried in (factor, *(one for one in CURVE_FACTORS if one > factor)):
        result = count_cycles(law, tried, count, SEED + 1, along_lightest)
        console.print(f"{law}: {result.cycles} of {count} loops at {tried:g}")
        worst = max(result.motions, key=lambda motion: motion.speed, default=AT_REST)
        numbers = f"{tried:g}, {result.cycles}, {worst.speed:.3g}, {worst.extent:.3g}"
        points.append(f"[{numbers}]")
    return [f"curve_loops = {count}", f"curve = [{', '.join(points)}]"]


def count_at_any_rate(law: str, along_lightest: bool, console: Console, count: int) -> int:
    """Return 1 if at the factor more loops cycle than stated, at rates of 100 Hz to 10 kHz."""
    factor = load_margins(along_lightest)[LAWS_BY_LETTER[law]].factor
    result = count_cycles(law, factor, count, SEED + 2, along_lightest, any_rate=True)
    console.print(f"{law}: {result.cycles} of {count} loops at {factor:g}, 100 Hz to 10 kHz")
    return int(result.share > MAX_SHARE)


def write_margins(
    found: dict[tuple[str, bool], tuple[MarginResult, list[str]]], path: Path = TARGET
) -> None:
    """Write the margins: factor, loops, cycles, the fastest motion, and the curve of each law."""
    lines = [
        "# Written by `python -m bench.stress.margins`: random loops in which a smooth wall of",
        "# K₀ is just passive. factor: stiffness over K₀/q at which at most 1 % of the loops",
        "# cycle, of the factors tried; loops, cycles: simulated there, and how many sustain a",
        "# motion that a hand feels; speed [m/s], extent [m]: RMS of the fastest of these.",
        "# lightest: the same with K₀ along the weakest of three axes, as `asperity calibrate`",
        "# measures it. A and E: at most the factor at which a pantograph held loosely cycles,",
        "# which is not among the random loops. curve: factor, loops that cycle of curve_loops,",
        "# speed and extent of the fastest, from the factor up to 1, K₀/q itself.",
    ]
    for (law, along), (one, curve) in found.items():
        worst = max(one.motions, key=lambda motion: motion.speed, default=AT_REST)
        lines += [
            "",
            f"[{'lightest' if along else 'normal'}.{law}]",
            f"factor = {one.factor:g}",
            f"loops = {one.loops}",
            f"cycles = {one.cycles}",
            f"speed = {worst.speed:.3g}",
            f"extent = {worst.extent:.3g}",
            *([f"ceiling = {CEILINGS[law]:g}"] if law in CEILINGS else []),
            *curve,
        ]
    path.write_text("\n".join(lines) + "\n", encoding="utf-8")


def main(arguments: list[str]) -> int:
    """Run the command line."""
    parser = argparse.ArgumentParser(description=(__doc__ or "").partition("\n")[0])
    parser.add_argument("--laws", default=LAWS, help="laws; only all of them are written")
    parser.add_argument("--loops", type=int, default=LOOPS, help="loops at the factor found")
    parser.add_argument("--rates", action="store_true", help="count at any update rate instead")
    options = parser.parse_args(arguments)
    console = Console(width=120, highlight=False)
    cases = [(law, along) for law in options.laws for along in (False, True)]
    if options.rates:
        return max(count_at_any_rate(law, along, console, options.loops) for law, along in cases)
    found = {}
    for law, along in cases:
        result = measure(law, along, console, SEARCH_LOOPS, options.loops)
        curve = measure_curve(law, along, result.factor, console, CURVE_LOOPS)
        found[law, along] = result, curve
    if options.laws == LAWS:
        write_margins(found)
    return 0


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
