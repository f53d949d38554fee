"""Sections IV.D and IV.E and appendix II: the two god-object laws."""

from __future__ import annotations

import math

import numpy as np

from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.field_energy import loop_work
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.paper import cases, formula_checks
from asperity.paper.claim import Check, check_statement, check_values, combine_checks
from asperity.paper.formula_checks import FormulaRow
from asperity.paper.probes import generic_probes

_LABEL = "f_x of D at generic probes, by definition and kernel"

# --- D --------------------------------------------------------------------------------------------


def field_d() -> Check:
    """Force of D, a spring to the nearest point; conservative.

    Conservative also across the ridges where it jumps.
    """
    energy = formula_checks.max_loop_share("D")
    loops = check_statement(printed=energy < 1e-7, loop=energy)
    row = FormulaRow(law="D", quantity="force", printed="[-k*rx, -k*rz]", conservative={"D": True})
    return combine_checks(row.check(), loops)


def force_x_of_d() -> Check:
    """f_x of D after (33) is used.

    Including f_x = 0 where h' = 0.
    """
    row = FormulaRow(law="D", quantity="force", true="fx", printed="-k*rx", label=_LABEL)
    share = 0.0
    for case in cases.random_settings():
        for x, height in ((0.25, case.amplitude), (0.75, -case.amplitude)):
            probe = [[x * case.period, 0.0, height - 0.7 * case.crest_radius]]
            force = case.surface("D").force(probe)[0]
            share = max(share, abs(float(force[0] / force[2])))
    level = check_statement(printed=share < 1e-9, greatest_share=share)
    return combine_checks(row.check(), level)


def singular_d() -> Check:
    """Moving at right angles to the penetration leaves D's force as it is."""
    shares = []
    for probe in generic_probes("D"):
        x, z = probe.from_closest_point / probe.distance
        for matrix in (probe.jacobian(), probe.compiled_jacobian()):
            shares.append(float(np.linalg.norm(matrix @ [-z, x])) / probe.k)
    return check_statement(printed=max(shares) < 1e-9, change_per_length_over_stiffness=shares)


def number_d() -> Check:
    """‖J_D‖ = κ₀ whatever the surface, and q_D = 1."""
    norms = [float(s.norms().max()) / s.k for s in generic_probes("D", 12)]
    surface = cases.PASSIVITY.surface("D")
    q = characteristic_number(surface)
    plus = one_sided_number(surface)
    shallow = characteristic_number(
        cases.BUMP.surface("D", max_depth=0.8 * cases.BUMP.crest_radius)
    )
    return check_statement(
        printed=max(norms) <= 1.0 + 1e-9 and abs(q.value - 1.0) < 1e-9,
        greatest_norm=max(norms),
        q=q.value,
        q_at_0_8_of_the_radius=shallow.value,
        one_sided_number=plus.value,
    )


def remark_6() -> Check:
    """D's force jumps, on a sinusoid below its maxima (Fig. 2); its potential has a kink there."""
    checks = [_check_jumps(name, case) for name, case in cases.SETTINGS.items()]
    return combine_checks(*checks, _check_potential_kink())


def _check_jumps(name: str, case: cases.ExperimentCase) -> Check:
    """Check that the force of D jumps below the maxima only."""
    surface = case.surface("D")
    result = continuity(surface, characteristic_number(surface))
    offset = max(
        (abs((j.before[0] / case.period + 0.25) % 1.0 - 0.5) for j in result.jumps),
        default=math.inf,
    )
    size = max((jump.size for jump in result.jumps), default=0.0)
    return check_statement(
        f"{name}: {len(result.jumps)} jumps located, up to {size:.2f} N, all within {offset:.1e} l "
        f"of a maximum, from {case.crest_radius * 1e3:.3f} mm down",
        printed=not result.continuous and offset < 1e-6,
        numbers={
            f"{name}: greatest jump [N]": size,
            f"{name}: farthest from a maximum [l]": offset,
        },
    )


def _check_potential_kink() -> Check:
    """Check that the potential of D is continuous across the ridge but not differentiable."""
    case = cases.SCANNING
    surface = case.surface("D")
    crest = 0.25 * case.period
    level = case.amplitude - case.depth
    step = 1e-9
    points = cases.path_points((crest - step, level), (crest, level), (crest + step, level))
    energy = 0.5 * case.stiffness * ((surface.texture.nearest(points) - points) ** 2).sum(axis=1)
    left, right = np.diff(energy) / step
    change = float(abs(energy[2] - energy[0]) / energy[1])
    return check_statement(
        f"across a ridge the potential changes by {change:.1e} of itself, its slope by "
        f"{abs(right - left):.3f} N",
        printed=change < 1e-6 and abs(right - left) > 1e-2,
        change_of_slope=float(abs(right - left)),
    )


# --- E --------------------------------------------------------------------------------------------


def norm_e() -> Check:
    """‖J_E‖ = κ₀ and q_E = 1."""
    probes = list(generic_probes("E", 6))
    norms = check_values(
        "norm of the Jacobian of E at 6 generic probes",
        printed=[[probe.k, probe.k] for probe in probes],
        reference=[probe.norms() for probe in probes],
    )
    q = cases.PASSIVITY.q("E")
    number = check_values("q_E in V.A's setting", printed=1.0, reference=q)
    return combine_checks(norms, number, _check_lipschitz_e())


def _check_lipschitz_e() -> Check:
    """Check |f(a) - f(b)| <= κ₀ |a - b| for pairs of probes, also across ridges."""
    surface = cases.PASSIVITY.surface("E")
    rng = np.random.default_rng(3)
    ends = rng.uniform(0.0, 1e-3, (2, 4000, 3)) - np.array([0.0, 0.0, 1e-3])
    ends[..., 1] = 0.0
    ends[1] = ends[0] + (ends[1] - ends[0]) * rng.uniform(1e-4, 1.0, (4000, 1))
    ratio = formula_checks.max_difference_quotient(surface, ends) / surface.stiffness
    return check_statement(printed=ratio <= 1.0 + 1e-9, greatest_slope_of_pairs=ratio)


def energy_e() -> Check:
    """Around the path of Fig. 3 E gains energy, on the rising leg only."""
    least = math.inf
    other = 0.0
    for case in [cases.SCANNING, *cases.random_settings()]:
        surface = case.surface("E")
        points = case.groove_path()
        scale = case.stiffness * case.amplitude**2
        gain = formula_checks.segment_work(surface, points[1], points[2])
        total = loop_work(surface, points, 1e-9)
        least = min(least, total / scale)
        other = max(other, abs(total - gain) / scale)
    is_true = least > 0.0 and other < 1e-7
    gain_of_one_leg = check_statement(printed=is_true, least_gain=least, other_legs=other)
    return combine_checks(gain_of_one_leg, formula_checks.check_curl("E", is_conservative=False))


def remark_7() -> Check:
    """E is not conservative, but does not jump."""
    surface = cases.PASSIVITY.surface("E")
    result = continuity(surface, characteristic_number(surface))
    across = cases.path_points((0.25e-3 - 1e-12, 0.0), (0.25e-3 + 1e-12, 0.0))
    jump = float(np.linalg.norm(np.diff(surface.force(across), axis=0)))
    return combine_checks(
        check_statement(
            f"force of E across a ridge of D changes by {jump:.1e} N; {result.reason}",
            printed=result.continuous and jump < 1e-6,
            change_across_a_ridge=jump,
        ),
        formula_checks.check_curl("E", is_conservative=False),
    )
