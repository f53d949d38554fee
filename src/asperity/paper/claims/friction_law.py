"""Section IV.F and appendix I: friction modulated by the texture, and its bound."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import replace
from typing import Any

import numpy as np

from asperity.analysis.energy.field_energy import loop_work
from asperity.core.checks import FloatArray
from asperity.paper import claim
from asperity.paper.cases import (
    PAPER_CASE,
    SCANNING,
    FrictionCase,
    random_friction_cases,
    random_settings,
)
from asperity.paper.formula_checks import evaluate_formula
from asperity.paper.probes import Potential, generic_probes, numerical_gradient
from asperity.surface import Surface

_TWO_PI = 2.0 * math.pi


# --- field and Jacobian ---------------------------------------------------------------------------


def field_f() -> claim.Check:
    """Force of F: the wall, and friction that h modulates.

    Compared with the definition, and by the work of friction on a sliding probe.
    """
    force = _check_force(9, lambda pull, _share: -pull)
    return claim.combine_checks(force, _check_sliding_work())


def table_one_f() -> claim.Check:
    """Force of F (Fig. 2): [-κ(x) d, -κ₀ d].

    With κ(x) = μκ₀(1 - h), d = p^z.
    """
    return _check_force(19, lambda pull, share: -pull / share)


def _check_force(seed: int, printed: Callable[[float, float], float]) -> claim.Check:
    """Compare a formula for f_x, and one that opposes the deflection, with definition and kernel.

    Its arguments are μκ₀(1 - m) p^z d/d_max and d/d_max.
    """
    from asperity.paper.reference import exact_force

    rng = np.random.default_rng(seed)
    printed_forces = []
    corrected_forces = []
    reference = []
    for spot in generic_probes("F"):
        surface = spot.surface
        k, middle, half = surface.law_arguments[:3]
        m = 0.5 * (1.0 + surface.modulation_depth * (spot.h - middle) / half)
        share = rng.uniform(-1.0, 1.0)
        pull = k * surface.friction * (1.0 - m) * spot.z * share
        probe = [spot.x, 0.0, spot.z]
        d = [share * surface.max_deflection, 0.0]
        exact = exact_force(surface, probe, d)
        kernel = surface.force([probe], [d])[0]
        printed_forces += [[printed(pull, share), -k * spot.z]] * 2
        corrected_forces += [[pull, -k * spot.z]] * 2
        reference += [[float(exact[0]), float(exact[2])], [kernel[0], kernel[2]]]
    return claim.check_values(
        "force of F at 4 generic probes, by definition and kernel",
        printed=printed_forces,
        corrected=corrected_forces,
        reference=reference,
    )


def _check_sliding_work() -> claim.Check:
    """Check the sign of friction by 1 mm of sliding with d = d_max at 1 mm depth and h = 0."""
    work = SCANNING.stiffness * SCANNING.friction * 1e-3 * 1e-3
    return claim.check_statement(printed=work < 0.0, corrected=-work < 0.0, work_as_printed=work)


def jacobian_f() -> claim.Check:
    """Jacobian of F.

    Compared with differences of (22) as printed, and, with opposite friction, with the kernel.
    """
    rng = np.random.default_rng(13)
    printed = []
    corrected = []
    reference = []
    for case in random_friction_cases(6):
        x = rng.uniform(0.0, case.period)
        d = rng.uniform(-1.0, 1.0) * case.deflection
        for rate in (1.0, 0.0):  # sticking, sliding
            force = _printed_force_components(case, x, d, rate)
            probe = [x, 0.0, -case.depth]
            kernel = case.surface().jacobian([probe], [[d, 0.0]], np.array([rate == 0.0]))[0]
            # The kernel's friction opposes the motion, see (22).
            mirrored = kernel[np.ix_([0, 2], [0, 2])] * [[-1.0], [1.0]]
            reference += [[numerical_gradient(part, 0.0, -case.depth) for part in force], mirrored]
            h = float(case.modulation(x))
            slope = float(case.modulation(x, 1))
            printed += [_printed_jacobian(case, d, h, rate, slope)] * 2
            corrected += [_printed_jacobian(case, d, h, rate, slope * d)] * 2
    return claim.check_values(
        "Jacobian of (22) and of its kernel at 12 random states",
        printed=printed,
        corrected=corrected,
        reference=reference,
    )


def _printed_force_components(
    r: FrictionCase, x: float, d: float, rate: float
) -> tuple[Potential, Potential]:
    def friction(dx: Any, z: Any) -> Any:
        share = 1 - r.modulation(x + dx)
        return -r.friction * share * (d + rate * dx) / r.deflection * z

    return friction, lambda _dx, z: -z


def _printed_jacobian(
    r: FrictionCase, d: float, h: float, rate: float, slope: float
) -> list[list[float]]:
    """Return (23) over κ₀ with ``slope`` in the place of h'."""
    first = r.friction * -r.depth / r.deflection * (rate - h * rate - slope)
    return [[-first, -r.friction * (1.0 - h) * d / r.deflection], [0.0, -1.0]]


