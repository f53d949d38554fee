"""Section IV.F: friction modulated by the texture.

The paper's h has no dimension here, h = A sin(2πx/l) with A a number; where it is compared with
the package's law, its h is the law's modulation m.
"""

from __future__ import annotations

import math
from collections.abc import Iterator
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from asperity.analysis.energy.loops import loop_work
from asperity.checks import FloatArray
from asperity.paper.changes import FORCES, JACOBIANS, laws, observed, other, works
from asperity.paper.claim import Check, decide, judge, judges, observation, settle
from asperity.paper.comparisons import Potential, gradient_of
from asperity.paper.plane import SCANNING, Setting, friction_path, random_settings, spots
from asperity.surface import Surface
from asperity.textures.sinusoid import Sinusoid

_TURN = 2.0 * math.pi


@dataclass(frozen=True)
class Rub:
    """Numbers of the paper's law F: friction, d_max [m], A [1], l [m], |p^z| [m]."""

    friction: float
    deflection: float
    amplitude: float
    period: float
    depth: float

    def modulation(self, x: Any, order: int = 0) -> Any:
        """Return h = A sin(2πx/l), or its derivative."""
        import mpmath

        wave = _TURN / self.period
        return self.amplitude * wave**order * mpmath.sin(wave * x + order * mpmath.pi / 2)

    def surface(self) -> Surface:
        """Return this law as a surface: twice the friction makes 1 - m of it the paper's 1 - h.

        With m = (1 + A sin(2πx/l))/2, whatever the height of the texture.
        """
        return Surface(
            Sinusoid(1e-4, self.period), "F", 1.0, self.depth, 2.0 * self.friction,
            self.deflection, self.amplitude,
        )  # fmt: skip

    def compiled_jacobians(self, count: int) -> FloatArray:
        """Return J/κ₀ in x and z by the kernel at the depth p^z.

        Sliding and sticking, at d = -d_max and d_max, at points along a period: shape
        (2, 2, count, 2, 2).
        """
        surface, x = self.surface(), np.linspace(0.0, self.period, count)
        points = np.column_stack([x, 0 * x, np.full(count, -self.depth)])
        phases = [
            [
                surface.jacobian(
                    points, np.outer(np.full(count, d), [1, 0]), np.full(count, slides)
                )
                for d in (-self.deflection, self.deflection)
            ]
            for slides in (True, False)
        ]
        return np.array(phases)[..., ::2, ::2]


# In V.A the paper puts A = 0.8 mm where its h wants a number: in millimetres it is 0.8.
PAPER = Rub(0.8, 1e-3, 0.8, 1e-3, 1e-3)


def random_rubs(count: int = 4, seed: int = 7) -> Iterator[Rub]:
    """Yield parameter sets at random, 0 < A < 1."""
    draw = np.random.default_rng(seed)
    for _ in range(count):
        yield Rub(
            friction=draw.uniform(0.1, 1.2),
            deflection=draw.uniform(0.1e-3, 3e-3),
            amplitude=draw.uniform(0.1, 0.95),
            period=draw.uniform(0.5e-3, 4e-3),
            depth=draw.uniform(0.1e-3, 2e-3),
        )


def stick_entries(r: Rub) -> tuple[float, float]:
    """Entries (1, 1) and (1, 2) of the printed (26), over -κ₀."""
    a = 2.0 * r.friction * r.depth * (1.0 / r.deflection + math.pi * r.amplitude / r.period)
    return a, 2.0 * r.friction


def norm_of(a: float, b: float) -> float:
    """‖[[a, b], [0, 1]]‖ from the matrix itself."""
    return float(np.linalg.norm(np.array([[a, b], [0.0, 1.0]]), 2))


# --- field and Jacobian ---------------------------------------------------------------------------


