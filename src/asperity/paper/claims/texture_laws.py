"""Sections IV.A to IV.E and IV.G, appendix II: the laws A to E and G, god-object laws last."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.field_energy import loop_work
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.analysis.gain.proofs import q_b, q_c, q_g
from asperity.laws import Law, find_law
from asperity.paper import cases, formula_checks
from asperity.paper.cases import PASSIVITY, SCANNING, SETTINGS, ExperimentCase, random_settings
from asperity.paper.claim import Check, check_statement, check_values, combine_checks
from asperity.paper.formula_checks import (
    FormulaRow,
    check_curl,
    find_max_norm,
    max_loop_share,
    segment_work,
)
from asperity.paper.probes import generic_probes

# --- A --------------------------------------------------------------------------------------------


def number_a() -> Check:
    """The increase of stiffness by A is √(1 + h'²).

    The printed equation sets a ratio of the greatest norm equal to a local value.
    """
    probes = list(generic_probes("A"))
    x = np.linspace(0.0, 2.0 * math.pi / 1e3, 20001)
    gradients = probes[0].surface.texture.gradient(np.column_stack([x, 0 * x]))
    max_ratio = math.hypot(1.0, float(np.abs(gradients[:, 0]).max()))
    ratios = np.array([math.hypot(1.0, probe.slope) for probe in probes])
    local = check_values(
        "‖J‖/κ₀ at each place against √(1 + h'²)",
        printed=[ratios, ratios],
        reference=np.array([probe.norms() / probe.k for probe in probes]).T,
    )
    ratio = check_values(
        "κ_A^max/κ₀ against √(1 + h'²) at generic places",
        printed=ratios,
        corrected=np.full(len(probes), max_ratio),
        reference=np.full(len(probes), max_ratio),
    )
    return combine_checks(local, ratio)


def sinusoid_a() -> Check:
    """On a sinusoid the greatest norm is κ₀ √(1 + (2πA/l)²), at x = 0 mod π/l.

    Both the value and the place are checked.
    """
    cases = [PASSIVITY, SCANNING, *random_settings()]
    printed = [c.stiffness * math.hypot(1.0, 2.0 * math.pi * c.amplitude / c.period) for c in cases]
    norms = [case.stiffness * find_max_norm(case.surface("A")) for case in cases]
    value = check_values("greatest norm for 5 sinusoids", printed=printed, reference=norms)
    as_printed = _least_norm_share(cases, printed, [math.pi / case.period for case in cases])
    half = _least_norm_share(cases, printed, [0.5 * case.period for case in cases])
    place = check_statement(
        printed=as_printed > 1.0 - 1e-9,
        corrected=half > 1.0 - 1e-9,
        least_share_at_multiples_of_pi_over_l=as_printed,
        least_share_at_multiples_of_half_a_period=half,
    )
    return combine_checks(value, place)


def _least_norm_share(
    cases: list[ExperimentCase], max_norms: list[float], steps: list[float]
) -> float:
    """Return the least norm at multiples of a step over the greatest norm of each texture."""
    least = math.inf
    for case, max_norm, step in zip(cases, max_norms, steps, strict=True):
        x = np.arange(1, 6) * step
        slope = case.texture.gradient(np.column_stack([x, 0 * x]))[:, 0]
        norms = case.stiffness * np.hypot(1.0, slope)
        least = min(least, float(norms.min()) / max_norm)
    return least


def proportional_a() -> Check:
    """2πA/l is large, so A's number is nearly proportional to A and 1/l.

    Checked to a tenth for each of the paper's experiments.
    """
    slopes = {name: 2.0 * math.pi * case.amplitude / case.period for name, case in SETTINGS.items()}
    ratios = {name: case.q("A") / slopes[name] for name, case in SETTINGS.items()}
    summary = ", ".join([f"{name} {slopes[name]:.2f} ({ratios[name]:.3f})" for name in SETTINGS])
    return check_statement(
        f"2πA/l, and q_A over it: {summary}",
        printed=max([abs(ratio - 1.0) for ratio in ratios.values()]) < 0.1,
        numbers={f"q_A over 2πA/l in {name}": ratio for name, ratio in ratios.items()},
    )


# --- B --------------------------------------------------------------------------------------------


_CLOSED_FORMS = {"B": q_b, "C": q_c, "G": q_g}


def closed_forms() -> Check:
    """The numbers of B, C and G have no closed form, not even on a sinusoid: a search gives them.

    The paper says that none was found, which cannot be judged; that there is none can. A search
    over Jacobians, as in the paper, is compared with closed forms.
    """
    cases = [PASSIVITY, SCANNING, *random_settings(6)]
    errors = {}
    for law, closed_form in _CLOSED_FORMS.items():
        errors[f"greatest relative difference for {law}"] = max(
            [
                abs(find_max_norm(case.surface(law)) / closed_form(case.texture, case.depth) - 1.0)
                for case in cases
            ]
        )
    is_closed = min(errors.values()) <= 1e-6
    return check_statement(printed=not is_closed, corrected=is_closed, numbers=errors)


# --- C --------------------------------------------------------------------------------------------


def direction_c() -> Check:
    """The force field of C does not follow the normal of the texture.

    Compared with the normal at the contact point, vertically above the probe.
    """
    shares = []
    for probe in generic_probes("C", 12):
        normal = np.array([-probe.slope, 1.0]) / math.hypot(1.0, probe.slope)
        for force in (probe.force(), probe.compiled_force()):
            across = abs(force[0] * normal[1] - force[1] * normal[0])
            shares.append(float(across / np.linalg.norm(force)))
    return check_statement(printed=max(shares) > 1e-9, greatest_share_across=max(shares))


def curvature_c() -> Check:
    """C's stiffness grows with curvature, very large in sharp asperities and crevices.

    At crests and troughs the norm is κ₀ times the greater of 1 and depth times curvature.
    """
    printed = []
    reference = []
    for case in [PASSIVITY, SCANNING, *random_settings()]:
        x = np.array([0.25, 0.75]) * case.period
        xy = np.column_stack([x, 0 * x])
        curvature = np.abs(case.texture.hessian(xy)[:, 0, 0])
        for depth in (0.3 * case.depth, case.depth):
            points = np.column_stack([xy, case.texture.height(xy) - depth])
            reference.append(np.linalg.norm(case.surface("C").jacobian(points), 2, axis=(1, 2)))
            printed.append(case.stiffness * np.maximum(1.0, depth * curvature))
    return check_values(
        "norm of C's Jacobian at crests and troughs", printed=printed, reference=reference
    )


def conservative_c() -> Check:
    """C is conservative.

    Checked by its curl and by closed paths.
    """
    greatest = max_loop_share("C")
    loops = check_statement(printed=greatest < 1e-9, greatest=greatest)
    return combine_checks(check_curl("C", is_conservative=True), loops)


def remark_5() -> Check:
    """The factor √(1 + h'²) is what keeps B from being conservative."""
    import sympy as sp

    from asperity.derive.derivatives import curl_verdict

    def force(c: Any) -> Any:
        return sp.sqrt(1 + c.slope.dot(c.slope)) * find_law("B").force(c)

    without = curl_verdict(Law("Bs", "b-times-root", "vertical", force))
    return combine_checks(
        check_curl("B", is_conservative=False),
        check_curl("C", is_conservative=True),
        check_statement(
            f"B times the factor: {without.reason}",
            printed=without.conservative,
            curl_of_B_times_the_factor=", ".join([str(entry) for entry in without.curl]),
        ),
    )


# --- G --------------------------------------------------------------------------------------------


def energy_g() -> Check:
    """Around its path of Fig. 3 G gains energy on one leg."""
    errors = []
    gains = []
    for case in [SCANNING, *random_settings()]:
        a = 0.5 * case.depth
        surface = case.surface("G")
        points = case.crossing_path(a)
        scale = case.stiffness * a**2
        ends = np.roll(points, -1, axis=0)
        legs = [segment_work(surface, *leg) / scale for leg in zip(points, ends, strict=True)]
        expected = [-0.5, legs[1], 0.5, 0.0]
        errors += [abs(leg - value) for leg, value in zip(legs, expected, strict=True)]
        errors.append(abs(loop_work(surface, points) / scale - legs[1]))
        gains.append(legs[1])
    error = max(errors)
    gain = min(gains)
    is_true = error < 1e-9 and gain > 0.0
    gain_of_one_leg = check_statement(printed=is_true, worst_leg=error, least_gain=gain)
    return combine_checks(gain_of_one_leg, check_curl("G", is_conservative=False))


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
        [abs((j.before[0] / case.period + 0.25) % 1.0 - 0.5) for j in result.jumps],
        default=math.inf,
    )
    size = max([jump.size for jump in result.jumps], default=0.0)
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
