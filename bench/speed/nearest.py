"""Cost of a globally nearest surface point, the contact of the god-object laws, against a peer.

The peer is a k-d tree (SciPy) of points of the surface, the nearest of them polished by Newton's
method. It is timed in turns with asperity on the same probes, and counted wrong where it ends
farther away by more than 1e-6 of the extent.
"""

from __future__ import annotations

from dataclasses import dataclass
from functools import partial
from types import ModuleType
from typing import Any

import numpy as np
from rich.console import Console

from asperity.core.checks import FloatArray
from asperity.textures import Fourier, HeightMap, Noise, Profile
from asperity.textures.texture import Texture
from bench.speed import cases, peers
from bench.speed.timing import (
    Batch,
    affordable_count,
    median_ratio,
    number_table,
    print_verdict,
    take_turns,
)
from bench.stress.nearest_exhaustive import texture_extent

ROUNDS = 7
BATCH_SECONDS = 0.1
LEAST, MOST = 100, 5_000
WRONG = 1e-6  # of the extent
TREE_STEP = 0.5  # of the pitch
# Pixels of a map; elsewhere shares of the peak-to-valley height.
PIXELS = (1.0, 10.0, 100.0)
SHARES = (0.01, 1.0)
SIDE = 1024
# What nearest points must reach [µs]: of a profile at any depth, of a map at most so many pixels.
PROFILE_LIMIT = 1.0
MAP_LIMITS = {1.0: 10.0, 10.0: 10.0, 100.0: 60.0}
FORCE_LIMIT = 1.2  # times the nearest point
GOALS = "profile 1 µs; 1024 x 1024 map 10 µs to 10 pixels, 60 µs at 100; D 1.2 x nearest"


@dataclass(frozen=True)
class Subject:
    """A texture with what a row of the table needs.

    Attributes:
        name: in the table.
        texture: the texture.
        pitch: distance of its nodes, or a fine fraction of its shortest wave [m].
        depths: vertical depths of the probes, by their names [m].
        limits: what the nearest point may take [µs], by the names of the depths.
    """

    name: str
    texture: Texture
    pitch: float
    depths: dict[str, float]
    limits: dict[str, float]


def run(console: Console) -> None:
    """Print a table of µs per query, and the verdict."""
    headings = ("depth", "nearest\nµs", "force D\n/nearest", "k-d tree\nµs")
    table = number_table("texture", *headings, "\nratio", "\nwrong")
    missed: list[str] = []
    for subject in _subjects():
        tree = _build_tree(subject)
        for depth in subject.depths:
            cells, faults = _row(subject, depth, tree)
            table.add_row(subject.name, depth, *cells)
            missed += faults
    console.print(
        "nearest point, medians of batches over random probes in turns;"
        f"\nwrong: farther than the nearest point by more than {WRONG:g} of the extent (asperity:"
        "\nnone in 1e5, python -m bench.stress.nearest_exhaustive)."
    )
    console.print(table)
    print_verdict(console, GOALS, missed)


def _subjects() -> list[Subject]:
    known = cases.textures()
    rng = np.random.default_rng(cases.SEED)
    rough = HeightMap(cases.rough_heights((SIDE, SIDE), rng), pitch=50e-6)
    noise = Noise(rms=0.1e-3, size=SIDE * 50e-6, pitch=50e-6, seed=1)
    subjects = []
    for name, texture in {**known, f"map {SIDE}": rough, f"noise {SIDE}": noise}.items():
        if name == "heightmap":
            continue
        if isinstance(texture, HeightMap):
            depths = {f"{count:g} px": count * texture.pitch[0] for count in PIXELS}
            limits = {f"{count:g} px": limit for count, limit in MAP_LIMITS.items()}
            subjects.append(Subject(name, texture, texture.pitch[0], depths, limits))
            continue
        depths = {f"{share:.0%}": share * texture.peak_to_valley for share in SHARES}
        limits = dict.fromkeys(depths, PROFILE_LIMIT) if texture.is_profile else {}
        subjects.append(Subject(name, texture, _grid_spacing(texture), depths, limits))
    return subjects


