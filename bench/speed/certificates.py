"""Certified numbers: never wrong, and how fast.

``python -m bench certificates`` compares a certified q with what SciPy's global optimisers need for
the same number uncertified, and times maps. ``python -m bench.speed.certificates --random 10000``
tries random surfaces, laws and points; ``--large`` certifies a map of 8192 x 8192 points.
"""

from __future__ import annotations

import json
import math
import os
import subprocess
import sys
import time
from collections import Counter
from collections.abc import Callable, Sequence
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.analysis.bounds.bound import NORM, Bound
from asperity.analysis.gain.characteristic import certify, characteristic_number
from asperity.analysis.gain.medial_axis import SearchOptions
from asperity.core.checks import FloatArray
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Sinusoid
from bench.speed.timing import Batch, median_ratio, seconds, take_turns
from bench.stress.random_surfaces import Trial, run_trial

GAP = 1e-6
FASTER = 50.0
ROUNDS = 9
REPEATS = 100
LAWS = "ABCDFG"
MAP_LAWS = "ABCG"
SIDES = (256, 512, 1024)
MAP_SECONDS = 20.0
LARGE, LARGE_GB, LARGE_SECONDS = 8192, 4.0, 60.0
WAVES, SIDE_OF_WAVES = (4, 8, 40), 20e-3
WAVE_GAP, WAVE_SECONDS = 1e-3, 10.0
Objective = Callable[[FloatArray], float]


def run(console: Console) -> None:
    """Print the comparison with SciPy and the times of maps."""
    _against_scipy(console)
    _maps(console)
    _waves(console)
    console.print(
        f"not run here: {LARGE} x {LARGE} (python -m bench.speed.certificates --large),"
        " random surfaces (--random 10000)",
        style="dim",
    )


# --- a sinusoid, against global optimisers --------------------------------------------------------


def _surface(letter: str) -> Surface:
    return Surface(Sinusoid(0.1e-3, 1e-3, phase=0.7), letter, max_depth=0.2e-3)


def objective(surface: Surface) -> tuple[Objective, Any]:
    """Return -‖J‖/k over phase, depth and, for law F, the deflection, and their ranges."""
    from scipy.optimize import Bounds

    texture, depth, longest = surface.texture, surface.max_depth, surface.max_deflection
    period = float(texture.domain.spans[0, 0])

    def probe(x: float, level: float) -> list[float]:
        if surface.law.contact.name == "nominal":
            return [x, 0.0, -level]
        h, slope = texture.derivatives([[x, 0.0]])[0, :2]
        if surface.law.contact.name == "vertical":
            return [x, 0.0, h - level]
        below = level / math.hypot(1.0, slope)
        return [x + below * slope, 0.0, h - below]

    def negative(u: FloatArray) -> float:
        point = [probe(u[0] * period, max(float(u[1]), 1e-9) * depth)]
        state = ([[u[2] * longest, 0.0]], [False]) if surface.law.stateful else ()
        jacobian = surface.jacobian(point, *state)[0]
        return -float(np.linalg.norm(jacobian, 2)) / surface.stiffness

    size = 3 if surface.law.stateful else 2
    return negative, Bounds(np.array([0.0, 0.0, -1.0])[:size], np.ones(size))


def _shgo(surface: Surface, q: float, least: int) -> Batch | None:
    """Return shgo with so many samples, doubled until it reaches q within the gap."""
    from scipy.optimize import shgo

    negative, ranges = objective(surface)
    for count in (least * 2**power for power in range(7)):

        def search(count: int = count) -> float:
            found = shgo(negative, ranges, n=count, sampling_method="sobol")
            return -float(found.fun) if found.success else 0.0

        if search() >= q * (1.0 - GAP):
            return search
    return None


def _evolution(surface: Surface, q: float) -> Batch | None:
    """Return differential_evolution, its tolerance lowered until it reaches q within the gap."""
    from scipy.optimize import differential_evolution

    negative, ranges = objective(surface)
    for tolerance in (1e-2, 1e-4, 1e-8):

        def search(tolerance: float = tolerance) -> float:
            found = differential_evolution(negative, ranges, tol=tolerance, rng=1)
            return -float(found.fun)

        if search() >= q * (1.0 - GAP):
            return search
    return None


def _repeat_batch(surface: Surface) -> Batch:
    """Return many certified numbers: one takes less than the clock and the caches need."""

    def batch() -> None:
        for _ in range(REPEATS):
            characteristic_number(surface, tolerance=GAP)

    return batch


