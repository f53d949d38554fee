"""Try to break law H: every statement of its theorem, and laws that fail it.

Run it: ``python examples/break_h.py``, or ``python examples/break_h.py --seed 7 measured.x3p``
for other random points and a measured surface besides. It knows nothing of how law H is computed:
it asks for forces, energies and Jacobians, and compares. The exit code is 1 if law H breaks, or if
a statement is so weak that no other law breaks it.

Some statements hold for D or C as well, by mathematics: neither pushes outside, both keep the
stiffness of a flat wall and gain nothing in a loop. There the last column names a law that fails.
"""

from __future__ import annotations

import argparse
import math
import sys
from collections.abc import Callable, Iterable
from dataclasses import dataclass, field

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.progress import track
from rich.table import Table

import asperity as asp
from asperity.analysis.energy.field_energy import split_state
from asperity.textures.texture import Texture

K, L = 1000.0, 1e-3
FloatArray = NDArray[np.float64]
# A law of one's own whose spring stiffens with depth: no flat wall of stiffness k.
STIFFENING = asp.Law("S", "stiffening", "vertical", lambda c: c.k * c.depth**2 * c.w / L)


@dataclass
class Statement:
    """One statement: how far each law is from breaking it.

    Attributes:
        words: the statement.
        allowed: the greatest number at which it holds.
        numbers: of each law, the worst found.
    """

    words: str
    allowed: float
    numbers: dict[str, float] = field(default_factory=dict)

    def record(self, law: str, value: float) -> None:
        """Keep the worst number of a law; what is no number is the worst."""
        known = math.inf if math.isnan(value) else float(value)
        self.numbers[law] = max(self.numbers.get(law, -math.inf), known)

    def breaks(self, law: str) -> bool:
        """Return whether a law breaks the statement."""
        return not self.numbers[law] <= self.allowed


@dataclass(frozen=True)
class Case:
    """A surface with random probes in its body.

    Attributes:
        texture: the surface.
        points: probes at all depths [m], shape (n, 3).
        rng: for more of them.
    """

    texture: Texture
    points: FloatArray
    rng: np.random.Generator

    @property
    def size(self) -> float:
        """Length over which the surface changes [m]: 1 mm, or ten pixels of a map."""
        pitch = getattr(self.texture, "pitch", None)
        return 10.0 * min(pitch) if isinstance(pitch, tuple) else L

    def law(self, law: str | asp.Law, c: float = 1.0) -> asp.Surface:
        """Return the surface with a law."""
        return asp.Surface(self.texture, law, K, continuity=c)

    @property
    def depth(self) -> FloatArray:
        """Vertical depth of the probes [m]."""
        return np.asarray(self.texture.height(self.points[:, :2]) - self.points[:, 2])

    @property
    def phi(self) -> FloatArray:
        """Half the squared distance of the probes to the surface [m²]."""
        away = self.texture.nearest(self.points) - self.points
        return np.asarray(0.5 * np.square(away).sum(axis=1))

    def energy(self, c: float = 1.0) -> FloatArray:
        """U [m²] of law H at the probes."""
        return np.asarray(split_state(self.law("H", c), self.points).potential / K)

    def energies(self) -> dict[str, FloatArray]:
        """U [m²] of H, D and C: split, half a squared distance, half a squared depth."""
        return {"H": self.energy(), "D": self.phi, "C": 0.5 * self.depth**2}


def make_case(texture: Texture, seed: int) -> Case:
    """Return a texture with random probes in its body."""
    rng, count = np.random.default_rng(seed), 3000 if texture.is_profile else 300
    xy = texture.domain.points(rng.uniform(size=(count, len(texture.domain.spans))))
    case = Case(texture, np.column_stack([xy, texture.height(xy)]), rng)
    reach = min(texture.peak_to_valley, 2.0 * case.size)
    case.points[:, 2] -= reach * 10 ** rng.uniform(-2.0, 0.3, count)
    return case


def norm(vectors: FloatArray) -> FloatArray:
    """Return the length of each row."""
    return np.asarray(np.linalg.norm(vectors, axis=-1))


def nothing_outside(case: Case) -> Statement:
    """Return the greatest force on a probe outside the body."""
    statement = Statement("no force outside the body [k mm]", 0.0)
    outside = case.points.copy()
    outside[:, 2] = case.texture.height(outside[:, :2]) + case.depth * np.linspace(
        0.0, 1.0, len(case.points)
    )
    for law in "HDCWG":
        statement.record(law, norm(case.law(law).force(outside)).max() / (K * L))
    statement.record("H", split_state(case.law("H"), outside).potential.max())
    return statement


def energy_between(case: Case) -> Statement:
    """Return how far the energy leaves its bounds."""
    statement = Statement("(1 - μ) φ ≤ U ≤ φ [φ]", 1e-9)
    phi, own = case.phi, case.energies()
    for law, energy in own.items():
        statement.record(law, np.max((energy - phi) / phi))
    for c in (0.3, 1.0, 5.0):
        energy = case.energy(c)
        statement.record("H", np.max((c / (1.0 + c) * phi - energy) / phi))
        statement.record("H", np.max((energy - phi) / phi))
    return statement


