"""Analysis: frozen results from a surface and a device."""

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.closed_loops import Leak
from asperity.analysis.energy.continuity import Continuity, Jump
from asperity.analysis.energy.field_energy import loop_work
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.gain.characteristic import (
    characteristic_number,
    curl_number,
    one_sided_number,
)
from asperity.analysis.passivity.criteria import Criterion
from asperity.analysis.passivity.verdict import Passivity
from asperity.analysis.results.compare import Comparison, compare
from asperity.analysis.results.recommendation import LawRow

__all__ = [
    "Bound",
    "Comparison",
    "Continuity",
    "Criterion",
    "Jump",
    "LawRow",
    "Leak",
    "Passivity",
    "characteristic_number",
    "compare",
    "curl_number",
    "loop_work",
    "one_sided_number",
    "worst_loop",
]