def _against_scipy(console: Console) -> None:
    table = Table(title=f"q of a sinusoid to {GAP:g}, medians of {ROUNDS} rounds in turns [ms]")
    rivals = ("shgo", "shgo by hindsight", "evolution")
    for heading in ("law", "q", "method", "asperity", *[f"{name}: ratio" for name in rivals]):
        table.add_column(heading)
    slowest = math.inf
    for letter in LAWS:
        surface = _surface(letter)
        bound = characteristic_number(surface, tolerance=GAP)
        contestants: list[Batch] = [_repeat_batch(surface)]
        q = bound.lower
        # SciPy's own number of samples, and as few as find q, which nobody knows beforehand.
        found = [_shgo(surface, q, 128), _shgo(surface, q, 8), _evolution(surface, q)]
        contestants += [search for search in found if search is not None]
        times = take_turns(contestants, ROUNDS)
        times[:, 0] /= REPEATS
        cells, column = [f"{np.median(times[:, 0]) * 1e3:.3f}"], 1
        for name, search in zip(rivals, found, strict=True):
            if search is None:
                cells.append("not found")
                continue
            ratio = median_ratio(times, column, 0)
            slowest = min(slowest, ratio) if "hindsight" not in name else slowest
            cells.append(f"{np.median(times[:, column]) * 1e3:.1f}: {ratio:.0f}")
            column += 1
        table.add_row(letter, f"{bound.value:.9g}", bound.method, *cells)
    console.print(table)
    verdict = "reached" if slowest >= FASTER else "missed"
    console.print(f"least ratio {slowest:.0f}; goal {FASTER:g}: {verdict}")


# --- maps -----------------------------------------------------------------------------------------


def rough_map(side: int) -> HeightMap:
    """Return band-limited noise [m] on a square grid, with a period so that it is cheap."""
    rng = np.random.default_rng(side)
    spectrum = np.fft.rfft2(rng.standard_normal((side, side), dtype=np.float32))
    wave = np.hypot(np.fft.fftfreq(side)[:, None], np.fft.rfftfreq(side)[None, :])
    spectrum *= np.exp(-0.5 * (2.0 * math.pi * 6.0 * wave) ** 2)
    heights: FloatArray = np.fft.irfft2(spectrum, s=(side, side))
    return HeightMap(0.1e-3 / heights.std() * heights, 50e-6, periodic=True)


def _certify(surface: Surface) -> Bound:
    """Certify without the certificates that are kept on disk."""
    return certify(surface, NORM, SearchOptions())


def _maps(console: Console) -> None:
    table = Table(title="seconds to q of maps to 1e-3; J: the Jacobian of law B once at every node")
    for heading in ("nodes", *MAP_LAWS, "together", "J", "together/J", "ns per node"):
        table.add_column(heading)
    total = 0.0
    for side in SIDES:
        texture = rough_map(side)
        surfaces = [Surface(texture, letter, max_depth=0.2e-3) for letter in MAP_LAWS]
        for surface in surfaces:
            surface.jacobian(np.zeros((1, 3)))  # compiled
        times = [seconds(lambda s=surface: _certify(s)) for surface in surfaces]  # type: ignore[misc]  # mypy cannot see the default of a lambda
        every = seconds(lambda: surfaces[1].jacobian(nodes(texture)))  # noqa: B023 - called here
        total = sum(times)
        table.add_row(
            f"{side} x {side}",
            *[f"{t:.2f}" for t in times],
            f"{total:.2f}",
            f"{every:.2f}",
            f"{total / every:.1f}",
            f"{total / side**2 * 1e9:.0f}",
        )
    console.print(table)
    verdict = "reached" if total <= MAP_SECONDS else "missed"
    console.print(f"{SIDES[-1]} x {SIDES[-1]}: {total:.1f} s; goal {MAP_SECONDS:g} s: {verdict}")


def independent_waves(count: int) -> Fourier:
    """Return a sum of waves of 0.6 mm to 2 mm that never repeats."""
    rng = np.random.default_rng(count)
    turn = rng.uniform(0.0, 2.0 * math.pi, count)
    size = 2.0 * math.pi / rng.uniform(0.6e-3, 2e-3, count)
    waves = np.column_stack([size * np.cos(turn), size * np.sin(turn)])
    amplitudes = 4.0 / count * rng.uniform(1e-5, 4e-5, count)
    return Fourier(amplitudes, waves, rng.uniform(0.0, 6.0, count))