def flat_wall(case: Case) -> Statement:
    """Return how far the force of a flat wall is from k δ e_z."""
    statement = Statement("a flat wall has stiffness k [k mm]", 1e-12)
    flat = asp.Profile(np.zeros(8), L)
    wall = case.points * [1.0, 1.0, 0.0] - np.column_stack([0.0 * case.points[:, :2], case.depth])
    expected = np.column_stack([0.0 * case.points[:, :2], K * case.depth])
    for law in ("H", "D", "C", STIFFENING):
        force = asp.Surface(flat, law, K, max_depth=L).force(wall)
        statement.record(str(law)[0], norm(force - expected).max() / (K * L))
    return statement


def gradient(case: Case) -> Statement:
    """Return how far -∇U, by differences, is from the force; a kink of U costs half a step."""
    step = 1e-4 * L
    statement = Statement("f = -k ∇U, by differences of U [k · step]", 0.5 * math.sqrt(3.0))
    part = case.points[::4]
    sides = [
        [split_state(case.law("H"), part + s * step * axis).potential for s in (1.0, -1.0)]
        for axis in np.eye(3)
    ]
    slope = np.stack([(ahead - behind) / (2.0 * step) for ahead, behind in sides], axis=-1)
    for law in "HDC":
        statement.record(law, norm(slope + case.law(law).force(part)).max() / (K * step))
    return statement


def loops(case: Case) -> Statement:
    """Return the work of random triangles that cross the medial axis."""
    statement = Statement("no loop gains energy [k l²/2]", 1e-9)
    low = case.texture.extremes[0]
    for _ in range(2):
        start = case.points[case.rng.integers(len(case.points))]
        corners = start + case.rng.normal(size=(3, 3)) * 0.5 * case.size
        corners[:, 2] = low - case.rng.uniform(0.0, 0.5, 3) * case.size
        for law in "HDCAE":
            work = asp.loop_work(case.law(law), corners)
            statement.record(law, abs(work) / (0.5 * K * case.size**2))
    return statement


def equals_god_object(case: Case) -> Statement:
    """Return the distance to law D wherever going on by 1/c keeps the nearest point."""
    statement = Statement("H is D up to the stated fraction [k mm]", 1e-9)
    closest = case.texture.nearest(case.points)
    single = case.law("D").force(case.points)
    for c in (0.5, 2.0):
        beyond = case.texture.nearest(case.points - (closest - case.points) / c)
        stays = norm(beyond - closest) < 1e-10
        for law in "HDC":
            force = case.law(law, c).force(case.points)
            statement.record(law, norm(force - single)[stays].max() / (K * L))
    return statement


def tends_to_god_object(case: Case) -> Statement:
    """Return by how much the mean distance to law D shrinks from c = 1 to c = 1000."""
    statement = Statement("c → ∞ is D [distance at c = 1000 : at 1]", 0.01)
    single = case.law("D").force(case.points)
    for law in "HDC":
        near, far = (
            float(np.mean(norm(case.law(law, c).force(case.points) - single))) for c in (1e3, 1.0)
        )
        statement.record(law, near / far if far > 0.0 else 0.0)
    return statement


def lipschitz(case: Case) -> Statement:
    """Return |Δf| - k max(1, c) |Δp| (1 + 1e-6).

    Of random pairs, of pairs across ridges, and of pairs along the stiffest direction.
    """
    statement = Statement("|Δf| ≤ k max(1, c) |Δp| (1 + 1e-6) [k mm]", 1e-10)
    a = case.points
    step = 10 ** case.rng.uniform(-9.0, -4.0, (len(a), 1))
    pairs = [(a, a + case.rng.normal(size=a.shape) * step), across_ridges(case)]
    for law, c in (("H", 1.0), ("H", 0.3), ("H", 5.0), ("D", 1.0), ("C", 1.0)):
        surface = case.law(law, c)
        values, vectors = np.linalg.eigh(-surface.jacobian(a))
        stiffest = np.argmax(np.abs(values), axis=1)
        direction = np.take_along_axis(vectors, stiffest[:, None, None], axis=2)[:, :, 0]
        for first, second in (*pairs, (a, a + direction * step)):
            apart = norm(second - first) * (1.0 + 1e-6)
            change = norm(surface.force(second) - surface.force(first)) / K
            statement.record(law, np.max(change - max(1.0, c) * apart) / L)
    return statement


def across_ridges(case: Case) -> tuple[FloatArray, FloatArray]:
    """Return pairs, a picometre apart and farther, between which the nearest point jumps."""
    low = case.points
    high = low + case.rng.normal(size=low.shape) * [0.2 * case.size, 0.2 * case.size, 0.0]
    closest_low, closest_high = case.texture.nearest(low), case.texture.nearest(high)
    for _ in range(28):
        middle = 0.5 * (low + high)
        closest = case.texture.nearest(middle)
        left = (norm(closest - closest_low) < norm(closest - closest_high))[:, None]
        low, closest_low = np.where(left, middle, low), np.where(left, closest, closest_low)
        high, closest_high = np.where(left, high, middle), np.where(left, closest_high, closest)
    return low, high


