"""Table II, and Remarks 1 to 3."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import lru_cache

import numpy as np

from asperity.analysis.energy.field_energy import loop_work
from asperity.analysis.gain.characteristic import characteristic_number
from asperity.laws import find_law
from asperity.paper import claim
from asperity.paper.cases import PAPER_CASE, SCANNING, ExperimentCase
from asperity.paper.figures import loop_energies
from asperity.paper.formula_checks import format_by_name
from asperity.paper.probes import generic_profile
from asperity.paper.table_two import TableTwoRow, table_two
from asperity.surface import Surface
from asperity.textures.kinds.fourier import Fourier
from asperity.textures.kinds.sinusoid import Sinusoid

# --- Table II -------------------------------------------------------------------------------------


_cached_table_two = lru_cache(maxsize=1)(table_two)


def check_table_two_row(letter: str) -> claim.Check:
    """Check the cells of a row of Table II."""
    row = _cached_table_two().row(letter)
    return claim.combine_checks(
        _check_number(row), _check_conservativity(row), _check_continuity(row)
    )


def figure_three_energies() -> claim.Check:
    """Along the paths of Fig. 3 A, B, E, F and G gain energy.

    C and D, which the figure does not show, must not gain.
    """
    scale = SCANNING.stiffness * SCANNING.amplitude**2
    energies = {panel.law: panel.energy for panel in loop_energies()}
    gains = {law: energy * 1e6 for law, energy in energies.items() if law not in "CD"}
    rest = max([abs(energies[law]) for law in "CD"]) / scale
    return claim.check_statement(
        f"around their paths {format_by_name(gains, '.1f', ' µJ')}; C and D around that of A "
        f"{rest:.1e} κ₀A²",
        printed=min(gains.values()) > scale and rest < 1e-6,
        numbers={f"energy of {law}": energy for law, energy in energies.items()},
    )


def _check_number(row: TableTwoRow) -> claim.Check:
    if row.law == "F":
        return _check_appendix_bound(row)
    if row.printed.value is None:
        exists = row.q.method == "closed form"
        return claim.check_statement(
            f"q = {row.q.value:.4f} ({row.q.method})",
            printed=not exists,
            corrected=exists,
            q=row.q.value,
        )
    return claim.check_values(
        f"q_{row.law} in V.A's setting",
        printed=row.printed.value,
        reference=row.q.value,
        correction=f"q_{row.law} is {row.formula}; 1 is the one-sided number",
        tolerance=1e-6,
    )


def _check_appendix_bound(row: TableTwoRow) -> claim.Check:
    """Check the bound of Appendix I on law F; the package's law has a number of its own."""
    bound = PAPER_CASE.sticking_norm()
    true = PAPER_CASE.max_norm_ratio()
    return claim.check_statement(
        printed=abs(bound / true - 1.0) < 1e-6,
        corrected=bound > max(true, row.q.value),
        bound=bound,
        number_of_the_papers_law=true,
        number_of_the_packages_law=row.q.value,
    )


def _check_conservativity(row: TableTwoRow) -> claim.Check:
    property_name = "conservative" if row.conservative else "not conservative"
    return claim.check_statement(
        f"{property_name}, the loop gives {row.energy * 1e6:+.1f} µJ",
        printed=row.conservativity_agrees,
        corrected=not row.conservative and row.energy > 0.0,
        energy=row.energy,
    )


def _check_continuity(row: TableTwoRow) -> claim.Check:
    """Check the condition on h: a force that depends on h' jumps where h' jumps."""
    from asperity.contacts.symbols import HX
    from asperity.derive.derivatives import symbolic_force

    uses_slope = HX in symbolic_force(find_law(row.law)).free_symbols
    needs_slope = "h'" in row.printed.continuous
    is_unconditional = row.printed.continuous.startswith("No")
    return claim.check_statement(
        f"{'continuous' if row.continuous else 'jumps'} on a smooth surface, its formula "
        f"{'uses' if uses_slope else 'does not use'} h'",
        printed=row.continuity_agrees and (is_unconditional or uses_slope == needs_slope),
    )


# --- Remarks --------------------------------------------------------------------------------------


def observe() -> claim.Check:
    """Leave a statement undecided on which nothing can be computed."""
    return claim.check_observation()


def remark_2() -> claim.Check:
    """The results hold for any texture with a Lipschitz bound M in the place of 2πA/l.

    Two textures of the same M and different curvatures are compared.
    """
    cases = [ExperimentCase(1000.0, 2e-3 / n, 0.2e-3 / n, depth=0.02e-3) for n in (1.0, 100.0)]
    numbers = {law: [case.q(law) for case in cases] for law in "ABCDEG"}
    # The paper's own bound for F, whose h is dimensionless.
    numbers["F"] = [
        replace(PAPER_CASE, amplitude=0.8 / n, period=1e-3 / n).sticking_norm()
        for n in (1.0, 100.0)
    ]
    unchanged = [law for law, pair in numbers.items() if claim.relative_error(*pair) < 1e-9]
    changed = [law for law in numbers if law not in unchanged]
    margin = _least_bound_ratio()
    growth = ", ".join([f"{law} {numbers[law][0]:.2f} to {numbers[law][1]:.2f}" for law in changed])
    return claim.check_statement(
        f"waves 100 times finer at the same M leave q of {', '.join(unchanged)} as it is and "
        f"change {growth}; bounds with K >= |h''| are at least {margin:.3f} times q",
        printed=not changed,
        corrected=sorted(unchanged) == ["A", "E", "F"] and margin >= 1.0,
        numbers={f"q_{law}, coarse and fine": pair for law, pair in numbers.items()},
        least_margin=margin,
    )


