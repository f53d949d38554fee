"""Claims that compare a printed formula with a reference, one row of ``formulas.toml`` each."""

from __future__ import annotations

import math
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np

from asperity.analysis.energy.loop_integral import loop_work
from asperity.core.checks import FloatArray
from asperity.core.files import read_toml
from asperity.paper.cases import SCANNING, random_settings
from asperity.paper.claim import Check, check_values, combine_checks
from asperity.paper.formula_checks import (
    check_continuity,
    check_curl,
    check_energy_sign,
    check_potential,
    check_zero_outside,
)
from asperity.paper.probes import ProbePoint, closest_point_derivatives, generic_probes

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
        printed, corrected = (
            np.broadcast_to(evaluate_formula(formula, points), reference.shape) if formula else None
            for formula in (self.printed, self.corrected)
        )
        name = self.quantity.replace("jacobian", "Jacobian")
        return check_values(
            self.label or f"{name} of {law} at generic probes, by definition and kernel",
            printed=printed,
            corrected=corrected,
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
        [*_probe_values(one.probe), *one.force, *one.jacobian.ravel(), *one.derivatives.ravel()]
        for one in closest_point_derivatives()
    ]


FORMULAS = read_toml("formulas", Path(__file__).with_name("formulas.toml"))
"""Rows by the id of the claim; each also describes the claim."""
