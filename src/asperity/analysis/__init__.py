"""A surface (and a device) in, a frozen result out."""

from asperity.analysis.bound import Bound
from asperity.analysis.characteristic import (
    characteristic_number,
    curl_number,
    one_sided_number,
)
from asperity.analysis.comparison import Comparison, compare
from asperity.analysis.continuity import Continuity, Jump
from asperity.analysis.criteria import Criterion
from asperity.analysis.leak import Leak, worst_loop
from asperity.analysis.loops import loop_work
from asperity.analysis.passivity import Passivity
from asperity.analysis.row import LawRow

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