def _waves(console: Console) -> None:
    """Print the time of sums that never repeat: four on the whole plane, more on an extent."""
    side = SIDE_OF_WAVES
    places: list[tuple[int, str, tuple[float, float] | None]] = [(4, "the whole plane", None)]
    places += [(count, f"{side * 1e3:g} mm x {side * 1e3:g} mm", (side, side)) for count in WAVES]
    table = Table(title=f"seconds to q of independent waves to {WAVE_GAP:g}; the gap that is left")
    for heading in ("waves", "on", *MAP_LAWS):
        table.add_column(heading)
    slowest = widest = 0.0
    for count, where, extent in places:
        cells = []
        for letter in MAP_LAWS:
            surface = Surface(independent_waves(count), letter, max_depth=0.1e-3)
            search = SearchOptions(WAVE_GAP, extent=extent)
            start = time.perf_counter()
            bound = certify(surface, NORM, search)
            slowest = max(slowest, taken := time.perf_counter() - start)
            widest = max(widest, bound.gap)
            cells.append(f"{taken:.2f}: {bound.gap:.1e}")
        table.add_row(str(count), where, *cells)
    console.print(table)
    verdict = "reached" if slowest <= WAVE_SECONDS and widest <= 1.01 * WAVE_GAP else "missed"
    goal = f"goal {WAVE_SECONDS:g} s and {WAVE_GAP:g}"
    console.print(f"slowest {slowest:.1f} s, widest gap {widest:.1e}; {goal}: {verdict}")


def nodes(texture: HeightMap) -> FloatArray:
    """Return a probe below every node of a map, (n, 3)."""
    ny, nx = texture.heights.shape
    x, y = (np.arange(n) * p for n, p in zip((nx, ny), texture.pitch, strict=True))
    z = texture.heights - 0.1e-3
    return np.column_stack([np.tile(x, ny), np.repeat(y, nx), z.ravel()])


_LARGE = """
import json, resource, sys, time
from asperity.surface import Surface
from bench.speed.certificates import _certify, rough_map
texture = rough_map(int(sys.argv[2]))
start, busy = time.perf_counter(), time.process_time()
bound = _certify(Surface(texture, sys.argv[1], max_depth=0.2e-3))
peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss * 1024
taken = [time.perf_counter() - start, time.process_time() - busy]
print(json.dumps([*taken, peak, bound.lower, bound.upper, bound.note]))
"""


def large(console: Console, laws: Sequence[str] = ("A", "C"), side: int = LARGE) -> None:
    """Certify a large map, each law in a process of its own, and print its peak memory."""
    for letter in laws:
        done = subprocess.run(
            [sys.executable, "-c", _LARGE, letter, str(side)],
            capture_output=True,
            text=True,
            check=False,
            env=os.environ,
        )
        if done.returncode != 0:
            console.print(f"{letter}: failed: {done.stderr.strip().splitlines()[-1:]}")
            continue
        taken, busy, peak, lower, upper, note = json.loads(done.stdout)
        gigabytes = peak / 1e9
        verdict = "reached" if gigabytes < LARGE_GB and taken < LARGE_SECONDS else "missed"
        console.print(
            f"{letter}, {side} x {side}: {taken:.0f} s ({busy:.0f} s of processor), peak "
            f"{gigabytes:.2f} GB, goal {LARGE_SECONDS:g} s and {LARGE_GB:g} GB: {verdict}; "
            f"q from {lower:.6g} to {upper:.6g} ({note})"
        )


# --- random surfaces ------------------------------------------------------------------------------


def random_trials(console: Console, count: int, first: int = 0) -> int:
    """Try random surfaces, laws and points; return how many went wrong."""
    start, said = time.perf_counter(), 0
    counts: Counter[str] = Counter()
    worst = Trial(0, "", "", "", Bound(0.0, 0.0, "theorem"), 0, -1.0, 0.0)
    for seed in range(first, first + count):
        found = run_trial(seed)
        counts["trials"] += 1
        counts["points"] += found.points
        counts[found.bound.method] += 1
        counts["at the work limit"] += "work limit" in found.bound.note
        counts["wrong"] += not found.is_correct
        counts["idle"] += not found.is_tight
        if np.isfinite(found.excess):
            worst = max(worst, found, key=lambda t: t.excess)
        if not (found.is_correct and found.is_tight) and said < 20:
            said += 1
            console.print(found, style="bold")
        if counts["trials"] % 250 == 0:
            console.print(f"{time.perf_counter() - start:.0f} s: {dict(counts)}", style="dim")
    console.print(dict(counts))
    console.print(f"nearest to upper: {worst.excess:.1e} above it (rounding), seed {worst.seed}")
    return counts["wrong"] + counts["idle"]


def main(arguments: Sequence[str]) -> int:
    """Run with ``--random N [first seed]``, ``--large [side]``, or nothing."""
    console = Console(width=110, highlight=False)
    words = list(arguments)
    if not words:
        run(console)
        return 0
    numbers = [int(word) for word in words[1:]]
    if words[0] == "--random" and numbers:
        return min(random_trials(console, *numbers), 1)
    if words[0] == "--large":
        large(console, side=numbers[0] if numbers else LARGE)
        return 0
    print(main.__doc__, file=sys.stderr)
    return 2


if __name__ == "__main__":
    sys.exit(main(sys.argv[1:]))
