"""What the claims on the laws share: a printed formula against the definition of a law."""

from __future__ import annotations

import math
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

import numpy as np

from asperity.analysis.bounds.dense_search import greatest
from asperity.analysis.bounds.measures import spectral_norm
from asperity.analysis.energy.loops import integrate, loop_work
from asperity.analysis.gain.characteristic import characteristic_number
from asperity.checks import FloatArray
from asperity.laws import find_law
from asperity.paper.changes import other
from asperity.paper.claim import Check, decide, judge, settle
from asperity.paper.plane import SCANNING, Setting, Spot, groove_path, random_settings, spots
from asperity.surface import Surface

Formula = Callable[[Spot], FloatArray]
Potential = Callable[[Any, Any], Any]
Place = TypeVar("Place")


def compare_at(
    places: Sequence[Place],
    what: str,
    truths: Sequence[Callable[[Place], object]],
    printed: Callable[[Place], object],
    corrected: Callable[[Place], object] | None = None,
    correction: str = "",
) -> Check:
    """Compare a printed formula at generic probes with what it must be, got in several ways."""

    def at(formula: Callable[[Place], object]) -> FloatArray:
        values = np.array([formula(place) for place in places], dtype=float)
        return np.stack([values] * len(truths))

    return judge(
        f"{what} at generic probes, by definition and kernel",
        printed=at(printed),
        corrected=None if corrected is None else at(corrected),
        truth=[[truth(place) for place in places] for truth in truths],  # type: ignore[arg-type] # numbers
        correction=correction,
    )


def field_check(
    law: str, printed: Formula, corrected: Formula | None = None, correction: str = ""
) -> Check:
    """Compare a printed force with the law's definition and with its kernel."""
    places, truths = list(spots(law)), (Spot.force, Spot.compiled_force)
    return compare_at(places, f"force of {law}", truths, printed, corrected, correction)


def jacobian_check(
    law: str, printed: Formula, corrected: Formula | None = None, correction: str = ""
) -> Check:
    """Compare a printed Jacobian with differences of the law's definition and with its kernel."""
    places, truths = list(spots(law)), (Spot.jacobian, Spot.compiled_jacobian)
    return compare_at(places, f"Jacobian of {law}", truths, printed, corrected, correction)


def outside_check(law: str) -> Check:
    """Judge that a law is silent just outside the body."""
    surface = SCANNING.surface(law)
    x = np.linspace(0.0, SCANNING.period, 17)
    height = surface.texture.height(np.column_stack([x, 0 * x]))
    level = 0.0 * x if law in "WFG" else height
    force = surface.force(np.column_stack([x, 0 * x, level + 1e-9]))
    most = float(np.abs(force).max())
    return decide(f"force 1 nm outside at most {most:g} N", printed=most == 0.0, outside=most)


def curl_check(law: str, *, conservative: bool) -> Check:
    """Judge whether a law is conservative by its symbolic curl."""
    from asperity.derive.curl import curl_verdict

    verdict = curl_verdict(find_law(law))
    kind = "conservative" if verdict.conservative else "not conservative"
    return decide(
        f"{law} is {kind}: {verdict.reason}",
        printed=verdict.conservative is conservative,
        numbers={f"curl of {law}": ", ".join(str(entry) for entry in verdict.curl)},
    )


def loop_check(law: str, printed: Callable[[Setting], float]) -> Check:
    """Compare a printed energy of the path of Fig. 3 with quadrature of the force."""
    cases = [SCANNING, *random_settings()]
    return judge(
        f"energy of {law} around the path for {len(cases)} parameter sets",
        printed=np.array([printed(case) for case in cases]),
        truth=np.array([loop_work(case.surface(law), groove_path(case)) for case in cases]),
    )


def gradient_of(potential: Potential, at_x: float, at_z: float) -> list[float]:
    """Return the gradient at a place by differences in many digits."""
    import mpmath

    with mpmath.workdps(60):
        x, z, step = mpmath.mpf(at_x), mpmath.mpf(at_z), mpmath.mpf(10) ** -20
        pairs = [(potential(x + step, z), potential(x - step, z)),
                 (potential(x, z + step), potential(x, z - step))]  # fmt: skip
        return [float((ahead - behind) / (2 * step)) for ahead, behind in pairs]


