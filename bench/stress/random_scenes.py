"""Random scenes with conservative laws: does one cycle that the program calls passive?

k (q⁺/2 + d q) <= σ₀/T says that a conservative field with d samples of delay never gives more than
the damping of the device takes. Each scene starts out of contact, where the field's energy is zero
and no force waits, with an undamped hand; then at every sample the work that the texture has done
is at most what the device's damping has taken, so no limit cycle can last.

The verdict is asked of the program with least damping, rate and delay alone. All else is drawn at
random: masses, damping along the other directions, the hand, the start. The control asks the rule
used before: K₀/q⁺, with K₀ where a heavy handle's wall cycles along its normal, on devices damped
6 to 12 times as much there as along the other directions.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from asperity.analysis import characteristic_number, one_sided_number
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.passivity.verdict import passivity
from asperity.core.checks import FloatArray
from asperity.devices import parse_device
from asperity.simulation import Cartesian, Run, Servo, SpringHand, Stationary, simulate_many
from asperity.surface import Surface
from asperity.textures import Sinusoid

SAMPLES = 8000
LAWS = "WCDH"
# Share of a scene's exchanged energy that rounding may add.
ROUNDING = 1e-11


@dataclass(frozen=True)
class Scene:
    """A scene, with what the program says of it.

    Attributes:
        job: arguments of :func:`~asperity.simulation.simulate`.
        passive: whether the program calls it passive.
    """

    job: dict[str, Any]
    passive: bool


@dataclass(frozen=True)
class SceneOutcome:
    """What became of a scene.

    Attributes:
        is_valid: whether it stayed in the region for which the numbers hold, and touched.
        excess: greatest value over time of the texture's work less the damping's loss, as a share
            of the exchanged energy.
        cycles: whether it still moves as much in the last quarter as in the one before, and the
            texture makes up for at least half of the loss; a slide over D's ridges does so for a
            while, so that what seems to cycle is watched for longer.
        share: greatest value over time of the texture's work over the damping's loss.
    """

    is_valid: bool
    excess: float
    cycles: bool
    share: float


def scenes(
    count: int, seed: int, factor: tuple[float, float] | None = (0.4, 1.0)
) -> Iterator[Scene]:
    """Yield random scenes.

    Args:
        count: how many.
        seed: of the draw.
        factor: range of the stiffness as a share of what is proved; ``None`` for the old rule,
            K₀/q⁺.
    """
    rng = np.random.default_rng(seed)
    for _ in range(count):
        yield _scene(rng, factor)


def _scene(rng: np.random.Generator, factor: tuple[float, float] | None) -> Scene:
    law = LAWS[rng.integers(len(LAWS))]
    # D has no finite q below its crests: no delay.
    delay = 0 if law == "D" else int(rng.integers(6))
    period = float(10.0 ** rng.uniform(-4.0, -3.0))
    # Coupled axes for the laws that cost little: each combination is compiled by itself.
    plant = Cartesian(
        rng.uniform(0.01, 0.2, 3), _damping(rng, coupled=law in "WC", uneven=factor is None)
    )
    length = float(rng.uniform(0.5e-3, 4e-3))
    texture = Sinusoid(
        length * float(rng.uniform(0.02, 0.3)),
        length,
        float(rng.uniform(0.0, 6.0)),
        (1.0, float(rng.normal())),
    )
    depth = float(rng.uniform(0.2e-3, 2e-3))
    unit = Surface(texture, law, 1.0, depth)
    share = float(rng.uniform(*(factor or (0.9, 1.0))))
    numbers = characteristic_number(unit), one_sided_number(unit)
    rig = {
        "damping": float(np.linalg.eigvalsh(plant.damping)[0]),
        "update_rate": 1.0 / period,
        "delay_samples": delay,
    }
    if factor is None:
        wall = plant.damping[2, 2] / ((delay + 0.5) * period)
        stiffness = share * wall / numbers[1].upper
    else:
        allowed = passivity(
            unit, parse_device(rig, "drawn"), *numbers, worst_loop(unit)
        ).stability_limit
        stiffness = share * (allowed.stiffness or 0.0)
    surface = Surface(texture, law, stiffness, depth)
    judged = passivity(surface, parse_device(rig, "drawn"), *numbers, worst_loop(surface))
    job = {
        "surface": surface,
        "plant": plant,
        "hand": _hand(rng, surface, depth),
        "servo": Servo(period, delay=delay),
        "motion": Stationary((0.0, 0.0, 0.0)),
        "duration": SAMPLES * period,
        "start": (0.0, 0.0, texture.amplitude + float(rng.uniform(0.0, 0.5e-3))),
        "velocity": depth / period * 0.02 * rng.normal(size=3) * [1.0, 1.0, 0.5],
    }
    return Scene(job, judged.verdict == "passive")


def _damping(rng: np.random.Generator, *, coupled: bool, uneven: bool) -> FloatArray:
    """Return the handle's damping; uneven: 6 to 12 times as much along the wall's normal."""
    least = rng.uniform(0.5, 5.0)
    if uneven:
        return np.asarray(np.diag(least * np.array([1.0, 1.0, rng.uniform(6.0, 12.0)])))
    turned, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    values = least * np.array([1.0, *rng.uniform(1.0, 2.0, 2)])
    matrix = turned * values @ turned.T
    return np.asarray(0.5 * (matrix + matrix.T) if coupled else np.diag(values))


def _hand(rng: np.random.Generator, surface: Surface, depth: float) -> SpringHand:
    """Press so that it stays within the depth, and keep it near by a soft spring."""
    press = surface.stiffness * depth * float(rng.uniform(0.05, 0.5))
    spring = surface.stiffness * float(rng.uniform(0.0, 0.1))
    mass = float(rng.uniform(0.0, 0.1))
    return SpringHand(spring, mass=mass, force=(*(0.3 * press * rng.normal(size=2)), -press))


def outcome(scene: Scene, run: Run) -> SceneOutcome:
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
    return SceneOutcome(
        bool(within and depths.max() > 0.0),
        float((work - loss).max()) / run.ledger.exchanged,
        bool(run.stop_message or (last > 1e-4 and last > 0.98 * before and fed > 0.5 * lost)),
        float((work[loss > 0.0] / loss[loss > 0.0]).max()),
    )


def _rms(velocity: FloatArray) -> float:
    return float(np.sqrt((velocity**2).sum(axis=1).mean()))


def outcomes(batch: list[Scene]) -> list[SceneOutcome]:
    """Return what becomes of some scenes; what seems to cycle is looked at eight times as long."""
    runs = simulate_many([scene.job for scene in batch])
    found = [outcome(scene, run) for scene, run in zip(batch, runs, strict=True)]
    seeming = [i for i, each in enumerate(found) if each.cycles and not runs[i].stop_message]
    longer = [{**batch[i].job, "duration": 8.0 * batch[i].job["duration"]} for i in seeming]
    for i, run in zip(seeming, simulate_many(longer) if longer else [], strict=True):
        lasting = outcome(batch[i], run)
        found[i] = replace(found[i], cycles=lasting.cycles)
    return found
