"""Tables I and II, and Remarks 1 to 3."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from functools import lru_cache, partial
from typing import Any

import numpy as np

from asperity.analysis.energy.loops import loop_work
from asperity.analysis.gain.characteristic import characteristic_number
from asperity.checks import FloatArray
from asperity.kernels.probe import ClampName
from asperity.laws import find_law
from asperity.paper.changes import FORCES, laws, numbers, observed, other
from asperity.paper.claim import (
    DECLARED,
    Check,
    Claim,
    decide,
    judge,
    judges,
    observation,
    relative_error,
    settle,
)
from asperity.paper.claims_appendix import true_number
from asperity.paper.claims_friction import PAPER, norm_of, stick_entries
from asperity.paper.comparisons import field_check
from asperity.paper.figures import loop_energies
from asperity.paper.plane import SCANNING, Setting, Spot, generic_profile, groove_path, spots
from asperity.paper.table_two import TableTwoRow, table_two
from asperity.surface import Surface
from asperity.textures.fourier import Fourier
from asperity.textures.sinusoid import Sinusoid

# --- Table I --------------------------------------------------------------------------------------


def _normal(s: Spot) -> FloatArray:
    return np.array([-s.slope, 1.0]) / math.hypot(1.0, s.slope)


@judges("table-1-A", "IV", "Table I", flipped_by=FORCES)
def row_a() -> Check:
    """Force of A (Fig. 2): [0, -κ₀ d]."""
    return field_check("A", lambda s: np.array([0.0, -s.k * s.d]))


@judges("table-1-BG", "IV", "Table I", flipped_by=FORCES)
def row_b_and_g() -> Check:
    """Force of B and G (Fig. 2): -κ₀ d n.

    One formula, two penetrations.
    """
    return settle(
        field_check("B", lambda s: -s.k * s.d * _normal(s)),
        field_check("G", lambda s: -s.k * s.z * _normal(s)),
    )


@judges("table-1-D", "IV", "Table I", flipped_by=FORCES)
def row_d() -> Check:
    """Force of D (Fig. 2): -κ₀ d^min n̂.

    Its n̂ read as the unit vector from the nearest point to the probe.
    """
    return field_check("D", lambda s: -s.k * s.distance * (s.from_foot / s.distance))


@judges("table-1-E", "IV", "Table I", flipped_by=FORCES)
def row_e() -> Check:
    """Force of E (Fig. 2): [0, -κ₀ d^min].

    d^min being a distance as the text below the table says.
    """
    return field_check(
        "E",
        lambda s: np.array([0.0, -s.k * s.distance]),
        lambda s: np.array([0.0, s.k * s.distance]),
        "d^min counted negative inside, as the other d are",
    )


@judges("table-1-F", "IV", "Table I", flipped_by=FORCES)
def row_f() -> Check:
    """Force of F (Fig. 2): [-κ(x) d, -κ₀ d].

    With κ(x) = μκ₀(1 - h), d = p^z.
    """
    from asperity.definition import exact_force

    printed, corrected, truth = [], [], []
    draw = np.random.default_rng(19)
    for spot in spots("F"):
        surface = spot.surface
        k, middle, half = surface.law_arguments[:3]
        m = 0.5 * (1.0 + surface.modulation_depth * (spot.h - middle) / half)
        share = draw.uniform(-1.0, 1.0)
        rub = k * surface.friction * (1.0 - m) * spot.z
        probe, d = [spot.x, 0.0, spot.z], [share * surface.max_deflection, 0.0]
        exact, kernel = exact_force(surface, probe, d), surface.force([probe], [d])[0]
        printed += [[-rub, -k * spot.z]] * 2
        corrected += [[rub * share, -k * spot.z]] * 2
        truth += [[float(exact[0]), float(exact[2])], [kernel[0], kernel[2]]]
    return judge(
        "force of F at 4 generic probes, by definition and kernel",
        printed=printed,
        corrected=corrected,
        truth=truth,
        correction="the x part times -d^x/d_max",
    )


@judges("table-1-C", "IV", "Table I", flipped_by=FORCES)
def row_c() -> Check:
    """Force of C (Fig. 2): [-κ₀ h' d, -κ₀ d]."""
    return field_check(
        "C",
        lambda s: np.array([-s.k * s.slope * s.d, -s.k * s.d]),
        lambda s: np.array([s.k * s.slope * s.d, -s.k * s.d]),
        "the x part with a plus sign, as in (14)",
    )


# --- Table II -------------------------------------------------------------------------------------


_table = lru_cache(maxsize=1)(table_two)


def table_two_row(letter: str) -> Check:
    """Judge a row of Table II, cell by cell."""
    row = _table().row(letter)
    return settle(_number_cell(row), _conservative_cell(row), _continuity_cell(row))


@judges("sentence-IV-figure-3", "IV.G", flipped_by=laws(A="C"))
def figure_3() -> Check:
    """Along the paths of Fig. 3 A, B, E, F and G gain energy.

    Every law that the figure shows gains; those that it does not show do not.
    """
    scale = SCANNING.stiffness * SCANNING.amplitude**2
    energies = {panel.law: panel.energy for panel in loop_energies()}
    shown = {law: energy for law, energy in energies.items() if law not in "CD"}
    rest = max(abs(energies[law]) for law in "CD") / scale
    said = ", ".join(f"{law} {energy * 1e6:.1f} µJ" for law, energy in shown.items())
    return decide(
        f"around their paths {said}; C and D around that of A {rest:.1e} κ₀A²",
        printed=min(shown.values()) > 1e-6 * scale and rest < 1e-6,
        numbers={f"energy of {law}": energy for law, energy in energies.items()},
    )


def _number_cell(row: TableTwoRow) -> Check:
    if row.law == "F":
        return _appendix_cell(row)
    if row.printed.value is None:
        exists = row.q.method == "closed form"
        return decide(
            f"q = {row.q.value:.4f} ({row.q.method})",
            printed=not exists,
            corrected=exists,
            correction=f"there is a closed form: q_{row.law} = {row.formula}",
            q=row.q.value,
        )
    return judge(
        f"q_{row.law} in V.A's setting",
        printed=row.printed.value,
        truth=row.q.value,
        correction=f"q_{row.law} is {row.formula}; 1 is the one-sided number",
        tolerance=1e-6,
    )


def _appendix_cell(row: TableTwoRow) -> Check:
    """Law F: Appendix I is a bound on the paper's law; the package's law has its own number."""
    bound, true = norm_of(*stick_entries(PAPER)), true_number(PAPER)
    return decide(
        f"Appendix I gives {bound:.4f}; the greatest ‖J‖/κ₀ of the paper's law is {true:.4f}, of "
        f"the package's, whose modulation stays between 0 and 1, {row.q.value:.4f}",
        printed=abs(bound / true - 1.0) < 1e-6,
        corrected=bound > max(true, row.q.value),
        correction="an upper bound, not attained",
        bound=bound,
        number_of_the_papers_law=true,
        number_of_the_packages_law=row.q.value,
    )


def _conservative_cell(row: TableTwoRow) -> Check:
    is_so = "conservative" if row.conservative else "not conservative"
    return decide(
        f"{is_so}, the loop gives {row.energy * 1e6:+.1f} µJ",
        printed=row.conservativity_agrees,
        corrected=not row.conservative and row.energy > 0.0,
        correction="conservative: no",
        energy=row.energy,
    )


def _continuity_cell(row: TableTwoRow) -> Check:
    """Judge the condition on h: a force that uses h' jumps where h' does."""
    from asperity.contacts.symbols import HX
    from asperity.derive.jacobian import symbolic_force

    uses = HX in symbolic_force(find_law(row.law)).free_symbols
    needs = "h'" in row.printed.continuous
    law_d = row.printed.continuous.startswith("No")
    return decide(
        f"{'continuous' if row.continuous else 'jumps'} on a smooth surface, its formula "
        f"{'uses' if uses else 'does not use'} h'",
        printed=row.continuity_agrees and (law_d or uses == needs),
    )


# --- Remarks --------------------------------------------------------------------------------------


@judges("remark-1", "IV", "Remark 1", flipped_by=observed("remark-1"))
def remark_1() -> Check:
    """What a texture feels like depends on more than the algorithm."""
    return observation(
        "remark-1", "a statement on perception and on real contacts: nothing here can be computed"
    )


def _finer(case: Setting, times: float) -> Setting:
    """Return a texture of the same slopes, finer by a factor."""
    return Setting(case.stiffness, case.period / times, case.amplitude / times, depth=case.depth)


@judges("remark-2", "IV", "Remark 2", flipped_by=numbers(1.1))
def remark_2() -> Check:
    """The results hold for any texture with a Lipschitz bound M in the place of 2πA/l.

    The same M, other curvatures.
    """
    base, numbers = Setting(1000.0, 2e-3, 0.2e-3, depth=0.02e-3), {}
    for law in "ABCDEG":
        pair = [characteristic_number(_finer(base, n).surface(law)).value for n in (1.0, 100.0)]
        numbers[law] = pair
    # The paper's own bound for F, whose h has no dimension.
    numbers["F"] = [
        norm_of(*stick_entries(replace(PAPER, amplitude=0.8 / n, period=1e-3 / n)))
        for n in (1.0, 100.0)
    ]
    fixed = [law for law, pair in numbers.items() if relative_error(*pair) < 1e-9]
    moved = [law for law in numbers if law not in fixed]
    margin = _safe_bounds()
    said = ", ".join(f"{law} {numbers[law][0]:.2f} to {numbers[law][1]:.2f}" for law in moved)
    return decide(
        f"waves 100 times finer at the same M leave q of {', '.join(fixed)} as it is and "
        f"change {said}; bounds with K >= |h''| are at least {margin:.3f} times q",
        printed=not moved,
        corrected=sorted(fixed) == ["A", "E", "F"] and margin >= 1.0,
        correction="M alone decides for A, E and F only; with a bound K on h'' too, "
        "q_B <= √(1 + M²) + DK, q_C <= 1 + M² + DK, q_G <= max(1, DK), q_D = 1 if DK <= 1/2",
        numbers={f"q_{law}, coarse and fine": pair for law, pair in numbers.items()},
        least_margin=margin,
    )


def _safe_bounds() -> float:
    """Return the least ratio of the bounds by M and K to q, on sums of waves."""
    least = math.inf
    for seed, bent in ((5, 0.45), (6, 0.45), (5, 6.0)):
        texture: Fourier = generic_profile(seed)
        slope, bend = texture.bounds
        root, depth = math.hypot(1.0, slope), bent / bend
        bounds = {"A": root, "B": root + bent, "C": 1.0 + slope**2 + bent, "G": max(1.0, bent)}
        if bent <= 0.5:
            bounds["D"] = 1.0
        for law, bound in bounds.items():
            q = characteristic_number(Surface(texture, law, max_depth=depth))
            least = min(least, bound * (1.0 + 1e-9) / q.lower)
    return least


def _with_clamp(name: ClampName, original: Callable[..., float]) -> Callable[..., float]:
    """Return ``_deep`` with one clamp in the place of the lateral one."""
    return lambda law, clamp, times: original(law, name if clamp == "lateral" else clamp, times)


WHOLE = other("a lateral clamp that holds the whole force", "_deep", partial(_with_clamp, "whole"))
UNCLAMPED = other("a lateral clamp that holds nothing", "_deep", partial(_with_clamp, "none"))


@judges("remark-3", "IV", "Remark 3", flipped_by=WHOLE)
def remark_3() -> Check:
    """Limiting the depth that the lateral force uses bounds the numbers of B, C, F and G."""
    growth = {law: _deep(law, "none", 50.0) / _deep(law, "none", 1.0) for law in "BCFG"}
    lateral = {law: _deep(law, "lateral", 50.0) / _deep(law, "none", 1.0) for law in "BCFG"}
    whole = {law: _deep(law, "whole", 50.0) / _deep(law, "none", 1.0) for law in "BCFG"}
    loops = {
        clamp: loop_work(
            SCANNING.surface("C", clamp=clamp, max_depth=0.1e-3), groove_path(SCANNING)
        )
        for clamp in ("lateral", "whole")
    }
    bounded = "".join(law for law, ratio in lateral.items() if ratio <= 1.0 + 1e-6)
    return settle(
        decide(
            "50 times deeper ‖J‖ grows " + _times(growth),
            printed=min(growth.values()) > 1.5,
            numbers={f"growth of {law}": value for law, value in growth.items()},
        ),
        decide(
            f"with the lateral force held it grows {_times(lateral)}, with the whole force held "
            f"{_times(whole)}; a loop of C then gives {loops['lateral'] * 1e6:.2f} and "
            f"{abs(loops['whole']) * 1e6:.2f} µJ",
            printed=bounded == "BCFG",
            corrected=max(whole.values()) <= 1.0 + 1e-6 and abs(loops["whole"]) < 1e-12,
            correction="the depth must be held in the whole force; held in the lateral part alone "
            "it does not bound B and G, and C is no longer conservative",
            bounded_by_the_lateral_clamp=bounded,
            loop_of_C_lateral=loops["lateral"],
            loop_of_C_whole=loops["whole"],
        ),
    )


@judges("sentence-IV.F-clamp", "IV.F", flipped_by=UNCLAMPED)
def unbounded_friction() -> Check:
    """The gain of F grows with the depth without bound; clamping p^z bounds it."""
    free = {times: _deep("F", "none", times) / 1000.0 for times in (1.0, 10.0, 1000.0)}
    held = {times: _deep("F", "lateral", times) / 1000.0 for times in (1.0, 10.0, 1000.0)}
    return decide(
        "‖J_F‖/κ₀ at 1, 10, 1000 times the depth: "
        + ", ".join(f"{v:.3g}" for v in free.values())
        + "; with p^z clamped "
        + ", ".join(f"{v:.3g}" for v in held.values()),
        printed=free[1000.0] > 50.0 * free[10.0] and held[1000.0] <= free[1.0] * (1.0 + 1e-9),
        free=list(free.values()),
        clamped=list(held.values()),
    )


def _times(ratios: dict[str, float]) -> str:
    return ", ".join(f"{law} {ratio:.2f}" for law, ratio in ratios.items()) + " times"


def _deep(law: str, clamp: ClampName, times: float) -> float:
    """Return the greatest ‖J‖ over x at some multiple of the depth, for F over both phases."""
    texture = Sinusoid(0.2e-3, 1e-3)
    surface = Surface(texture, law, max_depth=0.3e-3, clamp=clamp)
    x = np.arange(2000) / 2000 * texture.period
    xy = np.column_stack([x, 0 * x])
    level = 0.0 if law in "FG" else texture.height(xy)
    points = np.column_stack([xy, level - times * 0.3e-3 * (1.0 - 1e-12) + 0 * x])
    if law != "F":
        return float(np.linalg.norm(surface.jacobian(points), 2, axis=(1, 2)).max())
    best = 0.0
    for sign in (-1.0, 1.0):
        for slides in (False, True):
            d = np.column_stack([np.full(len(x), sign * surface.max_deflection), 0 * x])
            found = surface.jacobian(points, deflection=d, sliding=np.full(len(x), slides))
            best = max(best, float(np.linalg.norm(found, 2, axis=(1, 2)).max()))
    return best


def _printing(law: str, value: float, original: Callable[[], Any]) -> Callable[[], Any]:
    """Return Table II with another number printed for a law."""
    return lambda: original() | {law: replace(original()[law], value=value)}


_SAID = {
    "A": "q = √(1 + (2πA/l)²); not conservative; continuous if h is",
    "B": "no closed form; not conservative; continuous if h' is",
    "C": "no closed form; conservative; continuous if h' is",
    "D": "q = 1; conservative; not continuous even if h is",
    "E": "q = 1; not conservative; continuous if h is",
    "F": "q in Appendix I; almost conservative; continuous if h is",
    "G": "no closed form; not conservative; continuous if h' is",
}
_ROW_FLIPS = {
    **{
        law: laws(**{law: by})
        for law, by in {"A": "C", "B": "A", "C": "A", "E": "A", "G": "A"}.items()
    },
    "D": other("∞ printed for q of D", "_printed", partial(_printing, "D", math.inf)),
    "F": other(
        "Jacobians of the paper's F times 1.2", "true_number", lambda was: lambda r: 1.2 * was(r)
    ),
}
DECLARED += [
    Claim(
        f"table-2-{law}", ("Table II",), "IV.H", f"{law}: {said}.", partial(table_two_row, law),
        _ROW_FLIPS[law],
    )
    for law, said in _SAID.items()
]  # fmt: skip