def potential_check(
    law: str, potential: Callable[[Spot], Potential], half: Callable[[Spot], float]
) -> Check:
    """Judge a printed potential by its gradient, and by its sign as an energy."""
    places = list(spots(law))
    gradient = judge(
        f"+∇U against the force of {law}",
        printed=[gradient_of(potential(s), s.x, s.z) for s in places],
        truth=np.array([s.force() for s in places]),
    )
    return settle(gradient, energy_sign_check(law, places, [half(s) for s in places]))


def energy_sign_check(law: str, places: list[Spot], halves: list[float]) -> Check:
    """Compare a printed energy -κ₀ · half with the work that pressing straight in takes."""
    taken = []
    for spot in places:
        top = float(spot.profile()(spot.x, 0))
        span = top - spot.z

        def against(s: FloatArray, spot: Spot = spot, top: float = top) -> FloatArray:
            points = np.column_stack([np.full(len(s), spot.x), 0 * s, top - s * (top - spot.z)])
            return np.asarray(spot.surface.force(points)[:, 2])

        taken.append(span * integrate(against, 4))
    own = np.array([spot.k * half for spot, half in zip(places, halves, strict=True)])
    return judge(
        f"U against the work that pressing into {law} takes",
        printed=-own,
        corrected=own,
        correction="the stored energy is -U as printed, and the force minus its gradient",
        truth=taken,
        tolerance=1e-8,
    )


def greatest_norm(surface: Surface) -> float:
    """Return the greatest ‖J‖/κ₀ at full depth, by a search over compiled Jacobians."""
    return greatest(
        surface, spectral_norm, lambda heights: np.full(len(heights), surface.max_depth)
    ).value


def leg_work(surface: Surface, start: FloatArray, end: FloatArray) -> float:
    """Return the work of the force on a straight way [J]."""
    along = end - start
    return integrate(lambda s: surface.force(start + s[:, None] * along) @ along, 8, 1e-10)


SLOPES = other(
    "2πA/l for every q", "q_of",
    lambda _was: lambda case, _law: 2.0 * math.pi * case.amplitude / case.period,
)  # fmt: skip


def steepest_pairs(seed: int) -> dict[str, float]:
    """Return the greatest change of the force over length, as a part of q k, of five laws.

    Over 4000 pairs of probes apart, no deeper than max_depth at either end, and 250 close by
    where q is attained.
    """
    draw, case, shares = np.random.default_rng(seed), SCANNING, {}
    for law in "ABCEG":
        surface = case.surface(law)
        q = characteristic_number(surface)
        start = _inside(law, draw, 4000)
        small = np.array(q.at) - [0.0, 0.0, 1e-8] + 1e-9 * draw.normal(size=(500, 3)) * [1, 0, 1]
        pairs = np.concatenate([start, np.stack([small[:250], small[250:]])], axis=1)
        forces = [surface.force(points) for points in pairs]
        apart = np.linalg.norm(pairs[1] - pairs[0], axis=1)
        ratio = np.linalg.norm(forces[1] - forces[0], axis=1) / apart / (case.stiffness * q.value)
        shares[law] = float(ratio.max())
    return shares


def _inside(law: str, draw: np.random.Generator, count: int) -> FloatArray:
    """Return pairs of probes no deeper than max_depth at either end of short steps, (2, n, 3)."""
    case = SCANNING
    x = draw.uniform(0.0, case.period, count)
    top = case.texture.height(np.column_stack([x, 0 * x])) if law in "ABC" else 0.0 * x
    depth = case.depth * draw.uniform(0.1, 0.9, count)
    if law == "E":
        depth = depth + case.amplitude
    points = np.column_stack([x, 0 * x, top - depth])
    step = case.depth * 1e-3 * draw.normal(size=(count, 3)) * [1, 0, 1]
    return np.stack([points, points + step])


def q_of(case: Setting, law: str) -> float:
    """Return the characteristic number of a law in a setting of the paper."""
    return characteristic_number(case.surface(law)).value
