"""The analysis of one law on one surface and one device."""

from __future__ import annotations

import math
from dataclasses import dataclass, replace
from typing import Any

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.continuity import Continuity
from asperity.analysis.energy.leak import Leak
from asperity.analysis.energy.merit import Merit
from asperity.analysis.passivity.verdict import Passivity
from asperity.core.display import Plottable, Reportable
from asperity.core.files import attributes_to_dict, to_plain_data
from asperity.devices import Device
from asperity.surface import Surface

SCHEMA = 2


@dataclass(frozen=True)
class Analysis(Plottable, Reportable):
    """Results of one law on one surface and one device.

    Attributes:
        surface: the surface, with its law, stiffness and depth.
        device: the device.
        q: characteristic number [1].
        one_sided: one-sided number q⁺ [1].
        curl: sup |curl f|/k [1]; ``None`` for a law with state, whose force is no field.
        conservative: whether the work around every closed path is zero.
        conservative_reason: the reason, in one sentence.
        leak: the worst simple loop, in a vertical plane.
        continuity: whether the force jumps inside the working region, and where.
        passivity: every criterion on the device, and the deciding one.
        merit: strength and support on a straight scan.
        answer: the verdict in one sentence.
        assumptions: used defaults, unverified device data and preparation steps of the surface,
            in sentences.
    """

    surface: Surface
    device: Device
    q: Bound
    one_sided: Bound
    curl: Bound | None
    conservative: bool
    conservative_reason: str
    leak: Leak
    continuity: Continuity
    passivity: Passivity
    merit: Merit
    answer: str = ""
    assumptions: tuple[str, ...] = ()

    @property
    def curl_density(self) -> Bound | None:
        """Sup |curl f| [N/m]: the greatest work of a small loop per area [J/m²]."""
        if self.curl is None:
            return None
        k, upper = self.surface.stiffness, self.curl.upper
        # One unit in the last place covers the rounding of the product.
        top = math.nextafter(k * upper, math.inf) if upper > 0.0 else 0.0
        return replace(self.curl, lower=k * self.curl.lower, upper=top)

    @property
    def v_star(self) -> float | None:
        """v* [m/s], the speed below which damping does not absorb the worst loop.

        0 for a conservative law; ``None`` where the device's damping is not known.
        """
        return self.passivity.critical_speed

    def __repr__(self) -> str:
        law, verdict = self.surface.law.letter, self.passivity.verdict
        return f"<Analysis of law {law} on {self.device.id}: q = {self.q.value:.4g}, {verdict}>"

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number; infinity is the string "inf"."""
        surface = self.surface
        fields = (
            "device q one_sided curl curl_density conservative conservative_reason leak v_star "
            "continuity passivity merit assumptions"
        )
        return {
            "schema": SCHEMA,
            "answer": self.answer,
            "texture": to_plain_data(surface.texture.describe()),
            "law": surface.law.letter,
            "law_name": surface.law.name,
            **attributes_to_dict(surface, "law_parameters", "clamp", "stiffness", "max_depth"),
            **attributes_to_dict(self, *fields.split()),
        }
