"""Nearest points against exhaustive search.

``python -m bench.stress.nearest_exhaustive [count] [kind]``: count random probes for each kind of
texture, 100 000 by default, inside and outside of the body and beyond the border of finite
surfaces. The exhaustive search knows the surface by its heights alone: on a dense grid over all
that can be nearest it keeps the eight lowest local minima of the distance and polishes each by
damped Newton steps. Nothing of it is shared with the search that it tests.
"""

from __future__ import annotations

import sys
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numba import njit
from rich.console import Console

from asperity.core.checks import FloatArray
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid
from asperity.textures.catalogue import load_texture
from asperity.textures.kinds.noise import Noise, NoiseProfile
from asperity.textures.texture import Texture
from bench.speed.timing import number_table

COUNT = 100_000
REAL = Path(__file__).parents[3] / "shared" / "data" / "sample-land.x3p"
CANDIDATES = 8  # candidates for each probe
TOLERANCE = 1e-12  # of the extent
_POLISH = 60  # steps, most of them needed by a few candidates only
_SEED = 20240801


@dataclass(frozen=True)
class Case:
    """A texture and how it is searched.

    Attributes:
        texture: the texture.
        step: distance of the samples of the exhaustive search [m].
        depth: greatest vertical depth of the probes [m]; outside, half of it.
    """

    texture: Texture
    step: float
    depth: float


def _wave(shape: Callable[[FloatArray], FloatArray]) -> Case:
    """Return a grating 0.4 mm high with a period of 1 mm, as steep as 50 nodes can make it."""
    heights = 0.4e-3 * shape(np.arange(50) / 50.0)
    return Case(Profile(heights, 20e-6, periodic=True, origin=0.13e-3), 1e-6, 0.8e-3)


def _rough(*shape: int) -> FloatArray:
    from scipy.ndimage import gaussian_filter

    noise = np.random.default_rng(_SEED).standard_normal(shape)
    return np.asarray(0.3e-3 * gaussian_filter(noise, 2.0, mode="reflect"))


def _fourier(waves: Any, amplitudes: Any, step: float, depth: float) -> Case:
    phases = np.arange(len(amplitudes)) * 0.7
    return Case(Fourier(amplitudes, 2.0 * np.pi / 1e-3 * np.array(waves), phases), step, depth)


def _bullet_case() -> Case:
    """Return a third of a measured surface, 300 x 256 points, magnified 20 times."""
    whole = load_texture(REAL, magnify=20.0, s_cutoff=20e-6)
    assert isinstance(whole, HeightMap)
    return Case(HeightMap(whole.heights[:, 300:600], whole.pitch), 1e-5, 0.6e-3)


CASES: dict[str, Callable[[], Case]] = {
    "sinusoid": lambda: Case(Sinusoid(0.3e-3, 1e-3, 0.4, (2.0, 1.0)), 1e-6, 1.2e-3),
    "sinusoid, A/l = 3": lambda: Case(Sinusoid(3e-3, 1e-3, 0.4, (1.0, -3.0)), 1e-6, 3e-3),
    "Fourier, 1-D": lambda: _fourier([1.0, 3.0, 4.0], [0.2e-3, 0.06e-3, 0.03e-3], 1e-6, 1e-3),
    "Fourier, 2-D": lambda: _fourier(
        [[1, 0], [-1, 2], [2, 1], [0, 3]], [1e-4, 7e-5, 4e-5, 2e-5], 2e-5, 0.6e-3
    ),
    "Fourier, never repeats": lambda: _fourier(
        [[1.0, 0.2], [-0.5, 2**0.5], [np.pi / 2, -1.0]], [1e-4, 7e-5, 5e-5], 2e-5, 0.6e-3
    ),
    "map, finite": lambda: Case(HeightMap(3.0 * _rough(40, 60), (80e-6, 100e-6)), 1e-5, 1e-3),
    "map, periodic": lambda: Case(HeightMap(3.0 * _rough(40, 60), 1e-4, periodic=True), 1e-5, 1e-3),
    "map, steep": lambda: Case(HeightMap(10.0 * _rough(30, 30), 1e-4), 1e-5, 1e-3),
    "profile, finite": lambda: Case(Profile(_rough(300), 50e-6), 2e-6, 1e-3),
    "profile, periodic": lambda: Case(Profile(_rough(300), 50e-6, periodic=True), 2e-6, 1e-3),
    "noise": lambda: Case(Noise(rms=0.1e-3, size=6e-3, cutoff=0.4e-3), 1e-5, 1e-3),
    "noise profile": lambda: Case(NoiseProfile(rms=60e-6, size=6e-3), 2e-6, 1e-3),
    "triangle": lambda: _wave(lambda t: np.abs(2.0 * t - 1.0)),
    "square": lambda: _wave(lambda t: (t < 0.5).astype(float)),
    "sawtooth": lambda: _wave(lambda t: t),
    "bullet land, magnified": _bullet_case,
}


