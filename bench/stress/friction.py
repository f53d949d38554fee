"""Work of friction along random closed paths, and closed loops with a hand at the printed rule.

``python -m bench.stress.friction [PATHS] [LOOPS]`` walks so many closed paths of three harmonics,
three turns each, on law W, on law C, on law H by a baked field, and on a mesh, where the slip limit
varies by texture, by noise from tick to tick and with the speed. Friction's work by the ledger,
Σ -κ d·Δp with both ends, is compared with Σ κ|u|²/8 - ΔS. The negative control is friction whose
presliding stiffness follows the limit, as in law F of the paper. Then closed loops of a mass that a
hand presses and moves: at the rule, and at twice it.
"""

from __future__ import annotations

import math
import sys
import tempfile
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asperity.analysis import characteristic_number, one_sided_number
from asperity.contacts.warm_start import UNLIMITED, new_warm_start
from asperity.core.checks import FloatArray
from asperity.kernels.fuse import fuse_on_texture
from asperity.rendering import bake, bake_mesh
from asperity.simulation import Cartesian, Servo, SpringHand, Strokes, simulate
from asperity.surface import Surface
from asperity.textures import Sinusoid
from bench.stress import friction_paths

PATHS = 1_000_000
LOOPS = 1000
TICKS = 100
PART = 20_000
K = 1000.0
WAVE = Sinusoid(1.5e-4, 1e-3, phase=0.4, direction=(1.0, 0.35))
FRICTION = {"friction": 0.8, "friction_modulation": 0.8}
# Rounding of works of up to 1 mJ [J].
ROUNDING = 1e-15


def cube(folder: Path, side: float = 4e-3) -> Path:
    """Return the file of a cube centred below the origin, as triangles."""
    corners = [(x, y, z) for x in (0, 1) for y in (0, 1) for z in (0, 1)]
    faces = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    lines = [f"v {side * (x - 0.5)} {side * (y - 0.5)} {side * (z - 1.0)}" for x, y, z in corners]
    lines += [" ".join(["f", *(str(corner + 1) for corner in face)]) for face in faces]
    path = folder / "cube.obj"
    path.write_text("\n".join(lines))
    return path


def surfaces() -> dict[str, Surface]:
    """Return the surfaces by name."""
    with tempfile.TemporaryDirectory() as folder:
        mesh = bake_mesh(cube(Path(folder)), "m", 3e-4, 1e-4)
    return {
        "W": Surface(WAVE, "W", K, 3e-4, **FRICTION),  # type: ignore[arg-type]  # by name
        "C": Surface(WAVE, "C", K, 3e-4, **FRICTION),  # type: ignore[arg-type]  # by name
        "H baked": bake(Surface(WAVE, "H", K, 3e-4, **FRICTION)),  # type: ignore[arg-type]  # by name
        "mesh": Surface(mesh.texture, "H", K, 3e-4, friction=0.8),
    }


def random_shapes(count: int, seed: int) -> FloatArray:
    """Return closed paths (n, 21) [m] in and out of contact."""
    rng = np.random.default_rng(seed)
    shapes = np.zeros((count, friction_paths.SHAPE_SIZE))
    shapes[:, :2] = rng.uniform(-1.5e-3, 1.5e-3, (count, 2))
    shapes[:, 2] = rng.uniform(-3e-4, 2e-4, count)
    size = 10.0 ** rng.uniform(-1.5, 0.0, (count, 1)) * np.array([[6e-4, 6e-4, 3e-4]])
    for harmonic in (1, 2, 3):
        for part in range(2):
            first = 6 * harmonic - 3 + 3 * part
            shapes[:, first : first + 3] = size / harmonic * rng.normal(0.0, 0.6, (count, 3))
    return shapes


@dataclass(frozen=True)
class Works:
    """Works of closed paths.

    Attributes:
        excess: greatest excess of friction's own work over its bound [J].
        above: paths with an excess above rounding.
        gains: paths whose total work is above what the sum of a field adds.
        total: greatest total work [J].
    """

    excess: float
    above: int
    gains: int
    total: float


