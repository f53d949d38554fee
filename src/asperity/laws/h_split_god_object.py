"""H, the split god-object: f = k (z̄ - p), D's formula on the split contact.

New here, not in the paper. With F the free set, c > 0 (``continuity``) and μ = 1/(1 + c), the
potential is U(p) = (1 - μ) sup_y [dist²(y, F)/2 - |p - y|²/(2μ)] and the force -k ∇U, a spring to
the mean z̄ of a god-object that has split where several surface points are about equally near. For
any surface: conservative, continuous, q = max(1, c), q⁺ = 1, no force outside; it equals law D up
to the fraction c/(1 + c) of the way to the medial axis (docs/theory/split.md).

The mathematics is the upper compensated convex transform of Zhang, Crooks and Orlando
(arXiv:1508.05522) and C^{1,1} extension (Azagra, Le Gruyer and Mudarra, arXiv:1706.02235); its use
as a haptic law is new. No perceptual test was done.
"""

from asperity.core.arguments import Argument
from asperity.laws.law import Law

LAW = Law(
    letter="H",
    name="split-god-object",
    contact="split",
    force=lambda c: c.k * c.toward,
    summary="spring to the mean of a god-object that splits",
    parameters={
        "continuity": Argument(
            "continuity",
            "parameter c of law H, which bounds the change of its force: q is max(1, c)",
            default=1.0,
            must_be_positive=True,
        )
    },
)
