"""Random scenes with conservative laws: is the delay rule ever violated?

k (q⁺/2 + d q) <= σ₀/T says that a conservative field with d samples of delay never gives more than
the damping of the device takes. Each scene starts out of contact, where the field's energy is zero
and no force waits, with an undamped hand; then at every sample the work that the texture has done
is at most what the device's damping has taken, so no limit cycle can last.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np
from rich.console import Console
from rich.progress import track

from asperity.analysis import characteristic_number, one_sided_number
from asperity.checks import FloatArray
from asperity.simulation import Cartesian, Run, Servo, SpringHand, Still, simulate_many
from asperity.surface import Surface
from asperity.textures import Sinusoid

SAMPLES = 8000
LAWS = "WCDH"
# Share of a scene's exchanged energy that rounding may add.
ROUNDING = 1e-11


@dataclass(frozen=True)
class Scene:
    """A scene and the largest stiffness for which the delay rule is proved.

    Attributes:
        job: arguments of :func:`~asperity.simulation.simulate`.
        limit: σ₀/(T (q⁺/2 + d q)) [N/m].
    """

    job: dict[str, Any]
    limit: float


@dataclass(frozen=True)
class Outcome:
    """What became of a scene.

    Attributes:
        counted: whether it stayed in the region for which the numbers hold, and touched.
        excess: greatest value over time of the texture's work less the damping's loss, as a share
            of the exchanged energy.
        cycles: whether it still moves as much in the last quarter as in the one before, and the
            texture makes up for at least half of the loss.
        share: greatest value over time of the texture's work over the damping's loss.
    """

    counted: bool
    excess: float
    cycles: bool
    share: float


def scenes(count: int, seed: int, factor: tuple[float, float] = (0.4, 1.0)) -> Iterator[Scene]:
    """Yield random scenes with stiffness a random share of the limit."""
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield _scene(rng, factor)


def _scene(rng: np.random.Generator, factor: tuple[float, float]) -> Scene:
    law = LAWS[rng.integers(len(LAWS))]
    # D has no finite q below its crests: no delay.
    delay = 0 if law == "D" else int(rng.integers(6))
    period = float(10.0 ** rng.uniform(-4.0, -3.0))
    # Coupled axes for the laws that cost little: each combination is compiled by itself.
    plant = Cartesian(rng.uniform(0.01, 0.2, 3), _damping(rng, coupled=law in "WC"))
    length = float(rng.uniform(0.5e-3, 4e-3))
    texture = Sinusoid(
        length * float(rng.uniform(0.02, 0.3)), length, float(rng.uniform(0.0, 6.0)),
        (1.0, float(rng.normal())),
    )  # fmt: skip
    depth = float(rng.uniform(0.2e-3, 2e-3))
    limit = _limit(Surface(texture, law, 1.0, depth), plant, delay, period)
    surface = Surface(texture, law, limit * float(rng.uniform(*factor)), depth)
    job = {
        "surface": surface, "plant": plant, "hand": _hand(rng, surface, depth),
        "servo": Servo(period, delay=delay), "motion": Still((0.0, 0.0, 0.0)),
        "duration": SAMPLES * period,
        "start": (0.0, 0.0, texture.amplitude + float(rng.uniform(0.0, 0.5e-3))),
        "velocity": depth / period * 0.02 * rng.normal(size=3) * [1.0, 1.0, 0.5],
    }  # fmt: skip
    return Scene(job, limit)


def _damping(rng: np.random.Generator, *, coupled: bool) -> FloatArray:
    turned, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    values = rng.uniform(0.5, 5.0) * np.array([1.0, *rng.uniform(1.0, 2.0, 2)])
    matrix = turned * values @ turned.T
    return np.asarray(0.5 * (matrix + matrix.T) if coupled else np.diag(values))


def _hand(rng: np.random.Generator, surface: Surface, depth: float) -> SpringHand:
    """Press so that it stays within the depth, and keep it near by a soft spring."""
    press = surface.stiffness * depth * float(rng.uniform(0.05, 0.5))
    spring = surface.stiffness * float(rng.uniform(0.0, 0.1))
    mass = float(rng.uniform(0.0, 0.1))
    return SpringHand(spring, mass=mass, force=(*(0.3 * press * rng.normal(size=2)), -press))


def _limit(unit: Surface, plant: Cartesian, delay: int, period: float) -> float:
    plus = one_sided_number(unit).upper
    share = 0.5 * plus + (delay * characteristic_number(unit).upper if delay else 0.0)
    return float(np.linalg.eigvalsh(plant.damping)[0]) / (period * share)


def outcome(scene: Scene, run: Run) -> Outcome:
    """Return what became of a scene."""
    surface: Surface = scene.job["surface"]
    places = run.position
    depths = -places[:, 2]
    if surface.law.letter != "W":
        depths = surface.texture.height(places[:, :2]) + depths
    # C's numbers hold down to its depth; those of W and H, and q⁺ of D, at any depth.
    within = surface.law.letter != "C" or float(depths.max()) <= surface.max_depth
    energies = run.energies
    work, loss = energies["supplied"].sum(axis=1), energies["lost"]
    quarter = len(places) // 4
    before, last = (_rms(run.velocity[-i * quarter :][:quarter]) for i in (2, 1))
    fed, lost = work[-1] - work[-quarter], loss[-1] - loss[-quarter]
    return Outcome(
        bool(within and depths.max() > 0.0),
        float((work - loss).max()) / run.ledger.exchanged,
        bool(run.stopped or (last > 1e-4 and last > 0.98 * before and fed > 0.5 * lost)),
        float((work[loss > 0.0] / loss[loss > 0.0]).max()),
    )


def _rms(velocity: FloatArray) -> float:
    return float(np.sqrt((velocity**2).sum(axis=1).mean()))


def outcomes(some: list[Scene]) -> list[Outcome]:
    """Return what becomes of some scenes."""
    runs = simulate_many([scene.job for scene in some])
    return [outcome(scene, run) for scene, run in zip(some, runs, strict=True)]


def delay_rule(count: int, seed: int, console: Console) -> int:
    """Print how often the delay rule is violated, and the negative control; 1 if it ever is."""
    found: list[Outcome] = []
    for first in track(range(0, count, 200), "random scenes", console=console, transient=True):
        found += outcomes(list(scenes(min(200, count - first), seed + first)))
    counted = [each for each in found if each.counted]
    broken = [each for each in counted if each.excess > ROUNDING or each.cycles]
    control = outcomes(list(scenes(200, seed, (6.0, 12.0))))
    console.print(
        f"{count} random scenes, {len(counted)} in contact and within the depth of their numbers: "
        f"{len(broken)} violate the delay rule; their texture's work is at "
        f"most {max(each.share for each in counted):.4f} of the loss"
    )
    gained = sum(each.excess > ROUNDING for each in control)
    cycling = sum(each.cycles for each in control)
    console.print(
        f"control, 6 to 12 times the limit: of 200, {gained} gain energy and {cycling} cycle"
    )
    return int(bool(broken))
