"""Sections IV.D and IV.E: the two god-object laws."""

from __future__ import annotations

import math
from typing import Any

import numpy as np

from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.loops import loop_work
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.checks import FloatArray
from asperity.paper.changes import FORCES, JACOBIANS, Change, Swap, laws
from asperity.paper.claim import Check, decide, judge, judges, settle
from asperity.paper.comparisons import (
    curl_check,
    field_check,
    jacobian_check,
    leg_work,
    potential_check,
)
from asperity.paper.plane import (
    BUMP,
    PASSIVITY,
    SCANNING,
    Spot,
    foot_of,
    groove_path,
    path_points,
    random_settings,
    spots,
)


def bent_jacobian(s: Spot) -> FloatArray:
    """The Jacobian of D with curvature: -k (I - [1, h']ᵀ[1, h']/(1 + h'² + (h - z) h''))."""
    along = np.array([1.0, s.slope])
    return -s.k * (np.eye(2) - np.outer(along, along) / (1.0 + s.slope**2 - s.d * s.bend))


def flat_jacobian(s: Spot) -> FloatArray:
    """The Jacobian of D as printed in (18) and (44)."""
    inner = np.array([[s.slope**2, -s.slope], [-s.slope, 1.0]])
    return -s.k / (1.0 + s.slope**2) * inner


BENT = "with curvature: 1 + h'² becomes 1 + h'² + (p_h^z - p^z) h'' in the derivative of the foot"


# --- D --------------------------------------------------------------------------------------------


@judges("eq-16", "IV.D", "(16)", flipped_by=FORCES)
def potential_d() -> Check:
    """Potential of D."""

    def potential(spot: Spot) -> Any:
        def value(x: Any, z: Any) -> Any:
            foot = foot_of(spot.surface, x, z, 60)
            return -spot.k * ((x - foot[0]) ** 2 + (z - foot[1]) ** 2) / 2

        return value

    return potential_check("D", potential, lambda s: 0.5 * s.distance**2)


@judges("eq-17", "IV.D", "(17)", flipped_by=FORCES)
def field_d() -> Check:
    """Force of D, a spring to the nearest point; conservative.

    Conservative also across the ridges where it jumps.
    """
    worst = 0.0
    for case in [SCANNING, *random_settings()]:
        energy = loop_work(case.surface("D"), groove_path(case), 1e-10)
        worst = max(worst, abs(energy) / (case.stiffness * case.amplitude**2))
    loops = decide(f"energy around the path {worst:.1e} of κ₀A²", printed=worst < 1e-7, loop=worst)
    return settle(
        field_check("D", lambda s: -s.k * s.from_foot), curl_check("D", conservative=True), loops
    )


@judges("eq-18", "IV.D", "(18)", flipped_by=JACOBIANS)
def jacobian_d() -> Check:
    """Jacobian of D from the slope alone."""
    return jacobian_check("D", flat_jacobian, bent_jacobian, BENT)


NO_CURVATURE = Change(
    "D's Jacobian without curvature, (18)",
    tuple(
        Swap(name, lambda _was: flat_jacobian, Spot) for name in ("jacobian", "compiled_jacobian")
    ),
)


@judges("sentence-IV.D-singular", "IV.D", flipped_by=NO_CURVATURE)
def singular_d() -> Check:
    """Moving at right angles to the penetration leaves D's force as it is."""
    shares = []
    for spot in spots("D"):
        across = np.array([spot.d, spot.at - spot.x])
        across = np.array([-spot.from_foot[1], spot.from_foot[0]]) / math.hypot(*across)
        for matrix in (spot.jacobian(), spot.compiled_jacobian()):
            shares.append(float(np.linalg.norm(matrix @ across)) / spot.k)
    return decide(
        f"moving across, the force of D changes by {min(shares):.3f} to {max(shares):.3f} κ₀",
        printed=max(shares) < 1e-9,
        correction="only where the surface is not curved; else by κ₀ δκ/(1 + δκ) per length",
        change_per_length_over_stiffness=shares,
    )


@judges("sentence-IV.D-number", "IV.D", flipped_by=laws(D="E"))
def number_d() -> Check:
    """‖J_D‖ = κ₀ whatever the surface, and q_D = 1."""
    norms = [float(s.norms().max()) / s.k for s in spots("D", 12)]
    surface = PASSIVITY.surface("D")
    q, plus = characteristic_number(surface), one_sided_number(surface)
    gentle = BUMP.surface("D", max_depth=0.8 * _onset(BUMP.amplitude, BUMP.period))
    shallow = characteristic_number(gentle)
    return decide(
        f"‖J‖/κ₀ up to {max(norms):.3f} at 12 generic probes; sup {q.value} in V.A's setting, "
        f"{shallow.value:.3f} at 0.8 of the crests' radius; q⁺ = {plus.value:g}",
        printed=max(norms) <= 1.0 + 1e-9 and abs(q.value - 1.0) < 1e-9,
        correction="1 is the one-sided number q⁺; with y = 4π²AD/l², q_D is 1 up to y = 1/2, "
        "y/(1 - y) up to 1, then infinite",
        greatest_norm=max(norms),
        q=q.value,
        q_at_0_8_of_the_radius=shallow.value,
        one_sided_number=plus.value,
    )


def _onset(amplitude: float, period: float) -> float:
    return period**2 / (4.0 * math.pi**2 * amplitude)