def stick_slip_phases() -> claim.Check:
    """d follows the probe while d < d_max and does not change while d = d_max.

    Checked with the package's anchor on a path forth and back.
    """  # noqa: D403 - a symbol
    case = random_settings(1, 21)[0]
    surface = case.surface("F", modulation_depth=0.0)
    reach = case.deflection
    x = np.concatenate([np.linspace(0.0, 3.3, 1001), np.linspace(3.3, -1.7, 1489)[1:]]) * reach
    path = np.column_stack([x, 0.0 * x, np.full(len(x), -case.depth)])
    force = surface.trace(path)
    d = -force[:, 0] * reach / (0.5 * case.friction * force[:, 2])
    rate = np.diff(d) / np.diff(x)
    # Steps in which sticking ends are excluded: they belong to neither phase.
    pure = (np.abs(rate) < 1e-6) | (np.abs(rate - 1.0) < 1e-6)
    end = d[1:][pure]
    rate = rate[pure]
    is_sliding = np.abs(rate) < 0.5
    forward = is_sliding == (np.abs(end - reach) < 1e-9 * reach)
    both = is_sliding == (np.abs(np.abs(end) - reach) < 1e-9 * reach)
    return claim.check_statement(
        f"of {len(end)} steps forth and back",
        printed=bool(forward.all() and len(pure) - pure.sum() <= 3),
        corrected=bool(both.all() and len(pure) - pure.sum() <= 3),
        share_as_printed=float(forward.mean()),
        share_with_absolute_value=float(both.mean()),
    )


def sliding_entries_bound() -> claim.Check:
    """Greatest entries of F's Jacobian while sliding."""
    cases = [PAPER_CASE, *random_friction_cases()]
    first = [_TWO_PI * r.friction * r.depth * r.amplitude / r.period for r in cases]
    second = [r.friction * (1.0 + r.amplitude) for r in cases]
    return claim.check_values(
        "greatest entries while sliding, 5 parameter sets",
        printed=np.column_stack([first, [2.0 * r.friction for r in cases]]),
        corrected=np.column_stack([first, second]),
        reference=np.array([r.max_entries()[0] for r in cases]),
        tolerance=1e-8,
    )


def sticking_entries_bound() -> claim.Check:
    """Greatest entries of F's Jacobian while sticking."""
    cases = [PAPER_CASE, *random_friction_cases()]
    printed = np.array([case.sticking_entries() for case in cases])
    reference = np.array([case.max_entries()[1] for case in cases])
    entries = claim.check_values(
        "greatest entries while sticking, 5 parameter sets",
        printed=printed,
        corrected=[_corrected_sticking_entries(case) for case in cases],
        reference=reference,
        tolerance=1e-8,
    )
    ratios = (printed / reference).ravel().tolist()
    bound = claim.check_statement(printed=min(ratios) >= 1.0, ratios_to_the_greatest=ratios)
    return claim.combine_checks(entries, bound)


def _corrected_sticking_entries(r: FrictionCase) -> tuple[float, float]:
    variation = r.amplitude * math.hypot(1.0, _TWO_PI * r.deflection / r.period)
    gain = r.friction * r.depth / r.deflection
    return gain * (1.0 + variation), r.friction * (1.0 + r.amplitude)


# --- energy ---------------------------------------------------------------------------------------