def _grid_spacing(texture: Texture) -> float:
    """Return the pitch of a profile, or a 40th of the shortest wave [m]."""
    if isinstance(texture, Profile):
        return texture.pitch
    if isinstance(texture, Fourier):
        return float(2.0 * np.pi / np.hypot(*texture.wavevectors.T).max() / 40.0)
    return texture.scan_line().length / 40.0


@dataclass(frozen=True)
class Tree:
    """A k-d tree of points of a surface.

    Attributes:
        axes: unit vectors (d, 2) of the coordinates along which the height varies.
        points: the points [m], shape (n, d + 1), the height last.
        tree: of SciPy.
    """

    axes: FloatArray
    points: FloatArray
    tree: Any

    def nearest(self, probes: FloatArray) -> FloatArray:
        """Return the points (n, 2) nearest to the probes; across a profile a probe stays."""
        along = probes[:, :2] @ self.axes.T
        _distance, index = self.tree.query(np.column_stack([along, probes[:, 2]]))
        feet = probes[:, :2] + (self.points[index, :-1] - along) @ self.axes
        return np.ascontiguousarray(feet)


def _build_tree(subject: Subject) -> Tree:
    """Return the tree of a surface: its domain, and as far beyond as the deepest probe reaches."""
    from scipy.spatial import cKDTree

    texture, step = subject.texture, TREE_STEP * subject.pitch
    reach = max(subject.depths.values())
    domain, axes = texture.domain, np.eye(2)
    if texture.is_profile:
        axes = domain.spans / np.hypot(*domain.spans[0])
    along = np.array([domain.origin, domain.origin + domain.spans.sum(axis=0)]) @ axes.T
    ticks = [
        np.arange(low, high, step)
        for low, high in zip(along.min(axis=0) - reach, along.max(axis=0) + reach, strict=True)
    ]
    flat = np.stack(np.meshgrid(*ticks), axis=-1).reshape(-1, len(axes))
    points = np.column_stack([flat, texture.height(flat @ axes)])
    return Tree(axes, points, cKDTree(points))


def _row(subject: Subject, depth_name: str, tree: Tree) -> tuple[list[str], list[str]]:
    """Return the cells of a row after its names, and the goals that it misses."""
    texture = subject.texture
    points = cases.probes(texture, MOST, subject.depths[depth_name])
    loop, arguments = texture._loops.nearest_batch, texture.arguments
    few = partial(loop, points[:LEAST], np.empty((LEAST, 2)), arguments)
    points = points[: affordable_count(few, LEAST, BATCH_SECONDS, MOST)]
    feet, out = np.empty((len(points), 2)), np.empty((len(points), 2))
    god = cases.kernel(texture, "D", points)
    compiled = _peers(texture)

    def by_tree() -> None:
        compiled.peer_polish_batch(points, tree.nearest(points), out, arguments)

    batches: list[Batch] = [lambda: loop(points, feet, arguments), god.run_force, by_tree]
    times = take_turns(batches, ROUNDS)
    medians = np.median(times, axis=0) / len(points) * 1e6
    ratio = median_ratio(times, 1, 0)
    best = _distances(texture, points, feet)
    by_tree()
    wrong = _distances(texture, points, out) - best > WRONG * texture_extent(texture)
    share = f"{100 * wrong.mean():.2g} %"
    cells = [f"{medians[0]:.2f}", f"{ratio:.2f}", f"{medians[2]:.2f}"]
    cells += [f"{median_ratio(times, 2, 0):.1f}", share]
    faults = []
    if medians[0] > subject.limits.get(depth_name, np.inf):
        faults.append(f"{subject.name} {depth_name} {medians[0]:.2f} µs")
    if ratio > FORCE_LIMIT:
        faults.append(f"D on {subject.name} {depth_name} {ratio:.2f}")
    return cells, faults


def _peers(texture: Texture) -> ModuleType:
    from asperity.kernels.fuse import fuse_sampler

    return fuse_sampler(texture.sampler, peers)


def _distances(texture: Texture, points: FloatArray, closest_points: FloatArray) -> FloatArray:
    away = np.column_stack([closest_points, texture.height(closest_points)]) - points
    return np.asarray(np.linalg.norm(away, axis=1))