def walk(surface: Surface, count: int, reach: float = 0.0) -> Works:
    """Return the works of random closed paths; the limit varies by noise and speed in turn."""
    friction = surface.contact_friction
    assert friction is not None
    loops = fuse_on_texture(
        surface.law,
        surface.texture.sampler,
        surface.effective_clamp,
        (friction_paths,),
        has_friction=True,
    )
    rng = np.random.default_rng(1)
    noises = (np.ones(1), 2.0 * rng.random(4096), np.where(rng.random(4096) < 0.1, 0.0, 1.0))
    gain = K * max(characteristic_number(surface).upper, 1.0)
    every = []
    part = min(PART, max(count // 6, 1))
    for turn, first in enumerate(range(0, count, part)):
        shapes = random_shapes(min(part, count - first), turn)
        out = np.empty((len(shapes), 4))
        loops.closed_paths(
            shapes,
            noises[turn % 3],
            TICKS,
            friction.presliding_stiffness,
            (0.0, 2e-5)[turn % 2],
            reach,
            friction.in_space,
            out,
            new_warm_start(UNLIMITED),
            surface.texture.arguments,
            surface.loop_arguments,
        )
        every.append(out)
    own, bound, total, squares = np.concatenate(every).T
    # The trapezoidal sum of a force with Lipschitz constant k q is off by k q |Δp|²/4 at most.
    allowed = bound + 2.0 * gain * squares
    return Works(
        float((own - bound).max()),
        int((own - bound > ROUNDING).sum()),
        int((total > allowed).sum()),
        float(total.max()),
    )


@dataclass(frozen=True)
class Loops:
    """Closed loops with a hand.

    Attributes:
        gains: loops whose hand gained energy.
        beyond: loops with steps that gained more than their bound.
        greatest: greatest energy gained [J].
    """

    gains: int
    beyond: int
    greatest: float


def close_loops(count: int, factor: float = 1.0, steps: str = "exact", seed: int = 3) -> Loops:
    """Return what the hand gained in random loops of damping at the rule of passivity.

    Args:
        count: number of loops.
        factor: of the stiffnesses k and κ over those of the rule.
        steps: "exact" positions; "rubbed", an encoder with dry friction above φ; or "bounded", an
            encoder with less friction, and damping of 1.5 times the rule.
        seed: of the random numbers.
    """
    rng = np.random.default_rng(seed)
    gains, beyond, greatest = 0, 0, -math.inf
    for number in range(count):
        law, delay, rate = "WCH"[number % 3], int(rng.integers(0, 7)), (1e3, 4e3)[number % 2]
        k = 10.0 ** rng.uniform(2.3, 3.3)
        plain = Surface(WAVE, law, k, 3e-4, friction=rng.uniform(0.1, 1.2), friction_modulation=1.0)
        friction = plain.contact_friction
        assert friction is not None
        q, one_sided = characteristic_number(plain).upper, one_sided_number(plain).upper
        weight = (3 * delay + 1) / 2 * friction.presliding_stiffness
        rule = k * (one_sided / 2 + delay * q)
        rule = max(rule, weight) if law == "W" else rule + weight
        needed = rule / rate * (1.5 if steps == "bounded" else 1.0 + 1e-9)
        half = 0.0 if steps == "exact" else 10.0 ** rng.uniform(-6.3, -4.6) / 2.0
        error = k * q * half + (8 if delay else 2) * friction.presliding_stiffness * half
        error *= math.sqrt(3.0)
        rubbing = {"exact": 0.0, "rubbed": error * (1.0 + 1e-9), "bounded": 0.3 * error}[steps]
        force = (0.0, 0.0, -rng.uniform(0.2, 2.0))
        hand = SpringHand(stiffness=(rng.uniform(0.0, 300.0),) * 2 + (0.0,), force=force)
        plant = Cartesian(rng.uniform(0.02, 0.3), needed, friction=rubbing)
        x, y = rng.uniform(-2e-3, 2e-3, 2)
        strokes = Strokes((x, y, 3e-4), (x + 2e-3, y + 1e-3, 3e-4), rng.uniform(0.005, 0.1), 50)
        servo = Servo(1.0 / rate, delay=delay, position_resolution=2.0 * half)
        surface = plain.to_stiffness(factor * k)
        ledger = simulate(surface, plant, hand, servo, strokes, 0.5, trace=False).ledger
        gained = ledger.total - ledger.dissipated + ledger.friction
        # Each step gains at most (φ - f_c)|Δ| - m |Δ|², m = σ₀/T less the rule.
        spare = needed * rate - rule
        bound = 1e-12
        if steps == "bounded":
            bound += 0.5 * rate * (error - rubbing) ** 2 / (4.0 * spare)
        gains += gained > 1e-12
        beyond += gained > bound
        greatest = max(greatest, gained)
    return Loops(gains, beyond, greatest)


def main(paths: int = PATHS, loops: int = LOOPS) -> int:
    """Print what is gained along closed paths and in closed loops; return 1 if a goal is missed."""
    failed = 0
    known = surfaces()
    for name, surface in known.items():
        works = walk(surface, paths)
        print(f"{name}, {paths} paths: {works}")
        failed += works.above + works.gains
    control = walk(known["W"], max(paths // 10, 6000), reach=2e-4)  # some of a hundred gain
    print(f"W, as in F: {control}")
    for steps in ("exact", "rubbed", "bounded"):
        closed = close_loops(loops, 1.0, steps)
        print(f"{loops} loops at the rule, {steps}: {closed}")
        failed += closed.beyond
    twice = close_loops(loops, 2.0)
    print(f"{loops} loops at twice the rule: {twice}")
    met = failed == 0 and control.gains > 0 and twice.gains > 0
    print("goals met" if met else "MISSED")
    return 0 if met else 1


if __name__ == "__main__":
    sys.exit(main(*map(int, sys.argv[1:3])))
