"""The longest tick of laws D and H on surfaces made to be slow, and what a stroke costs per tick.

Each tick of an adversary begins with nothing remembered; its time is the least of a few turns, so
that an interruption by something else does not count.
"""

from __future__ import annotations

import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.core.checks import FloatArray
from asperity.rendering import rendered_surface
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Texture
from asperity.textures.catalogue import as_texture
from bench.speed import cases
from bench.speed.c_programs import surface_ticks
from bench.speed.timing import number_table, print_verdict, seconds

SIDE = 512
PITCH = 50e-6
RATE = 4000.0
TICKS = 800
# Goals, in µs.
LONGEST = {"D": 50.0, "H": 150.0}
# Goal, time of a tick of H with friction over that without.
FRICTION_RATIO = 1.1
PROBES = 40
TURNS = 5
WAVES = 32
# Goal, share of ticks.
TRUNCATED = 1e-3
Adversaries = dict[str, tuple[HeightMap, FloatArray]]


def adversarial_textures(side: int = SIDE) -> Adversaries:
    """Return maps of so many nodes a side, each with a probe (1, 3) [m] that is hardest for it.

    The probe is the centre of curvature of dome and grooves, and is deep below the others.
    """
    from scipy.ndimage import gaussian_filter

    rng = np.random.default_rng(cases.SEED)
    centre = 0.5 * (side - 1) * PITCH
    y, x = np.mgrid[:side, :side] * PITCH - centre
    away = np.hypot(x, y)
    noise = cases.rough_heights((side, side), rng)
    steps = gaussian_filter(rng.standard_normal((side, side)), 12.0, mode="reflect")
    needles = np.where(rng.random((side, side)) < 0.01, 1e-3, 0.0)
    radius = 0.8 * side * PITCH
    ring = 1e-3 / (2.0 * np.pi)
    heights: dict[str, tuple[FloatArray, float]] = {
        "noise": (noise, -1.5e-3),
        "needles": (needles, -2e-3),
        "plateaus": (0.3e-3 * np.round(steps / steps.std()), -2e-3),
        "concentric grooves": (0.2e-3 * np.cos(away / ring), 0.2e-3 - ring**2 / 0.2e-3),
        "dome": (np.sqrt(radius**2 - away**2) - radius, -radius),
    }
    return {
        name: (HeightMap(values, PITCH), np.array([[centre, centre, z]]))
        for name, (values, z) in heights.items()
    }


def many_waves() -> tuple[Fourier, FloatArray]:
    """Return a sum of waves of all directions, and a probe (1, 3) [m] far below it."""
    return wave_sum(WAVES, cases.SEED), np.array([[0.0, 0.0, -1e-2]])


def wave_sum(count: int, seed: int = 5) -> Fourier:
    """Return a sum of waves of random directions with the RMS height of ``many_waves``."""
    rng = np.random.default_rng(seed)
    length = 2.0 * np.pi / 1e-3 * rng.uniform(0.3, 1.5, count)
    turn = rng.uniform(0.0, 7.0, count)
    vectors = length[:, None] * np.column_stack([np.cos(turn), np.sin(turn)])
    return Fourier(np.full(count, 4e-5 * np.sqrt(WAVES / count)), vectors, turn)


