"""Random scenes with encoders, dry friction and delay: is a buzz ever above its bound?

``python -m bench.stress.random_steps COUNT [SEED]``: the rule "steps and friction" says that
a held force is off by at most φ = k q |δ|/2 + |b|/2, that friction of at least φ keeps everything
still in the end, and that otherwise no motion that lasts is faster than (φ - f_c)/(m T) RMS. Each
scene is asked of the program itself, then simulated. The control tells the program steps half as
long as they are: the rule, with half of ε, must break.
"""

from __future__ import annotations

import sys
from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track

from asperity.analysis import characteristic_number, one_sided_number
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.passivity.criteria import DELAY, QUANTIZATION
from asperity.analysis.passivity.verdict import passivity
from asperity.devices import parse_device
from asperity.simulation import Cartesian, Run, Servo, SpringHand, Stationary, simulate_many
from asperity.surface import Surface
from asperity.textures import Sinusoid

SAMPLES = 6000
LONGER = 16  # times so long for what seems to last above its bound
LAWS = "WCH"  # continuous and conservative: D has no Lipschitz constant near its ridges
STILL = 1e-7  # [m/s] RMS, what counts as rest: the rounding of positions near 1 mm over T
_AT_ONCE = 200


@dataclass(frozen=True)
class QuantisedScene:
    """A scene with what the program says of it.

    Attributes:
        job: arguments of :func:`~asperity.simulation.simulate`.
        silent: whether friction is said to silence every buzz.
        speed: bound of the RMS speed [m/s].
        depth: to which the numbers hold [m]; infinite for laws whose numbers hold at any.
    """

    job: dict[str, Any]
    silent: bool
    speed: float
    depth: float


def scenes(count: int, seed: int, *, is_halved: bool = False) -> Iterator[QuantisedScene]:
    """Yield random scenes.

    Args:
        count: how many.
        seed: of the draw.
        is_halved: whether the program is told half of the position step, with a friction that would
            just silence what half of it may cause.
    """
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield _scene(rng, is_halved=is_halved)


def _scene(rng: np.random.Generator, *, is_halved: bool) -> QuantisedScene:
    law, delay = LAWS[rng.integers(len(LAWS))], int(rng.integers(4))
    period = float(10.0 ** rng.uniform(-4.0, -3.0))
    damping = float(rng.uniform(0.5, 5.0))
    length = float(rng.uniform(0.5e-3, 4e-3))
    texture = Sinusoid(length * float(rng.uniform(0.02, 0.2)), length, float(rng.uniform(0.0, 6.0)))
    depth = float(rng.uniform(0.5e-3, 2e-3))
    unit = Surface(texture, law, 1.0, depth)
    numbers = characteristic_number(unit), one_sided_number(unit)
    budget = damping / period / (0.5 * numbers[1].upper + delay * numbers[0].upper)
    k = budget * float(rng.uniform(0.3, 0.98))
    surface = unit.to_stiffness(k)
    step = float(10.0 ** rng.uniform(-6.0, -4.3))
    force_step = k * step * float(rng.choice([0.0, rng.uniform(0.0, 1.0)]))
    along = np.sqrt(3.0)
    phi = 0.5 * along * (k * numbers[0].upper * step + force_step)
    friction = phi * float(rng.choice([0.0, rng.uniform(0.5, 0.99), rng.uniform(1.01, 1.5)]))
    if is_halved:
        force_step, friction = 0.0, 0.505 * 0.5 * along * k * numbers[0].upper * step
    rig = {
        "damping": damping,
        "update_rate": 1.0 / period,
        "delay_samples": delay,
        "position_resolution": 0.5 * step if is_halved else step,
        "force_resolution": force_step,
        "least_friction": friction,
    }
    known = {name: value for name, value in rig.items() if value}
    judged = passivity(
        surface,
        parse_device({"delay_samples": delay, **known}, "drawn"),
        *numbers,
        worst_loop(surface),
    )
    assert judged.criterion(DELAY).holds or judged.criterion("one-sided").holds
    press = k * depth * float(rng.uniform(0.05, 0.4))
    # A spring that ends a slide of the hand within the longer run: the bound is of what repeats.
    hand = SpringHand(
        k * float(rng.uniform(0.02, 0.1)),
        mass=float(rng.uniform(0.0, 0.1)),
        force=(*(0.2 * press * rng.normal(size=2)), -press),
    )
    job = {
        "surface": surface,
        "hand": hand,
        "plant": Cartesian(rng.uniform(0.01, 0.2, 3), damping, friction=friction),
        "servo": Servo(period, delay=delay, position_resolution=step, force_resolution=force_step),
        "motion": Stationary((0.0, 0.0, 0.0)),
        "duration": SAMPLES * period,
        "start": (0.0, 0.0, texture.amplitude + float(rng.uniform(0.0, 0.3e-3))),
        "velocity": 0.02 * depth / period * rng.normal(size=3),
    }
    silent = bool(judged.criterion(QUANTIZATION).holds)
    bound = 0.0 if silent or judged.buzz is None else judged.buzz.speed
    # C's numbers hold down to its depth, those of W and H at any.
    return QuantisedScene(job, silent, bound, depth if law == "C" else np.inf)