def stiffness(case: Case) -> Statement:
    """Return how far the eigenvalues of the local stiffness leave [-c, 1]."""
    statement = Statement("-c k ≤ stiffness in any direction ≤ k [k]", 1e-6)
    for law, c in (("H", 1.0), ("H", 0.3), ("H", 5.0), ("D", 1.0), ("C", 1.0)):
        values = np.linalg.eigvalsh(-case.law(law, c).jacobian(case.points) / K)
        statement.record(law, max(values.max() - 1.0, -values.min() - c))
    return statement


def largest_energy(case: Case) -> Statement:
    """Return by how much an energy exceeds U_1, the largest of all laws with q ≤ 1."""
    statement = Statement("no law with q ≤ 1 stores more energy than H(1) [U]", 1e-9)
    largest = case.energy()
    slope, curvature = case.texture.bounds
    gain = 1.0 + slope**2 + float(case.depth.max()) * curvature  # of C, a safe bound
    for candidate in (case.energy(0.3), case.energy(0.7), 0.5 * case.depth**2 / gain):
        statement.record("H", np.max((candidate - largest) / largest))
    statement.record("D", np.max((case.phi - largest) / largest))
    statement.record("C", np.max((0.5 * case.depth**2 - largest) / largest))
    return statement


def oscillation(case: Case) -> Statement:
    """Return the RMS of a force component on a deep scan over k l/(4√3), less 1."""
    statement = Statement("RMS on a periodic scan ≤ k l/(4√3) [of it]", 1e-9)
    line = case.texture.scan_line()
    xy = line.points(2000)
    scan = np.column_stack([xy, np.full(2000, case.texture.extremes[0] - 1.5 * L)])
    for law in "HDC":
        along = case.law(law).force(scan)[:, :2] @ line.direction
        limit = K * line.length / (4.0 * math.sqrt(3.0))
        statement.record(law, along.std() / limit - 1.0 if line.periodic else -1.0)
    return statement


TRIALS: tuple[Callable[[Case], Statement], ...] = (
    nothing_outside, energy_between, flat_wall, gradient, loops, equals_god_object,
    tends_to_god_object, lipschitz, stiffness, largest_energy, oscillation,
)  # fmt: skip


def run(cases: Iterable[Case], console: Console) -> list[Statement]:
    """Return every statement with the worst numbers over all surfaces."""
    found: dict[str, Statement] = {}
    work = [(case, trial) for case in cases for trial in TRIALS]
    for case, trial in track(work, "breaking H", console=console, transient=True):
        statement = trial(case)
        known = found.setdefault(statement.words, statement)
        for law, value in statement.numbers.items():
            known.record(law, value)
    return list(found.values())


def table_of(statements: Iterable[Statement]) -> Table:
    """Return the table: each statement, H against what is allowed, and who fails."""
    table = Table(box=None, pad_edge=False)
    for heading in ("statement", "allowed", "H", "D", "C", "fails too"):
        table.add_column(heading, justify="left" if heading == "statement" else "right")
    for statement in statements:
        cells = []
        for law in "HDC":
            colour = ("red" if law == "H" else "yellow") if statement.breaks(law) else "green"
            cells.append(f"[{colour}]{statement.numbers[law]:.1e}[/]")
        others = [law for law in statement.numbers if law not in "HDC" and statement.breaks(law)]
        failing = ", ".join(f"{law} {statement.numbers[law]:.1e}" for law in others)
        words = statement.words.replace("[", r"\[")
        table.add_row(words, f"{statement.allowed:.1e}", *cells, failing)
    return table


def main() -> int:
    """Print the table; return 1 if H breaks a statement or a statement has no teeth."""
    parser = argparse.ArgumentParser(description="Try to break law H.")
    parser.add_argument("surface", nargs="?", help="a measured surface to try besides")
    parser.add_argument("--seed", type=int, default=0, help="of the random points")
    options = parser.parse_args()
    rough = np.random.default_rng(2).normal(size=30)
    textures: list[Texture] = [
        asp.Sinusoid(amplitude=0.4e-3, period=1e-3, direction=(3.0, 1.0)),
        asp.Profile(1e-4 * rough, 1e-4, periodic=True),
    ]
    if options.surface:
        textures.append(asp.load_texture(options.surface))
    console = Console(width=120, highlight=False)
    statements = run([make_case(texture, options.seed) for texture in textures], console)
    console.print(table_of(statements))
    broken = [statement for statement in statements if statement.breaks("H")]
    toothless = [
        statement
        for statement in statements
        if not any(statement.breaks(law) for law in statement.numbers if law != "H")
    ]
    for statement in broken:
        console.print(f"H breaks: {statement.words}", style="bold red", markup=False)
    for statement in toothless:
        console.print(f"nothing fails: {statement.words}", style="bold red", markup=False)
    if not broken and not toothless:
        console.print("H holds; every statement is broken by another law.", style="bold")
    return 1 if broken or toothless else 0


if __name__ == "__main__":
    sys.exit(main())
