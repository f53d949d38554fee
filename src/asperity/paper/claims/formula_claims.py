"""Claims that compare a printed formula with a reference, one row of ``formulas.toml`` each."""

from __future__ import annotations

import math
import tomllib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import lru_cache
from pathlib import Path

import numpy as np

from asperity.core.checks import FloatArray
from asperity.paper.claim import (
    DECLARED_CLAIMS,
    SCALED_FORCES,
    SCALED_JACOBIANS,
    Check,
    Claim,
    check_values,
    combine_checks,
)
from asperity.paper.formula_checks import check_continuity, check_curl, check_zero_outside
from asperity.paper.planar_cases import ProbePoint, closest_point_derivatives, generic_probes

_SYMBOLS = "k d z p h1 h2 n rx rz r fx fz Jxx Jxz Jzx Jzz xx xz zx zz"
_FLIPS_UNDER = {"force": SCALED_FORCES, "jacobian": SCALED_JACOBIANS}


@dataclass(frozen=True)
class FormulaRow:
    """A row of ``formulas.toml``, where the attributes and the symbols are explained."""

    id: str = ""
    section: str = ""
    equations: Sequence[str] = ()
    statement: str = ""
    law: str = ""
    quantity: str = ""
    printed: str = ""
    corrected: str = ""
    correction: str = ""
    true: str = ""
    label: str = ""
    is_zero_outside: bool = False
    conservative: Mapping[str, bool] = field(default_factory=dict)
    continuous: Mapping[str, bool] = field(default_factory=dict)
    flips_under: str = ""

    def to_claim(self) -> Claim:
        """Return the claim that compares this row."""
        change = self.flips_under or _FLIPS_UNDER[self.quantity]
        return Claim(
            self.id, tuple(self.equations), self.section, self.statement, self.check, change
        )

    def check(self) -> Check:
        """Compare the formula of each law, and check the laws' properties."""
        checks = [self._compare(law) for law in self.law]
        checks += [check_zero_outside(law) for law in self.law if self.is_zero_outside]
        checks += [check_continuity(law, is_continuous=so) for law, so in self.continuous.items()]
        checks += [check_curl(law, is_conservative=so) for law, so in self.conservative.items()]
        return combine_checks(*checks)

    def _compare(self, law: str) -> Check:
        if self.true:
            points = _closest_point_values()
            references = [_evaluate(self.true, points)]
        else:
            probes = list(generic_probes(law))
            points = [_probe_values(probe) for probe in probes]
            methods = {
                "force": (ProbePoint.force, ProbePoint.compiled_force),
                "jacobian": (ProbePoint.jacobian, ProbePoint.compiled_jacobian),
            }[self.quantity]
            references = [np.array([method(probe) for probe in probes]) for method in methods]
        count, name = len(references), self.quantity.replace("jacobian", "Jacobian")
        return check_values(
            f"{self.label or f'{name} of {law}'} at generic probes, by definition and kernel",
            printed=np.stack([_evaluate(self.printed, points)] * count) if self.printed else None,
            corrected=np.stack([_evaluate(self.corrected, points)] * count)
            if self.corrected
            else None,
            reference=references,
            correction=self.correction,
        )


def _evaluate(formula: str, points: Sequence[Sequence[float]]) -> FloatArray:
    """Evaluate a formula at points, each given by the values of the first symbols."""
    import sympy as sp

    symbols = sp.symbols(_SYMBOLS)[: len(points[0])]
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


_TABLE = Path(__file__).with_name("formulas.toml").read_text(encoding="utf-8")
DECLARED_CLAIMS += [FormulaRow(**row).to_claim() for row in tomllib.loads(_TABLE)["claim"]]