def probes(case: Case, count: int, seed: int = _SEED) -> FloatArray:
    """Return points (count, 3) [m]: mostly inside, shallow and deep, a tenth outside."""
    rng = np.random.default_rng(seed)
    domain = case.texture.domain
    xy = domain.points(0.5 + 1.3 * (rng.random((count, len(domain.spans))) - 0.5))
    depth = case.depth * rng.random(count) ** 2
    depth[rng.random(count) < 0.1] *= -0.5
    return np.ascontiguousarray(np.column_stack([xy, case.texture.height(xy) - depth]))


def search_exhaustively(case: Case, points: FloatArray) -> FloatArray:
    """Return the distance of each probe from the surface [m]."""
    texture = case.texture
    axes = np.eye(2)
    if texture.is_profile:
        axes = texture.domain.spans / np.hypot(*texture.domain.spans[0])
    # A probe is no farther away than it is deep: the samples reach that far beyond all probes.
    reach = np.abs(texture.height(points[:, :2]) - points[:, 2])
    along = points[:, :2] @ axes.T
    low, high = along.min(axis=0) - reach.max(), along.max(axis=0) + reach.max()
    ticks = [
        np.arange(a - 3 * case.step, b + 3 * case.step, case.step)
        for a, b in zip(low, high, strict=True)
    ]
    mesh = np.stack(np.meshgrid(*ticks), axis=-1).reshape(-1, len(axes))
    grid = texture.height(mesh @ axes).reshape(-1, len(ticks[0]))
    local = np.zeros((len(points), 3))
    local[:, : len(axes)] = (along - [tick[0] for tick in ticks]) / case.step
    local[:, 2] = points[:, 2]
    kept = np.full((len(points), CANDIDATES, 2), -1, dtype=np.int64)
    lowest_minima(local, reach, grid, case.step, kept)
    probe, which = np.nonzero(kept[:, :, 0] >= 0)
    chosen = kept[probe, which][:, : len(axes)]
    corner = np.array([tick[0] for tick in ticks])
    # Across a profile a probe stays where it is.
    starts = points[probe, :2] + (corner + case.step * chosen - along[probe]) @ axes
    best = np.full(len(points), np.inf)
    np.minimum.at(best, probe, local_minima(texture, points[probe], starts, case.step))
    return best


@njit  # type: ignore[untyped-decorator]  # of Numba
def lowest_minima(points: Any, reach: Any, grid: Any, step: float, indices: Any) -> None:
    """Write the samples (column, row) at the lowest local minima of the distance.

    Args:
        points: probes in steps, but for their height [m], shape (n, 3).
        reach: how far to look [m], shape (n,).
        grid: heights [m], shape (rows, columns); one row for a profile.
        step: distance of the samples [m].
        indices: result, shape (n, k, 2); as it was where there are fewer.
    """
    rows, columns = grid.shape
    values = np.empty(indices.shape[1])
    for n in range(len(points)):
        u, v, z = points[n]
        values[:] = np.inf
        wide = int(reach[n] / step) + 2
        for i in range(max(int(v) - wide, 0), min(int(v) + wide + 2, rows)):
            for j in range(max(int(u) - wide, 1), min(int(u) + wide + 2, columns - 1)):
                value = step**2 * ((j - u) ** 2 + (i - v) ** 2) + (grid[i, j] - z) ** 2
                if value >= values[-1]:
                    continue
                lowest = True
                for a in range(max(i - 1, 0), min(i + 2, rows)):
                    for b in range(j - 1, j + 2):
                        near = step**2 * ((b - u) ** 2 + (a - v) ** 2) + (grid[a, b] - z) ** 2
                        lowest = lowest and near >= value
                if lowest:
                    k = len(values) - 1
                    while k > 0 and values[k - 1] > value:
                        values[k] = values[k - 1]
                        indices[n, k] = indices[n, k - 1]
                        k -= 1
                    values[k] = value
                    indices[n, k, 0] = j
                    indices[n, k, 1] = i