@judges("eq-22", "IV.F", "(22)", flipped_by=FORCES)
def field_f() -> Check:
    """Force of F: the wall, and friction that h modulates.

    Against the definition, and by the work of friction on a sliding probe.
    """
    from asperity.definition import exact_force

    printed, corrected, truth = [], [], []
    draw = np.random.default_rng(9)
    for spot in spots("F"):
        surface = spot.surface
        k, middle, half = surface.law_arguments[:3]
        m = 0.5 * (1.0 + surface.modulation_depth * (spot.h - middle) / half)
        d = draw.uniform(-1.0, 1.0) * surface.max_deflection
        pull = surface.friction * (1.0 - m) * d / surface.max_deflection
        exact = exact_force(surface, [spot.x, 0.0, spot.z], [d, 0.0])
        kernel = surface.force([[spot.x, 0.0, spot.z]], [[d, 0.0]])[0]
        printed += [[-k * pull * spot.z, -k * spot.z]] * 2
        corrected += [[k * pull * spot.z, -k * spot.z]] * 2
        truth += [[float(exact[0]), float(exact[2])], [kernel[0], kernel[2]]]
    correction = "the x part with a plus sign: friction must oppose the deflection"
    fields = judge(
        "force of F at 4 generic probes, by definition and kernel",
        printed=printed,
        corrected=corrected,
        truth=truth,
        correction=correction,
    )
    return settle(fields, _sliding_check(correction))


def _sliding_check(correction: str) -> Check:
    """Judge the sign of friction by one millimetre of sliding with d = d_max, at h = 0."""
    depth, way = -1e-3, 1e-3
    work = -SCANNING.stiffness * SCANNING.friction * depth * way
    return decide(
        f"work of the printed friction over 1 mm of sliding {work * 1e3:+.2f} mJ",
        printed=work < 0.0,
        corrected=-work < 0.0,
        correction=correction,
        work_as_printed=work,
    )


@judges("eq-23", "IV.F", "(23)", flipped_by=JACOBIANS)
def jacobian_f() -> Check:
    """Jacobian of F.

    Against differences of (22) as printed, and with the other sign of friction against the kernel.
    """
    draw = np.random.default_rng(13)
    printed, corrected, truth = [], [], []
    for r in random_rubs(6):
        x, d = draw.uniform(0.0, r.period), draw.uniform(-1.0, 1.0) * r.deflection
        for rate in (1.0, 0.0):  # sticking, sliding
            force = _printed_force(r, x, d, rate)
            probe = [x, 0.0, -r.depth]
            kernel = r.surface().jacobian([probe], [[d, 0.0]], np.array([rate == 0.0]))[0]
            # The kernel's friction opposes the motion, see (22).
            mirrored = kernel[np.ix_([0, 2], [0, 2])] * [[-1.0], [1.0]]
            truth += [[gradient_of(part, 0.0, -r.depth) for part in force], mirrored]
            h, slope = float(r.modulation(x)), float(r.modulation(x, 1))
            printed += [_formula(r, d, h, rate, slope)] * 2
            corrected += [_formula(r, d, h, rate, slope * d)] * 2
    return judge(
        "Jacobian of (22) and of its kernel at 12 random states",
        printed=printed,
        corrected=corrected,
        truth=truth,
        correction="h' must be h' d^x (as printed it has another dimension)",
    )


def _printed_force(r: Rub, x: float, d: float, rate: float) -> tuple[Potential, Potential]:
    def friction(dx: Any, z: Any) -> Any:
        still = 1 - r.modulation(x + dx)
        return -r.friction * still * (d + rate * dx) / r.deflection * z

    return friction, lambda _dx, z: -z


def _formula(r: Rub, d: float, h: float, rate: float, slope: float) -> list[list[float]]:
    """Return (23) over κ₀ with something in the place of h'."""
    first = r.friction * -r.depth / r.deflection * (rate - h * rate - slope)
    return [[-first, -r.friction * (1.0 - h) * d / r.deflection], [0.0, -1.0]]


FARTHER = other(
    "an anchor that is dragged from twice the deflection on", "surface",
    lambda was: lambda case, law, **given: was(
        case, law, **given, max_deflection=2.0 * case.deflection
    ) if law == "F" else was(case, law, **given), Setting,
)  # fmt: skip