@judges("remark-6", "IV.D", "Remark 6", flipped_by=laws(D="E"))
def remark_6() -> Check:
    """D's force jumps, on a sinusoid below its maxima (Fig. 2); its potential has a kink there."""
    checks = []
    for name, case in (("V.A", PASSIVITY), ("V.B", SCANNING), ("V.C", BUMP)):
        surface = case.surface("D")
        found = continuity(surface, characteristic_number(surface))
        jumps = found.jumps
        off = max(
            (abs((j.before[0] / case.period - 0.25 + 0.5) % 1.0 - 0.5) for j in jumps),
            default=math.inf,
        )
        size = max((jump.size for jump in jumps), default=0.0)
        checks.append(
            decide(
                f"{name}: {len(jumps)} jumps located, up to {size:.2f} N, all within {off:.1e} l "
                f"of a maximum, from {_onset(case.amplitude, case.period) * 1e3:.3f} mm down",
                printed=not found.continuous and off < 1e-6,
                numbers={
                    f"{name}: greatest jump [N]": size,
                    f"{name}: farthest from a maximum [l]": off,
                },
            )
        )
    return settle(*checks, _kink())


def _kink() -> Any:
    """Judge that the potential of D is continuous across the ridge, but not differentiable."""
    case = SCANNING
    surface, crest = case.surface("D"), 0.25 * case.period
    level, step = case.amplitude - case.depth, 1e-9
    points = path_points((crest - step, level), (crest, level), (crest + step, level))
    energy = 0.5 * case.stiffness * ((surface.texture.nearest(points) - points) ** 2).sum(axis=1)
    left, right = np.diff(energy) / step
    gap = float(abs(energy[2] - energy[0]) / energy[1])
    return decide(
        f"across a ridge the potential changes by {gap:.1e} of itself, its slope by "
        f"{abs(right - left):.3f} N",
        printed=gap < 1e-6 and abs(right - left) > 1e-2,
        change_of_slope=float(abs(right - left)),
    )


# --- E --------------------------------------------------------------------------------------------

_OUTWARD = "without the minus sign: as printed the force pulls the probe further in"


@judges("eq-19", "IV.E", "(19)", flipped_by=FORCES)
def field_e() -> Check:
    """Force of E: nearest distance, along the wall's normal."""
    return field_check(
        "E",
        lambda s: np.array([0.0, -s.k * s.distance]),
        lambda s: np.array([0.0, s.k * s.distance]),
        _OUTWARD,
    )


@judges("eq-20", "IV.E", "(20)", flipped_by=JACOBIANS)
def jacobian_e() -> Check:
    """Jacobian of E."""

    def printed(s: Spot) -> FloatArray:
        return -s.k / s.distance * np.array([[0.0, 0.0], s.from_foot])

    return jacobian_check("E", printed, lambda s: -printed(s), _OUTWARD)


@judges("eq-21", "IV.E", "(21)", flipped_by=FORCES)
def norm_e() -> Check:
    """‖J_E‖ = κ₀ and q_E = 1."""
    places = list(spots("E", 6))
    norms = judge(
        "norm of the Jacobian of E at 6 generic probes",
        printed=[[s.k, s.k] for s in places],
        truth=[s.norms() for s in places],
    )
    q = characteristic_number(PASSIVITY.surface("E"))
    number = judge("q_E in V.A's setting", printed=1.0, truth=q.value)
    return settle(norms, number, _steepness_e())


def _steepness_e() -> Any:
    """Judge by pairs of probes, also across ridges: |f(a) - f(b)| <= κ₀ |a - b|."""
    surface, draw = PASSIVITY.surface("E"), np.random.default_rng(3)
    ends = draw.uniform(0.0, 1e-3, (2, 4000, 3)) - np.array([0.0, 0.0, 1e-3])
    ends[..., 1] = 0.0
    ends[1] = ends[0] + (ends[1] - ends[0]) * draw.uniform(1e-4, 1.0, (4000, 1))
    forces = [surface.force(points) for points in ends]
    ratio = np.linalg.norm(forces[1] - forces[0], axis=1) / np.linalg.norm(
        ends[1] - ends[0], axis=1
    )
    most = float(ratio.max()) / surface.stiffness
    return decide(
        f"over 4000 pairs of probes the force changes by at most {most:.4f} κ₀ per length",
        printed=most <= 1.0 + 1e-9,
        greatest_slope_of_pairs=most,
    )


@judges("sentence-IV.E-energy", "IV.E", flipped_by=laws(E="D"))
def energy_e() -> Check:
    """Around the path of Fig. 3 E gains energy, on the rising leg only."""
    least, other = math.inf, 0.0
    for case in [SCANNING, *random_settings()]:
        surface, points = case.surface("E"), np.array(groove_path(case))
        scale = case.stiffness * case.amplitude**2
        gain = leg_work(surface, points[1], points[2])
        total = loop_work(surface, points, 1e-9)
        least, other = min(least, total / scale), max(other, abs(total - gain) / scale)
    return settle(
        decide(
            f"gain at least {least:.4f} κ₀A²; other legs together {other:.1e} κ₀A²",
            printed=least > 0.0 and other < 1e-7,
            least_gain=least,
            other_legs=other,
        ),
        curl_check("E", conservative=False),
    )


@judges("remark-7", "IV.E", "Remark 7", flipped_by=laws(E="D"))
def remark_7() -> Check:
    """E is not conservative, but does not jump."""
    surface = PASSIVITY.surface("E")
    found = continuity(surface, characteristic_number(surface))
    across = np.array(path_points((0.25e-3 - 1e-12, 0.0), (0.25e-3 + 1e-12, 0.0)))
    jump = float(np.linalg.norm(np.diff(surface.force(across), axis=0)))
    return settle(
        decide(
            f"force of E across a ridge of D changes by {jump:.1e} N; {found.reason}",
            printed=found.continuous and jump < 1e-6,
            change_across_a_ridge=jump,
        ),
        curl_check("E", conservative=False),
    )