def _least_bound_ratio() -> float:
    """Return the least ratio to q of the bounds by M and K, on sums of waves."""
    least = math.inf
    for seed, dk in ((5, 0.45), (6, 0.45), (5, 6.0)):
        texture: Fourier = generic_profile(seed)
        slope, curvature = texture.bounds
        root = math.hypot(1.0, slope)
        depth = dk / curvature
        bounds = {"A": root, "B": root + dk, "C": 1.0 + slope**2 + dk, "G": max(1.0, dk)}
        if dk <= 0.5:
            bounds["D"] = 1.0
        for law, bound in bounds.items():
            q = characteristic_number(Surface(texture, law, max_depth=depth))
            least = min(least, bound * (1.0 + 1e-9) / q.lower)
    return least


def remark_3() -> claim.Check:
    """Limiting the depth that the lateral force uses bounds the numbers of B, C, F and G."""
    growth = _growth_with_depth("none")
    lateral = _growth_with_depth("lateral")
    whole = _growth_with_depth("whole")
    lateral_loop = _clamped_loop_work("lateral")
    whole_loop = _clamped_loop_work("whole")
    bounded = "".join([law for law, ratio in lateral.items() if ratio <= 1.0 + 1e-6])
    return claim.combine_checks(
        claim.check_statement(
            printed=min(growth.values()) > 1.5,
            numbers={f"growth of {law}": value for law, value in growth.items()},
        ),
        claim.check_statement(
            f"with the lateral force held it grows {format_by_name(lateral)} times, with the whole "
            f"force held {format_by_name(whole)} times",
            printed=bounded == "BCFG",
            corrected=max(whole.values()) <= 1.0 + 1e-6 and abs(whole_loop) < 1e-12,
            bounded_by_the_lateral_clamp=bounded,
            loop_of_C_lateral=lateral_loop,
            loop_of_C_whole=whole_loop,
        ),
    )


def _growth_with_depth(clamp: str) -> dict[str, float]:
    """Return by which factor the norms of laws grow at 50 times the depth."""
    return {
        law: _max_norm_at_depth(law, clamp, 50.0) / _max_norm_at_depth(law, "none", 1.0)
        for law in "BCFG"
    }


def _clamped_loop_work(clamp: str) -> float:
    surface = SCANNING.surface("C", clamp=clamp, max_depth=0.1e-3)
    return loop_work(surface, SCANNING.groove_path())


def unbounded_friction() -> claim.Check:
    """The gain of F grows with the depth without bound; clamping p^z bounds it."""
    factors = (1.0, 10.0, 1000.0)
    free = [_max_norm_at_depth("F", "none", factor) / 1000.0 for factor in factors]
    clamped = [_max_norm_at_depth("F", "lateral", factor) / 1000.0 for factor in factors]
    return claim.check_statement(
        "‖J_F‖/κ₀ at 1, 10, 1000 times the depth: "
        + ", ".join([f"{v:.3g}" for v in free])
        + "; with p^z clamped "
        + ", ".join([f"{v:.3g}" for v in clamped]),
        printed=free[2] > 50.0 * free[1] and clamped[2] <= free[0] * (1.0 + 1e-9),
        free=free,
        clamped=clamped,
    )


def _max_norm_at_depth(law: str, clamp: str, depth_factor: float) -> float:
    """Return the greatest ‖J‖ over x at a multiple of the depth; for F, over both phases."""
    texture = Sinusoid(0.2e-3, 1e-3)
    surface = Surface(texture, law, max_depth=0.3e-3, clamp=clamp)
    x = np.arange(2000) / 2000 * texture.period
    xy = np.column_stack([x, 0 * x])
    level = 0.0 if law in "FG" else texture.height(xy)
    points = np.column_stack([xy, level - depth_factor * 0.3e-3 * (1.0 - 1e-12) + 0 * x])
    if law != "F":
        return float(np.linalg.norm(surface.jacobian(points), 2, axis=(1, 2)).max())
    norms = []
    for sign in (-1.0, 1.0):
        for slides in (False, True):
            d = np.column_stack([np.full(len(x), sign * surface.max_deflection), 0 * x])
            jacobian = surface.jacobian(points, deflection=d, sliding=np.full(len(x), slides))
            norms.append(np.linalg.norm(jacobian, 2, axis=(1, 2)).max())
    return float(max(norms))