@judges("eq-24", "IV.F", "(24)", flipped_by=FARTHER)
def phases() -> Check:
    """d follows the probe while d < d_max and does not change while d = d_max.

    A probe goes forth and back, the package's anchor follows.
    """  # noqa: D403 - a symbol
    case = random_settings(1, 21)[0]
    surface = case.surface("F", modulation_depth=0.0)
    reach = case.deflection
    x = np.concatenate([np.linspace(0.0, 3.3, 1001), np.linspace(3.3, -1.7, 1489)[1:]]) * reach
    path = np.column_stack([x, 0.0 * x, np.full(len(x), -case.depth)])
    force = surface.trace(path)
    d = -force[:, 0] * reach / (0.5 * case.friction * force[:, 2])
    rate = np.diff(d) / np.diff(x)
    # A step in which sticking ends is neither: those are left out.
    whole = (np.abs(rate) < 1e-6) | (np.abs(rate - 1.0) < 1e-6)
    end, rate = d[1:][whole], rate[whole]
    slips = np.abs(rate) < 0.5
    forward = slips == (np.abs(end - reach) < 1e-9 * reach)
    both = slips == (np.abs(np.abs(end) - reach) < 1e-9 * reach)
    return decide(
        f"of {len(end)} steps forth and back d = d_max tells slip from stick in "
        f"{forward.mean():.3f}, |d| = d_max in {both.mean():.3f}",
        printed=bool(forward.all() and len(whole) - whole.sum() <= 3),
        corrected=bool(both.all() and len(whole) - whole.sum() <= 3),
        correction="|d^x| in place of d^x: the anchor is dragged both ways",
        share_as_printed=float(forward.mean()),
        share_with_absolute_value=float(both.mean()),
    )


def _suprema(r: Rub) -> FloatArray:
    """Return the greatest entries (1, 1) and (1, 2) by the kernel: sliding, then sticking.

    Both are linear in d, so greatest at an end.
    """
    return np.asarray(np.abs(r.compiled_jacobians(40001)[..., 0, :]).max(axis=(1, 2)))


@judges("eq-25", "IV.F", "(25)", flipped_by=JACOBIANS)
def slip_entries() -> Check:
    """Greatest entries of F's Jacobian while sliding."""
    rubs = [PAPER, *random_rubs()]
    wave = [_TURN * r.friction * r.depth * r.amplitude / r.period for r in rubs]
    return judge(
        "greatest entries while sliding, 5 parameter sets",
        printed=[[w, 2.0 * r.friction] for w, r in zip(wave, rubs, strict=True)],
        corrected=[[w, r.friction * (1.0 + r.amplitude)] for w, r in zip(wave, rubs, strict=True)],
        truth=np.array([_suprema(r)[0] for r in rubs]),
        tolerance=1e-8,
        correction="bounds, entry by entry: (1,2) is at most μ(1 + A) for h = A sin, and μ "
        "where 0 <= h <= 1 as (22) assumes",
    )


@judges("eq-26", "IV.F", "(26)", flipped_by=JACOBIANS)
def stick_bound() -> Check:
    """Greatest entries of F's Jacobian while sticking."""
    rubs = [PAPER, *random_rubs()]
    right = [
        [r.friction * r.depth / r.deflection
         * (1.0 + r.amplitude * math.hypot(1.0, _TURN * r.deflection / r.period)),
         r.friction * (1.0 + r.amplitude)]
        for r in rubs
    ]  # fmt: skip
    truth = [_suprema(r)[1] for r in rubs]
    entries = judge(
        "greatest entries while sticking, 5 parameter sets",
        printed=[stick_entries(r) for r in rubs],
        corrected=right,
        truth=truth,
        tolerance=1e-8,
        correction="a bound, entry by entry: the greatest are "
        "μp/d_max (1 + A √(1 + (2πd_max/l)²)) and μ(1 + A)",
    )
    slack = [p / t for r, row in zip(rubs, truth, strict=True)
             for p, t in zip(stick_entries(r), row, strict=True)]  # fmt: skip
    bound = decide(
        f"as bounds the entries exceed the greatest {min(slack):.2f} to {max(slack):.2f} times",
        printed=min(slack) >= 1.0,
        ratios_to_the_greatest=slack,
    )
    return settle(entries, bound)


# --- energy ---------------------------------------------------------------------------------------