def local_minima(
    texture: Texture, points: FloatArray, starts: FloatArray, step: float
) -> FloatArray:
    """Return the least distance downhill from each start [m], by damped Newton steps.

    Levenberg's method: the damping falls after a step that led down and rises after one that
    did not. Steps are at most as long as given.
    """
    xy = starts.copy()
    best, step_to, bend = _expansion(texture, points, xy)
    damping = np.zeros(len(xy))
    alive = np.ones(len(xy), dtype=bool)
    for _ in range(_POLISH):
        low, high = np.linalg.eigvalsh(bend[alive]).T
        raised = np.maximum(damping[alive], np.maximum(1e-3 * np.abs(high) - low, 0.0))
        raised = np.where(low > 1e-3 * high, damping[alive], raised + damping[alive])
        full = bend[alive] + raised[:, None, None] * np.eye(2)
        move = -np.linalg.solve(full, step_to[alive][:, :, None])[:, :, 0]
        length = np.hypot(*move.T)
        move *= np.minimum(1.0, step / np.maximum(length, 1e-300))[:, None]
        index = np.flatnonzero(alive)
        trial = xy[index] + move
        value, slope, curved = _expansion(texture, points[index], trial)
        down = value < best[index]
        taken = index[down]
        xy[taken], best[taken] = trial[down], value[down]
        step_to[taken], bend[taken] = slope[down], curved[down]
        damping[taken] = np.where(damping[taken] > 1e-6, 0.1 * damping[taken], 0.0)
        failed = index[~down]
        damping[failed] = 4.0 * damping[failed] + 0.1 * np.abs(high[~down])
        alive[failed] = length[~down] > 1e-13 * (1e-6 + np.sqrt(best[failed]))
        if not alive.any():
            break
    return np.sqrt(best)


def _expansion(
    texture: Texture, points: FloatArray, xy: FloatArray
) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the squared distance φ of surface points from probes, ∇φ/2 and Hess φ/2."""
    h, hx, hy, hxx, hxy, hyy = texture.derivatives(xy).T
    away, gap = xy - points[:, :2], h - points[:, 2]
    slope = np.stack([hx, hy], axis=1)
    hessian = np.stack([hxx, hxy, hxy, hyy], axis=1).reshape(-1, 2, 2)
    bend = np.eye(2) + slope[:, :, None] * slope[:, None, :] + gap[:, None, None] * hessian
    return np.sum(away**2, axis=1) + gap**2, away + gap[:, None] * slope, bend


def distances(texture: Texture, points: FloatArray) -> FloatArray:
    """Return the distance of each probe from its nearest point as the texture finds it [m]."""
    return np.asarray(np.linalg.norm(texture.nearest(points) - points, axis=1))


def texture_extent(texture: Texture) -> float:
    """Return the length of the first span of the domain [m]."""
    return float(np.hypot(*texture.domain.spans[0]))


def run(console: Console, count: int = COUNT, kinds: list[str] | None = None) -> int:
    """Print a table; return how many probes were farther from their foot than need be."""
    names = ("farther\nat most", "nearer\nat most", "wrong", "local\nwrong", "s")
    table = number_table("texture", "extent\nmm", *names)
    table.title = f"{count} random probes of each kind"
    failed = 0
    for kind in kinds or list(CASES):
        if kind.startswith("bullet") and not REAL.exists():
            console.print(f"not run: {kind}: {REAL.name} is missing")
            continue
        start, case = perf_counter(), CASES[kind]()
        texture, points = case.texture, probes(CASES[kind](), count)
        extent = texture_extent(texture)
        found, best = distances(texture, points), search_exhaustively(case, points)
        local = local_minima(texture, points, points[:, :2].copy(), case.step)
        excess = (found - best) / extent
        wrong = int((np.abs(excess) > TOLERANCE).sum())
        failed += int((excess > TOLERANCE).sum())
        lost = int(((local - found) / extent > TOLERANCE).sum())
        table.add_row(
            kind,
            f"{1e3 * extent:.2f}",
            f"{excess.max():.1e}",
            f"{-excess.min():.1e}",
            str(wrong),
            str(lost),
            f"{perf_counter() - start:.0f}",
        )
    console.print(table)
    console.print(
        "farther, nearer: distance found less the exhaustive one, in extents; wrong: differs by"
        f" more than {TOLERANCE:g};\nlocal: the negative control, downhill from the probe's x, y"
    )
    return failed


def main() -> int:
    """Run with the number of probes and the kinds from the command line."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else COUNT
    unknown = [kind for kind in sys.argv[2:] if kind not in CASES]
    if unknown:
        print(f"unknown kind {unknown[0]!r}; choose from {', '.join(CASES)}", file=sys.stderr)
        return 2
    return min(run(Console(width=100, highlight=False), count, sys.argv[2:]), 1)


if __name__ == "__main__":
    sys.exit(main())
