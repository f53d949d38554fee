"""Claims that compare printed formulas with references, and checks shared by the claims on laws.

The formulas are rows of ``formulas.toml``; the checks are of curl, continuity, energies, potentials
and norms.
"""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path
from typing import Any

import numpy as np

from asperity.analysis.bounds.bound import spectral_norm
from asperity.analysis.bounds.sampling import dense_maximum
from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.field_energy import integrate, loop_work
from asperity.analysis.gain.characteristic import characteristic_number
from asperity.core.checks import FloatArray
from asperity.core.files import read_toml
from asperity.laws import find_law
from asperity.paper.cases import SCANNING, random_settings
from asperity.paper.claim import Check, check_statement, check_values, combine_checks
from asperity.paper.probes import (
    Potential,
    ProbePoint,
    closest_point_derivatives,
    find_closest_point,
    generic_probes,
    numerical_gradient,
)
from asperity.surface import Surface

_SYMBOLS = "k d z p h1 h2 n rx rz r fx fz Jxx Jxz Jzx Jzz xx xz zx zz"


@dataclass(frozen=True)
class FormulaRow:
    """What is compared; ``formulas.toml`` explains the attributes and the symbols."""

    law: str = ""
    quantity: str = ""
    printed: str = ""
    corrected: str = ""
    true: str = ""
    label: str = ""
    is_zero_outside: bool = False
    conservative: Mapping[str, bool] = field(default_factory=dict)
    continuous: Mapping[str, bool] = field(default_factory=dict)
    loop_energy: Mapping[str, str] = field(default_factory=dict)
    potential: str = ""
    energy: str = ""

    def check(self) -> Check:
        """Compare the formula of each law, and check the laws' properties."""
        checks = [self._compare(law) for law in self.law]
        checks += [check_potential(law) for law in self.potential]
        checks += [check_energy_sign(law) for law in self.energy]
        checks += [_check_loop_energy(law, text) for law, text in self.loop_energy.items()]
        checks += [check_zero_outside(law) for law in self.law if self.is_zero_outside]
        checks += [check_continuity(law, is_continuous=so) for law, so in self.continuous.items()]
        checks += [check_curl(law, is_conservative=so) for law, so in self.conservative.items()]
        return combine_checks(*checks)

    def _compare(self, law: str) -> Check:
        if self.true:
            points = _closest_point_values()
            reference = evaluate_formula(self.true, points)
        else:
            probes = list(generic_probes(law))
            points = [_probe_values(probe) for probe in probes]
            pairs = [probe.references(self.quantity) for probe in probes]
            reference = np.array(pairs).swapaxes(0, 1)
        values = {}
        for formula in filter(None, (self.printed, self.corrected)):
            values[formula] = np.broadcast_to(evaluate_formula(formula, points), reference.shape)
        name = self.quantity.replace("jacobian", "Jacobian")
        return check_values(
            self.label or f"{name} of {law} at generic probes, by definition and kernel",
            printed=values.get(self.printed),
            corrected=values.get(self.corrected),
            reference=reference,
        )


def _check_loop_energy(law: str, formula: str) -> Check:
    """Compare the printed energy around the path of Fig. 3 with quadrature of the force."""
    cases = [SCANNING, *random_settings()]
    parameters = [[case.stiffness, case.amplitude, case.period] for case in cases]
    return check_values(
        f"energy of {law} around the path for {len(cases)} parameter sets",
        printed=evaluate_formula(formula, parameters, "k A l"),
        reference=[loop_work(case.surface(law), case.groove_path()) for case in cases],
    )


def evaluate_formula(
    formula: str, points: Sequence[Sequence[float]], symbol_names: str = _SYMBOLS
) -> FloatArray:
    """Evaluate a formula at points, each given by the values of the first symbols."""
    import sympy as sp

    symbols = sp.symbols(symbol_names)[: len(points[0])]
    expression = sp.sympify(formula, locals={str(symbol): symbol for symbol in symbols})
    function = sp.lambdify(symbols, expression, "math")
    return np.array([function(*point) for point in points], dtype=float)


def _probe_values(probe: ProbePoint) -> list[float]:
    penetration = probe.z if probe.surface.law.letter in "FG" else probe.d
    derivatives = probe.slope, probe.second_derivative, math.hypot(1.0, probe.slope)
    to_closest = *probe.from_closest_point, probe.distance
    return [probe.k, probe.d, probe.z, penetration, *derivatives, *to_closest]


@lru_cache(maxsize=1)
def _closest_point_values() -> list[list[float]]:
    """Return the values of all symbols at the closest points of generic probes."""
    return [
        [
            *_probe_values(derivatives.probe),
            *derivatives.force,
            *derivatives.jacobian.ravel(),
            *derivatives.derivatives.ravel(),
        ]
        for derivatives in closest_point_derivatives()
    ]


FORMULAS = read_toml("formulas", Path(__file__).with_name("formulas.toml"))
"""Rows by the id of the claim; each also describes the claim."""