def strokes(surface: Surface) -> list[FloatArray]:
    """Return eight straight strokes (n, 3) [m] of 5 to 100 mm/s, half and fully pressed.

    Every other one keeps its height, the others their depth.
    """
    rng, texture = np.random.default_rng(3), surface.texture
    paths = []
    for n in range(8):
        depth, speed = (1.0, 0.5)[n // 4] * surface.max_depth, (0.005, 0.02, 0.05, 0.1)[n % 4]
        turn, start = rng.uniform(0.0, 2.0 * np.pi), rng.uniform(2e-3, 20e-3, 2)
        way = speed / RATE * np.arange(TICKS)[:, None] * np.array([np.cos(turn), np.sin(turn)])
        top = texture.height(start + way) if n % 2 else np.full(TICKS, texture.extremes[1])
        paths.append(np.ascontiguousarray(np.column_stack([start + way, top - depth])))
    return paths


def strokes_table() -> tuple[Table, list[str]]:
    """Return what ticks along strokes cost and how many are truncated, and the goals missed."""
    headings = ("truncated", "evaluations\nmean", "99.9 %", "most", "µs\na tick")
    table = number_table("law", "surface", *headings, left=2)
    maps = adversarial_textures()
    textures: dict[str, Texture] = {name: maps[name][0] for name in ("needles", "plateaus")}
    textures |= {f"{count} waves": wave_sum(count) for count in (3, 6, 8)}
    textures |= {"cloth": as_texture("cloth"), f"{WAVES} waves": many_waves()[0]}
    missed = []
    for name, texture in textures.items():
        for law in "DH":  # E searches as D does
            surface = Surface(texture, law, cases.STIFFNESS)
            counts, times = [], []
            for path in strokes(surface):
                stroke = surface_ticks(surface, path)
                stroke.run()
                times.append(min(seconds(stroke.run) for _turn in range(TURNS)))
                counts.append(stroke.told)
            bounds, evaluations = np.concatenate(counts).T
            share = float(np.mean(bounds > 0.0))
            cells = [f"{share:.2%}", f"{evaluations.mean():.0f}"]
            cells += [f"{np.quantile(evaluations, 0.999):.0f}", f"{evaluations.max():.0f}"]
            table.add_row(law, name, *cells, f"{np.mean(times) / TICKS * 1e6:.1f}")
            if share > TRUNCATED and name != f"{WAVES} waves":
                missed.append(f"{law} on {name}: {share:.2%}")
    return table, missed


def run(console: Console) -> None:
    """Print a row for each surface and law, and whether the goals are met."""
    table, missed = strokes_table()
    console.print("strokes of 5 to 100 mm/s at 4 kHz, half and fully pressed, with the budgets")
    console.print(table)
    print_verdict(console, f"at most {TRUNCATED:.1%} truncated", missed)
    console.print()
    ratios = friction_ratios()
    cells = ", ".join(f"{law} {ratio:.2f}" for law, ratio in ratios.items())
    console.print(f"a tick on knurl with friction over one without: {cells}")
    over = [f"{ratios['H']:.2f}"] if ratios["H"] > FRICTION_RATIO else []
    print_verdict(console, f"H at most {FRICTION_RATIO}", over)
    console.print()
    _run_longest(console)


def friction_ratios() -> dict[str, float]:
    """Return the time of a tick on knurl with friction over that without, by law."""
    ratios = {}
    for law in "CDH":
        times = []
        for friction in (0.0, 0.4):
            surface = rendered_surface(Surface("knurl", law, friction=friction))
            stroke = surface_ticks(surface, strokes(surface)[3])
            stroke.run()
            times.append(min(seconds(stroke.run) for _turn in range(20 * TURNS)))
        ratios[law] = times[1] / times[0]
    return ratios


def _run_longest(console: Console) -> None:
    headings = ("longest\ntick µs", "evaluations", "truncated", "error\nbound µm")
    table = number_table("law", "surface", *headings, left=2)
    missed: list[str] = []
    surfaces: dict[str, tuple[Texture, FloatArray]] = {**adversarial_textures()}
    surfaces[f"{WAVES} waves"] = many_waves()
    for name, (texture, centre) in surfaces.items():
        for law in "DH":
            surface = Surface(texture, law, cases.STIFFNESS)
            longest, cells = _longest(surface, _probes(texture, centre))
            table.add_row(law, name, *cells)
            if longest > LONGEST[law]:
                missed.append(f"{law} on {name}: {longest:.0f} µs")
    console.print(
        f"maps of {SIDE} x {SIDE} and a sum of {WAVES} waves;"
        "\nticks at 0.3 to 3 times max_depth and at centres of curvature;"
        "\nerror bound of D: a point may be nearer by so much; of H: of force over stiffness"
    )
    console.print(table)
    print_verdict(console, "longest tick D 50, H 150 µs", missed)


def _probes(texture: Texture, centre: FloatArray) -> FloatArray:
    rng = np.random.default_rng(cases.SEED + 5)
    xy = rng.uniform(0.1, 0.9, (PROBES, 2)) * SIDE * PITCH
    deep = Surface(texture).max_depth * rng.choice([0.3, 1.0, 1.0, 3.0], PROBES)
    random = np.column_stack([xy, texture.height(xy) - deep])
    near = centre + np.array([[0, 0, 0], [1e-7, 0, 0], [1e-4, 1e-5, 0], [0, 0, 0.5 * centre[0, 2]]])
    return np.ascontiguousarray(np.concatenate([random, near]))


def _longest(surface: Surface, probes: FloatArray) -> tuple[float, list[str]]:
    """Return the longest tick [µs], and the cells that tell of it."""
    rows = []
    for probe in probes:
        tick = surface_ticks(surface, probe[None].copy())
        least = min(seconds(tick.run) for _turn in range(TURNS))
        rows.append((least * 1e6, *tick.told[0]))
    times, gaps, looks = np.array(rows).T
    cells = [f"{times.max():.1f}", f"{looks.max():.0f}", f"{np.mean(gaps > 0.0):.0%}"]
    return float(times.max()), [*cells, f"{gaps.max() * 1e6:.3g}"]