def energy_f() -> claim.Check:
    """Energy of F without texture around its path of Fig. 3.

    Without texture, twice the friction makes the law's m = 1/2 equal to the paper's h = 0.
    """
    cases = [SCANNING, *random_settings(4)]
    share = 0.2
    printed = []
    reference = []
    limit = 0.0
    for case in cases:
        surface = case.untextured_friction()
        whole = 0.5 * case.stiffness * case.friction * case.depth * case.deflection
        printed.append(whole)
        reference.append(loop_work(surface, case.friction_path(share * case.depth)))
        shallow = loop_work(surface, case.friction_path(1e-7 * case.depth))
        limit = max(limit, abs(shallow / whole - 1.0))
    return claim.combine_checks(
        claim.check_values(
            f"energy around the path with a = {share:g} d_max^z, {len(cases)} parameter sets",
            printed=printed,
            corrected=np.array(printed) * (1.0 - share),
            reference=reference,
        ),
        claim.check_statement(printed=limit < 1e-6, error_in_the_limit=limit),
    )


def sticking_generates_energy() -> claim.Check:
    """F generates energy while sticking only, which is at most 2 d_max wide."""
    case = SCANNING
    surface = case.surface("F")
    reach = case.deflection
    x = np.concatenate([np.linspace(0.0, 4.0, 8001), np.linspace(4.0, -2.0, 12001)[1:]]) * reach
    path = np.column_stack([x, 0.0 * x, np.full(len(x), -case.depth)])
    force = surface.trace(path)[:, 0]
    gain = 0.5 * (force[1:] + force[:-1]) * np.diff(x)
    d = _anchor_deflection(x, reach)
    sliding = np.abs(np.abs(d[1:]) - reach) + np.abs(np.abs(d[:-1]) - reach) < 1e-9 * reach
    slip_gain = float(gain[sliding].max())
    stick_gain = float(gain[~sliding].max())
    back = np.flatnonzero(~sliding & (np.arange(len(gain)) >= 8000))
    width = float(np.abs(np.diff(x)[back]).sum()) / reach
    sticking = claim.check_statement(
        printed=slip_gain < 0.0 < stick_gain and width <= 2.0 + 1e-3,
        sliding=slip_gain,
        sticking=stick_gain,
        width_over_d_max=width,
    )
    return claim.combine_checks(sticking, _check_stiffening())


_PATHS = 40
_TURN = 40_000  # points


def _check_stiffening() -> claim.Check:
    """Check W = ∫ |d|²/2 dκ - ∫ κ d·da - ΔS of friction on random closed paths in contact.

    The spring κ = κ₀ δ₀ μ (1 - m)/d_max is stiffened while it is loaded. A rise from 0 to its
    greatest value gains at most ½ κ₀ D μ max(1 - m) d_max.
    """
    surface = SCANNING.surface("F")
    reach = SCANNING.deflection
    whole = 0.5 * SCANNING.stiffness * SCANNING.depth * SCANNING.friction * reach
    turns = list(_random_turns())
    balances = np.array([_friction_balance(surface, turn) for turn in turns])
    mended = max([_lateral_work(SCANNING.mended_friction(), turn)[0] for turn in turns])
    work, stiffening, slip, stored, rises = balances.T
    error = float(np.abs(work - (stiffening - slip - stored)).max()) / whole
    without = float(np.abs(work + slip + stored).max()) / whole
    share = float((work / (0.5 * reach**2 * rises)).max())
    greatest = 0.5 * (1.0 + surface.modulation_depth) * whole
    return claim.check_statement(
        f"on {_PATHS} random closed paths W = ∫|d|²/2 dκ - ∫κ d·da - ΔS within {error:.0e} of "
        f"½κ₀Dμd_max, off by {without:.2f} without the first integral; a rise of κ from 0 gains "
        f"up to ½κ₀Dμ max(1 - m) d_max = {1e3 * greatest:.3f} mJ, these paths {share:.2f} of their "
        f"rises; with a constant κ and the same limit the best path gives {1e3 * mended:+.3f} mJ",
        printed=error < 1e-5 and without > 0.01 and share <= 1.0 and mended < 0.0,
        error_of_the_identity=error,
        error_without_stiffening=without,
        greatest_gain_of_a_rise=greatest,
        share_of_the_rises=share,
        best_path_of_F_mended=mended,
    )


