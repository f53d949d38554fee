"""A surface (and a device) in, a frozen result out."""

from asperity.analysis.bounds.bound import Bound as Bound
from asperity.analysis.compare import Comparison as Comparison
from asperity.analysis.compare import compare as compare
from asperity.analysis.energy.continuity import Continuity as Continuity
from asperity.analysis.energy.continuity import Jump as Jump
from asperity.analysis.energy.leak import Leak as Leak
from asperity.analysis.energy.leak import worst_loop as worst_loop
from asperity.analysis.energy.loops import loop_work as loop_work
from asperity.analysis.gain.characteristic import characteristic_number as characteristic_number
from asperity.analysis.gain.characteristic import curl_number as curl_number
from asperity.analysis.gain.characteristic import one_sided_number as one_sided_number
from asperity.analysis.passivity.criteria import Criterion as Criterion
from asperity.analysis.passivity.judgement import Passivity as Passivity
from asperity.analysis.row import LawRow as LawRow
