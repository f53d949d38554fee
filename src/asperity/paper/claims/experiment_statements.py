"""Sections V and VI, except for the sentences that need a simulation."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any, TypeVar

import numpy as np

from asperity.analysis.energy.field_energy import loop_work
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.core.checks import FloatArray
from asperity.devices import load_device
from asperity.devices.five_bar import FiveBar, handle_damping
from asperity.paper import cases, claim, formula_checks
from asperity.paper.cases import PAPER_CASE, SCANNING_CASE, FrictionCase
from asperity.paper.claims.passivity_condition import energy_gained

_RESOLUTION = 15e-6  # [m]
_SPEED = 0.2  # [m/s], greatest
# --- V --------------------------------------------------------------------------------------------


def samples_per_period() -> claim.Check:
    """With 1 mm, the highest period, there are 50 samples and more, and at most 200 Hz.

    The paper calls 1 mm the greatest period.
    """
    periods = [case.period for case in cases.SETTINGS.values()]
    length = 1e-3
    alpha = length / (_SPEED * cases.SAMPLING_PERIOD)
    beta = length / _RESOLUTION
    return claim.combine_checks(
        claim.check_statement(
            printed=alpha >= 50.0 * (1 - 1e-12) and beta > 50.0 and _SPEED / length < 400.0,
            updates=alpha,
            steps=beta,
            frequency=_SPEED / length,
        ),
        claim.check_statement(
            "periods of sections V.A to V.C: " + ", ".join([f"{p * 1e3:g} mm" for p in periods]),
            printed=math.isclose(max(periods), length),
            corrected=math.isclose(min(periods), length),
            periods=periods,
        ),
    )


def force_w() -> claim.Check:
    """Force of the smooth wall W."""
    surface = cases.PASSIVITY.surface("W")
    rng = np.random.default_rng(1)
    points = rng.uniform(-2e-3, 2e-3, (200, 3)) * [1, 0, 1]
    z = points[:, 2]
    printed = np.column_stack([0 * z, np.where(z < 0.0, -cases.PASSIVITY.stiffness * z, 0.0)])
    return claim.combine_checks(
        claim.check_values(
            "force of W at 200 probes", printed=printed, reference=surface.force(points)[:, [0, 2]]
        ),
        formula_checks.check_zero_outside("W"),
    )


def number_f() -> claim.Check:
    """q_F = 8.3 for the stated parameters."""
    printed = PAPER_CASE.sticking_norm()
    true = PAPER_CASE.max_norm_ratio()
    package = cases.PASSIVITY.q("F")
    return claim.check_statement(
        printed=8.3 in {round(value, 1) for value in (printed, true, package)},
        norm_of_the_printed_matrix=printed,
        root_two_times_that=math.sqrt(2.0) * printed,
        number_of_the_papers_law=true,
        number_of_the_packages_law=package,
    )


def number_a() -> claim.Check:
    """q_A = 5.1 for the stated parameters."""
    q = cases.PASSIVITY.q("A")
    return claim.check_statement(printed=round(q, 1) == 5.1, q=q)


def _handle_damping(x: float) -> float:
    """Return σ₀(B) of the Pantograph at x, with unverified link lengths [N·s/m]."""
    device = load_device("pantograph")
    lengths = [
        device.data[name].value for name in ("proximal_link", "distal_link", "base_distance")
    ]
    matrix = handle_damping(FiveBar(*lengths), cases.PASSIVITY.joint_damping, (x, 0.1))
    return float(np.linalg.svd(matrix, compute_uv=False)[-1])


def stability_rule() -> claim.Check:
    """At 2000 N/m W is within (1), A and F are not, and are when divided by their numbers."""
    q_a = cases.PASSIVITY.q("A")
    q_f = PAPER_CASE.sticking_norm()
    numbers = {"W": 1.0, "A": q_a, "F": q_f, "A/5.1": q_a / 5.1, "F/8.3": q_f / 8.3}
    loads = {name: cases.PASSIVITY.stiffness * number for name, number in numbers.items()}
    limits = [_handle_damping(x) / (2 * cases.SAMPLING_PERIOD) for x in (-0.0125, 0.0375)]
    return claim.check_statement(
        printed=all(
            (load <= limit) is (name not in "AF")
            for name, load in loads.items()
            for limit in limits
        ),
        numbers={f"load of {name}": load for name, load in loads.items()},
        limits=limits,
    )


def division_ensures_passivity() -> claim.Check:
    """Dividing by the characteristic number ensures passivity for A and F.

    With divided stiffness, A and F still gain energy on a slow loop.
    """
    damping = _handle_damping(0.0375)
    speeds = {}
    for law, number in (("A", 5.1), ("F", 8.3)):
        surface = cases.PASSIVITY.surface(law, stiffness=cases.PASSIVITY.stiffness / number)
        loop = cases.PASSIVITY.groove_path() if law == "A" else cases.PASSIVITY.friction_path(1e-5)
        length = float(np.linalg.norm(loop - np.roll(loop, 1, axis=0), axis=1).sum())
        speeds[f"speed for {law}"] = loop_work(surface, loop) / (damping * length)
    return claim.check_statement(
        f"σ₀ = {damping:.2f} N·s/m", printed=max(speeds.values()) <= 0.0, numbers=speeds
    )


def held_force_work(path: FloatArray, force: FloatArray) -> float:
    """Return the work of forces held from each point of a path to the next [J]."""
    fine = np.linspace(0.0, 1.0, 8)[:, None]
    return sum(
        [
            float(np.sum(np.diff(start + fine * step, axis=0) @ held))
            for start, step, held in zip(path[:-1], np.diff(path, axis=0), force, strict=True)
        ]
    )


def energy_sums() -> claim.Check:
    """Force times displacement of the same sample, summed, is the energy supplied.

    The paper's Σ f Δp is compared with the work of a held force.
    """
    rng = np.random.default_rng(23)
    surface = cases.SCANNING.surface("W")
    path = np.cumsum(rng.normal(size=(400, 3)), axis=0) * 1e-6 * [0, 0, 1] - [0, 0, 1e-3]
    force = surface.force(path)
    step = np.diff(path, axis=0)
    held = held_force_work(path, force[:-1])
    # The work of the field along the path is the change of its energy.
    stored = 0.5 * surface.stiffness * path[[0, -1], 2] ** 2
    field = float(stored[0] - stored[1])
    return claim.check_values(
        "energy from sampling, beyond the change of the stored energy [J]",
        printed=float(np.sum(force[1:] * step)) - field,
        corrected=float(np.sum(force[:-1] * step)) - field,
        reference=held - field,
    )


def passivity_margins() -> claim.Check:
    """The margin of passivity is larger than in section V.A."""
    numbers = {law: [case.q(law) for case in (cases.PASSIVITY, cases.SCANNING)] for law in "WABCEG"}
    numbers["F"] = [PAPER_CASE.sticking_norm(), SCANNING_CASE.sticking_norm()]
    gain = cases.SCANNING.joint_damping / cases.SCANNING.stiffness
    gain *= cases.PASSIVITY.stiffness / cases.PASSIVITY.joint_damping
    ratios = {f"ratio for {law}": gain * pair[0] / pair[1] for law, pair in numbers.items()}
    return claim.check_statement(printed=min(ratios.values()) > 1.0, numbers=ratios)


def no_lateral_energy() -> claim.Check:
    """A exchanges no energy along the surface."""
    surface = cases.SCANNING.surface("A")
    rng = np.random.default_rng(5)
    force = surface.force(rng.uniform(-2e-3, 2e-3, (1000, 3)) * [1, 0, 1])
    lateral = float(np.abs(force[:, 0]).max())
    normal = float(np.abs(force[:, 2]).max())
    return claim.check_statement(printed=lateral == 0.0 < normal, lateral=lateral, normal=normal)


def nonconservative_feels_alive() -> claim.Check:
    """Fields that are not conservative feel alive.

    The leak is computed; its perception is not.
    """
    # 1 mm deep
    numbers = {
        f"worst loop of {law} [J]": worst_loop(cases.BUMP.surface(law)).energy for law in "ABD"
    }
    return claim.check_observation(numbers)


Case = TypeVar("Case", cases.ExperimentCase, FrictionCase)


def growth_exponents(case: Case, compute: Callable[..., float], *arguments: Any) -> list[float]:
    """Return the exponents with which a quantity grows with A and with l, by changes of 1 %."""
    taller = replace(case, amplitude=1.01 * case.amplitude)
    longer = replace(case, period=1.01 * case.period)
    before = compute(case, *arguments)
    ratios = [compute(changed, *arguments) / before for changed in (taller, longer)]
    return [math.log(ratio) / math.log(1.01) for ratio in ratios]


def scaling_with_texture() -> claim.Check:
    """q_A is proportional to A/l, the energy gained on a horizontal path to A²."""
    q_by_a, q_by_l = growth_exponents(cases.BUMP, cases.ExperimentCase.q, "A")
    energy_by_a, energy_by_l = growth_exponents(
        cases.BUMP, lambda case: loop_work(case.surface("A"), case.groove_path())
    )
    straight = loop_work(
        cases.BUMP.surface("A"), [[0.0, 0.0, 0.0], [0.37 * cases.BUMP.period, 0.0, 0.0]]
    )
    q_error = max(abs(q_by_a - 1.0), abs(q_by_l + 1.0))
    energy_error = max(abs(energy_by_a - 2.0), abs(energy_by_l))
    return claim.check_statement(
        f"along a horizontal path forth and back {straight:g} J",
        printed=q_error < 1e-6 and energy_error < 1e-6,
        corrected=q_error < 0.05 and energy_error < 1e-6 and straight == 0.0,
        q_by_A=q_by_a,
        energy_by_A=energy_by_a,
        q_by_l=q_by_l,
        energy_by_l=energy_by_l,
    )


def passive_along_normal() -> claim.Check:
    """A is passive to a probe that moves at right angles to the surface.

    As passive as a smooth wall, with the least damping that a wall requires: σ₀ = κ₀T/2.
    """
    rng = np.random.default_rng(29)
    gains = []
    for case in [cases.PASSIVITY, *cases.random_settings()]:
        surface = case.surface("A")
        for size in 10.0 ** rng.uniform(-3.0, 0.0, 20):
            x = rng.uniform(0.0, case.period)
            top = float(surface.texture.height([[x, 0.0]])[0])
            # Alternating inside the body, the worst motion for a wall.
            depth = case.depth * (0.5 + 0.5 * size * (-1.0) ** np.arange(60))
            path = np.column_stack([np.full(60, x), np.zeros(60), top - depth])
            stored = 0.5 * case.stiffness * depth[[0, -1]] ** 2
            net = energy_gained(surface, path, 0.5 * case.stiffness) + float(stored[1] - stored[0])
            gains.append(net / (case.stiffness * (size * case.depth) ** 2))
    return claim.check_statement(printed=max(gains) < 1e-9, greatest=max(gains))


# --- VI -------------------------------------------------------------------------------------------


def stiffness_is_raised() -> claim.Check:
    """Texturing generally raises the effective stiffness."""
    settings = [*cases.SETTINGS.values(), *cases.random_settings(5)]
    numbers = {law: [case.q(law) for case in settings] for law in cases.PAPER_LAWS}
    least = min([min(values) for values in numbers.values()])
    raised = [law for law, values in numbers.items() if max(values) > 1.0 + 1e-9]
    return claim.check_statement(
        printed=least >= 1.0 - 1e-6 and len(raised) >= 4,
        least=least,
        laws_above_1=", ".join(raised),
    )


def number_is_proportional() -> claim.Check:
    """The characteristic number is most frequently proportional to A/l."""
    base = cases.ExperimentCase(1000.0, 1e-3, 0.8e-3)
    exponents = {law: growth_exponents(base, cases.ExperimentCase.q, law) for law in "ABCEG"}
    # The package's law scales the heights; the paper's own bound does not.
    exponents["F"] = growth_exponents(PAPER_CASE, FrictionCase.sticking_norm)
    proportional = [
        law for law, (a, length) in exponents.items() if max(abs(a - 1.0), abs(length + 1.0)) < 0.3
    ]
    summary = ", ".join([f"{law} {a:+.2f} {length:+.2f}" for law, (a, length) in exponents.items()])
    return claim.check_statement(
        f"exponents of A and l in V.A's setting: {summary}; D has no finite number",
        printed=len(proportional) > len(cases.PAPER_LAWS) / 2,
        numbers={f"exponents for {law}": pair for law, pair in exponents.items()},
    )


def always_passive() -> claim.Check:
    """Passivity can always be had by less gain, faster sampling or more damping, for any law.

    At one gain it is the statement of V.A that dividing by the number ensures passivity.
    """
    length = 2.0 * (0.25 * cases.SCANNING.period + cases.SCANNING.amplitude)
    speeds: dict[str, list[float]] = {}
    path = cases.SCANNING.groove_path()
    for law in "AC":
        speeds[law] = []
        for stiffness, damping in ((1000.0, 1.0), (10.0, 1.0), (1000.0, 100.0)):
            work = loop_work(cases.SCANNING.surface(law, stiffness=stiffness), path)
            speeds[law].append(max(work, 0.0) / (damping * length))
    greatest = {law: max(values) for law, values in speeds.items()}
    surfaces = [cases.SCANNING.surface("A", stiffness=stiffness) for stiffness in (1000.0, 10.0)]
    friction, less = (worst_loop(surface).absorbing for surface in surfaces)
    return claim.check_statement(
        "A gains energy below "
        + ", ".join([f"{speed * 1e3:.3g} mm/s" for speed in speeds["A"]])
        + f" with κ₀ = 1000, 10, 1000 N/m and 1, 1, 100 N·s/m, C below {greatest['C']:.1g} m/s, "
        "whatever the sampling",
        printed=max(greatest.values()) <= 1e-12,
        speeds_for_A=speeds["A"],
        speeds_for_C=speeds["C"],
        friction_for_A=friction.upper,
        friction_at_less_gain=less.upper,
        found_per_length=friction.found,
        found_at_less_gain=less.found,
    )


def conclusion_d() -> claim.Check:
    """D is conservative and leaves the effective stiffness as it is, but jumps."""
    surface = cases.SCANNING.surface("D")
    q = characteristic_number(surface).value
    plus = one_sided_number(surface).value
    return claim.combine_checks(
        formula_checks.check_curl("D", is_conservative=True),
        claim.check_statement(
            f"D in V.B's setting: q = {q}, q⁺ = {plus:g}",
            printed=q == 1.0,
            corrected=plus == 1.0,
            q=q,
            one_sided=plus,
        ),
        formula_checks.check_continuity("D", is_continuous=False),
    )


def conclusion_f() -> claim.Check:
    """F has no advantage in effective stiffness, but dissipates (its feel is left out).

    Its number is not small, but a stroke forth and back loses energy.
    """
    numbers = {law: cases.SCANNING.q(law) for law in "AEFG"}
    bound = SCANNING_CASE.sticking_norm()
    length = 10.0 * cases.SCANNING.deflection
    depth = -cases.SCANNING.depth
    work = loop_work(cases.SCANNING.surface("F"), [[0, 0, depth], [length, 0, depth]])
    return claim.check_statement(
        f"{bound:.3f} by (26)",
        printed=min(numbers["F"], bound) > 1.1 * numbers["E"] and work < 0.0,
        numbers={f"q_{law}": q for law, q in numbers.items()},
        work_of_a_stroke=work,
    )