def _random_turns() -> Iterator[FloatArray]:
    """Yield closed paths (n, 3) [m] of three harmonics each, within the depth."""
    rng = np.random.default_rng(35)
    phases = _TWO_PI * np.arange(_TURN) / _TURN
    waves = np.concatenate([[np.cos(n * phases), np.sin(n * phases)] for n in (1, 2, 3)])
    for size in 10.0 ** rng.uniform(-0.5, 0.5, _PATHS):
        x, y, z = rng.normal(size=(3, 6)) @ waves
        depth = SCANNING.depth * (0.5 + 0.49 * np.tanh(z))
        yield np.column_stack(
            [size * SCANNING.deflection * x, size * SCANNING.deflection * y, -depth]
        )


def _lateral_work(surface: Surface, turn: FloatArray) -> tuple[float, FloatArray, FloatArray]:
    """Return the work of the lateral force in a second turn [J], its path and the force there."""
    path = np.concatenate([turn, turn, turn[:1]])
    force = surface.trace(path)[_TURN:, :2]
    path = path[_TURN:]
    pull = 0.5 * (force[1:] + force[:-1])
    return float(np.sum(pull * np.diff(path[:, :2], axis=0))), path, force


def _friction_balance(
    surface: Surface, turn: FloatArray
) -> tuple[float, float, float, float, float]:
    """Return work, stiffening, slip, change of stored energy [J] and rises of κ [N/m] in a turn.

    Of the second turn, by trapezoids; the deflection is that of the traced forces.
    """
    work, path, force = _lateral_work(surface, turn)
    full = np.tile([surface.max_deflection, 0.0], (len(path), 1))
    spring = -surface.force(path, full)[:, 0] / surface.max_deflection
    deflection = -force / spring[:, None]
    change = np.diff(spring)
    square = np.sum(deflection**2, axis=1)
    stored = 0.5 * spring * square
    relaxing = 0.5 * (force[1:] + force[:-1]) * np.diff(deflection, axis=0)
    return (
        work,
        float(np.sum(0.25 * (square[1:] + square[:-1]) * change)),
        float(np.sum(relaxing)) - work,
        float(stored[-1] - stored[0]),
        float(np.maximum(change, 0.0).sum()),
    )


def _anchor_deflection(x: FloatArray, max_deflection: float) -> FloatArray:
    """Return the deflection along a path by (24), |d| <= d_max."""
    d = np.zeros(len(x))
    for i in range(1, len(x)):
        d[i] = min(max(d[i - 1] + x[i] - x[i - 1], -max_deflection), max_deflection)
    return d


def compliant_materials() -> claim.Check:
    """The energy that is not conserved is proportional to d_max, as with d_max = 1 cm."""
    energies = []
    for deflection in (1e-3, 1e-2):
        case = replace(SCANNING, deflection=deflection)
        path = case.friction_path(1e-7 * case.depth)
        energies.append(loop_work(case.untextured_friction(), path))
    ratio = energies[1] / energies[0]
    energy = energies[1] * 1e3
    return claim.check_statement(
        f"d_max from 1 mm to 1 cm multiplies the energy by {ratio:.6f}, to {energy:.2f} mJ",
        printed=abs(ratio - 10.0) < 1e-6,
        energies=energies,
    )


def expand_bound(r: FrictionCase, formula: str) -> float:
    """Evaluate an expression for (31) in μ, the depth p, d_max = d and e = πA/l, in millimetres."""
    lengths = r.depth * 1e3, r.deflection * 1e3
    values = r.friction, *lengths, math.pi * r.amplitude / (r.period * 1e3)
    return float(evaluate_formula(formula, [values], "mu p d e")[0])


def friction_number_bound(printed: str, corrected: str) -> claim.Check:
    """An upper bound on q_F, and its expression written out."""
    cases = [PAPER_CASE, *random_friction_cases(6)]
    norms = [case.sticking_norm() for case in cases]
    ratios = [case.max_norm_ratio() / norm for case, norm in zip(cases, norms, strict=True)]
    bound = claim.check_statement(
        printed=max(ratios) <= 1.0, shares_of_the_bound=ratios, norm_for_section_V_A=norms[0]
    )
    written_out = claim.check_values(
        f"expression written out against that norm, {len(cases)} parameter sets",
        printed=[expand_bound(case, printed) for case in cases],
        corrected=[expand_bound(case, corrected) for case in cases],
        reference=norms,
    )
    return claim.combine_checks(bound, written_out)