@judges("sentence-IV.F-deflections", "IV.F", flipped_by=observed("sentence-IV.F-deflections"))
def deflections() -> Check:
    """Realistic d_max go from 1e-2 m (tissue) to 1e-6 m (metal)."""
    return observation(
        "sentence-IV.F-deflections", "a statement on real materials: nothing here can be computed"
    )


@judges("eq-27", "IV.F", "(27)", flipped_by=FORCES)
def energy_f() -> Check:
    """Energy of F without texture around its path of Fig. 3.

    The law without texture; twice the friction makes its m = 1/2 the paper's h = 0.
    """
    cases, share = [SCANNING, *random_settings(4)], 0.2
    printed, corrected, truth, limit = [], [], [], 0.0
    for case in cases:
        surface = case.surface("F", modulation_depth=0.0, friction=2.0 * case.friction)
        whole = 0.5 * case.stiffness * case.friction * case.depth * case.deflection
        printed.append(whole)
        corrected.append(whole * (1.0 - share))
        truth.append(loop_work(surface, friction_path(case, share * case.depth)))
        lightest = loop_work(surface, friction_path(case, 1e-7 * case.depth))
        limit = max(limit, abs(lightest / whole - 1.0))
    return settle(
        judge(
            f"energy around the path with a = {share:g} d_max^z, {len(cases)} parameter sets",
            printed=printed,
            corrected=corrected,
            truth=truth,
            correction="κ₀μ/2 · d_max^x (d_max^z - a): the printed energy is the limit a → 0",
        ),
        decide(
            f"with a = 1e-7 d_max^z the printed energy is off by {limit:.1e}",
            printed=limit < 1e-6,
            error_in_the_limit=limit,
        ),
    )


@judges("sentence-IV.F-stick", "IV.F", flipped_by=laws(F="W"))
def generative_stick() -> Check:
    """F generates energy while sticking only, which is at most 2 d_max wide."""
    case = SCANNING
    surface, reach = case.surface("F"), case.deflection
    x = np.concatenate([np.linspace(0.0, 4.0, 8001), np.linspace(4.0, -2.0, 12001)[1:]]) * reach
    path = np.column_stack([x, 0.0 * x, np.full(len(x), -case.depth)])
    force = surface.trace(path)[:, 0]
    gain = 0.5 * (force[1:] + force[:-1]) * np.diff(x)
    d = _anchored(x, reach)
    slips = np.abs(np.abs(d[1:]) - reach) + np.abs(np.abs(d[:-1]) - reach) < 1e-9 * reach
    worst, sticks = float(gain[slips].max()), float(gain[~slips].max())
    back = np.flatnonzero(~slips & (np.arange(len(gain)) >= 8000))
    width = float(np.abs(np.diff(x)[back]).sum()) / reach
    return decide(
        f"greatest gain of a sliding step {worst * 1e9:+.3g} nJ, of a sticking step "
        f"{sticks * 1e9:+.3g} nJ; after turning it sticks over {width:.3f} d_max",
        printed=worst < 0.0 < sticks and width <= 2.0 + 1e-3,
        sliding=worst,
        sticking=sticks,
        width_over_d_max=width,
    )


def _anchored(x: FloatArray, reach: float) -> FloatArray:
    """Return the deflection along a way by (24), |d| <= d_max."""
    d = np.zeros(len(x))
    for i in range(1, len(x)):
        d[i] = min(max(d[i - 1] + x[i] - x[i - 1], -reach), reach)
    return d


@judges("sentence-IV.F-compliant", "IV.F", flipped_by=works(1.0, more=1e-3))
def compliant() -> Check:
    """The energy that is not conserved is proportional to d_max, as with d_max = 1 cm."""
    found = []
    for reach in (1e-3, 1e-2):
        case = replace(SCANNING, deflection=reach)
        surface = case.surface("F", modulation_depth=0.0, friction=2.0 * case.friction)
        found.append(loop_work(surface, friction_path(case, 1e-7 * case.depth)))
    ratio = found[1] / found[0]
    return decide(
        f"d_max from 1 mm to 1 cm multiplies the energy by {ratio:.6f}, to {found[1] * 1e3:.2f} mJ",
        printed=abs(ratio - 10.0) < 1e-6,
        energies=found,
    )