# --- shared checks --------------------------------------------------------------------------------


def format_by_name(values: Mapping[str, float], spec: str = ".2f", unit: str = "") -> str:
    """Return "A 1.00 unit, B 2.00 unit"."""
    return ", ".join([f"{name} {value:{spec}}{unit}" for name, value in values.items()])


def check_zero_outside(law: str) -> Check:
    """Check that the force of a law is zero just outside the body."""
    surface = SCANNING.surface(law)
    x = np.linspace(0.0, SCANNING.period, 17)
    height = surface.texture.height(np.column_stack([x, 0 * x]))
    level = 0.0 * x if law in "WFG" else height
    force = surface.force(np.column_stack([x, 0 * x, level + 1e-9]))
    largest = float(np.abs(force).max())
    return check_statement(
        f"force 1 nm outside at most {largest:g} N", printed=largest == 0.0, outside=largest
    )


def check_curl(law: str, *, is_conservative: bool) -> Check:
    """Check whether a law is conservative by its symbolic curl."""
    from asperity.derive.derivatives import curl_verdict

    verdict = curl_verdict(find_law(law))
    kind = "conservative" if verdict.conservative else "not conservative"
    return check_statement(
        f"{law} is {kind}: {verdict.reason}",
        printed=verdict.conservative is is_conservative,
        numbers={f"curl of {law}": ", ".join([str(entry) for entry in verdict.curl])},
    )


def check_continuity(law: str, *, is_continuous: bool) -> Check:
    """Check whether the force of a law is continuous inside the body."""
    surface = SCANNING.surface(law)
    result = continuity(surface, characteristic_number(surface)).continuous
    summary = f"force of {law} {'does not jump' if result else 'jumps'}"
    return check_statement(summary, printed=result is is_continuous)


def max_loop_share(law: str) -> float:
    """Return the greatest energy around the path of Fig. 3 over κ₀A², without its sign."""
    return max(
        [
            abs(loop_work(case.surface(law), case.groove_path(), 1e-10))
            / (case.stiffness * case.amplitude**2)
            for case in [SCANNING, *random_settings()]
        ]
    )


def check_potential(law: str) -> Check:
    """Check the gradient of the printed potential of a law and its sign as an energy."""
    probes = list(generic_probes(law))
    gradient = check_values(
        f"+∇U against the force of {law}",
        printed=[numerical_gradient(_printed_potential(s), s.x, s.z) for s in probes],
        reference=np.array([s.force() for s in probes]),
    )
    return combine_checks(gradient, check_energy_sign(law))


def _printed_potential(probe: ProbePoint) -> Potential:
    """Return -κ₀/2 times the squared distance to the contact point, above the probe or closest."""

    def potential(x: Any, z: Any) -> Any:
        at_x = x
        at_z = probe.profile()(x, 0)
        if probe.surface.law.letter == "D":
            at_x, at_z = find_closest_point(probe.surface, x, z, 60)
        return -probe.k * ((x - at_x) ** 2 + (z - at_z) ** 2) / 2

    return potential


def check_energy_sign(law: str) -> Check:
    """Compare the printed energy of a law with the work of pressing straight in."""
    probes = list(generic_probes(law))
    energies = np.array([probe.k * (0.5 * probe.distance**2) for probe in probes])
    return check_values(
        f"U against the work that pressing into {law} takes",
        printed=-energies,
        corrected=energies,
        reference=[_pressing_work(probe) for probe in probes],
        tolerance=1e-8,
    )


def _pressing_work(probe: ProbePoint) -> float:
    """Return the work against the force on the vertical path from the surface to the probe [J]."""
    top = float(probe.profile()(probe.x, 0))
    span = top - probe.z

    def force(s: FloatArray) -> FloatArray:
        points = np.column_stack([np.full(len(s), probe.x), 0 * s, top - s * span])
        return np.asarray(probe.surface.force(points)[:, 2])

    return span * integrate(force, 4)


def find_max_norm(surface: Surface) -> float:
    """Return the greatest ‖J‖/κ₀ at full depth by a search over compiled Jacobians."""
    return dense_maximum(
        surface, spectral_norm, lambda heights: np.full(len(heights), surface.max_depth)
    ).value


def segment_work(surface: Surface, start: FloatArray, end: FloatArray) -> float:
    """Return the work of the force along a straight segment [J]."""
    along = end - start
    return integrate(lambda s: surface.force(start + s[:, None] * along) @ along, 8, 1e-10)


def max_difference_quotient(surface: Surface, pairs: FloatArray) -> float:
    """Return the greatest |f(b) - f(a)| / |b - a| of pairs of probes, shape (2, n, 3) [N/m]."""
    forces = [surface.force(points) for points in pairs]
    changes = np.linalg.norm(forces[1] - forces[0], axis=1)
    distances = np.linalg.norm(pairs[1] - pairs[0], axis=1)
    return float((changes / distances).max())