def tail_speed(run: Run) -> float:
    """Return the RMS speed, by way per sample, of the last quarter of a run [m/s]."""
    places = run.position[-(len(run.position) // 4) :]
    steps = np.diff(places, axis=0)
    return float(np.sqrt(np.square(steps).sum(axis=1).mean()) / run.period)


def is_creeping(run: Run) -> bool:
    """Return whether the last quarter goes somewhere, so that it does not repeat itself.

    A hand that is pulled aside, whose friction a faint trembling loosens, creeps home for long: its
    way from beginning to end is a good part of the way that it went. That of a buzz is not.
    """
    places = run.position[-(len(run.position) // 4) :]
    way = tail_speed(run) * run.period * (len(places) - 1)
    return float(np.linalg.norm(places[-1] - places[0])) > 0.3 * way


def _deepest(scene: QuantisedScene, run: Run) -> float:
    """Return the depth that is reached below the texture, or the plane of the smooth wall [m]."""
    texture, places = scene.job["surface"].texture, run.position
    if not scene.job["surface"].depends_on_texture:
        return float(-places[:, 2].min())
    return float((texture.height(places[:, :2]) - places[:, 2]).max())


def shares(batch: list[QuantisedScene]) -> list[float]:
    """Return speed over bound, for scenes that stay where their numbers hold.

    A silent scene counts as 0 if it comes to rest, else as infinite. What is above its bound is run
    longer: it may only not have settled; and one that then still creeps counts as 0.
    """
    runs = simulate_many([scene.job for scene in batch])
    found = []
    for scene, run in zip(batch, runs, strict=True):
        if run.stop_message or not 0.0 < _deepest(scene, run) <= scene.depth:
            continue  # not where the numbers hold, or still on its way to the surface
        share = _share(scene, tail_speed(run))
        if share > 1.0:
            longer = {**scene.job, "duration": LONGER * scene.job["duration"]}
            (lasting,) = simulate_many([longer])
            share = 0.0 if is_creeping(lasting) else _share(scene, tail_speed(lasting))
        found.append(share)
    return found


def _share(scene: QuantisedScene, moving: float) -> float:
    if moving <= STILL:
        return 0.0
    return moving / scene.speed if scene.speed > 0.0 else np.inf


def steps_rule(count: int, seed: int, console: Console) -> int:
    """Print how near to its bound a buzz comes, and the control; return 1 if one is above."""
    found: list[float] = []
    silent = 0
    for first in track(range(0, count, _AT_ONCE), "random scenes", console=console, transient=True):
        some = list(scenes(min(_AT_ONCE, count - first), seed + first))
        silent += sum(scene.silent for scene in some)
        found += shares(some)
    above = sum(share > 1.0 for share in found)
    console.print(
        f"{count} random scenes with encoders, {silent} of them silenced by friction, {len(found)} "
        f"within the depth of their numbers: {above} above the bound or not at rest; "
        f"{sum(share > 0.0 for share in found)} buzz, at most at {max(found):.3f} of the bound"
    )
    control = shares(list(scenes(min(count, 1000), seed, is_halved=True)))
    broken = sum(share > 1.0 for share in control)
    console.print(f"control, half of ε: {broken} of {len(control)} are above the bound")
    return int(above > 0 or broken == 0)


if __name__ == "__main__":
    number, seed = (*map(int, sys.argv[1:]), 1)[:2]
    sys.exit(steps_rule(number, seed, Console(width=100, highlight=False)))
