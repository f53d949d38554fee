"""A user-defined law in ten lines, and what asperity derives from it.

Run it: ``python examples/own_law.py``. The law below is C with a spring that stiffens with depth,
f = -∇(k δ⁴/(4 D²)): it is written as mathematics, and its Jacobian, the proof that it is
conservative, its compiled kernel and its row in the comparison are derived. The commands take it
too: ``asperity compare cloth --plugin examples/own_law.py --set reference_depth=0.2mm``.
"""

import asperity as asp
from asperity.core.arguments import Argument
from asperity.derive.derivatives import curl_verdict, derive
from asperity.derive.generate import law_source

STIFFENING = asp.Law(
    letter="S",
    name="stiffening-change-of-height",
    contact="vertical",
    force=lambda c: c.k * c.depth**3 / c.parameter("reference_depth") ** 2 * c.w,
    summary="gradient of the energy k δ⁴/(4 D²)",
    parameters={
        "reference_depth": Argument(
            "reference_depth",
            "depth at which it is as stiff as k",
            "m",
            0.3e-3,
            must_be_positive=True,
        )
    },
)


def main() -> None:
    """Show what follows from the law."""
    print("Jacobian:", derive(STIFFENING).jacobian)
    print("Curl:", curl_verdict(STIFFENING).reason)
    print("Kernel:", law_source(STIFFENING), sep="\n")
    texture = asp.Sinusoid(amplitude=0.1e-3, period=2e-3)
    result = asp.compare(texture, laws=["C", STIFFENING], max_depth=0.3e-3)
    for row in result.rows:
        print(
            f"{row.law.letter}: q = {row.q.value:.3f} ({row.q.method}), "
            f"up to {row.stability_limit.stiffness:.0f} N/m, "
            f"conservative: {row.conservative}; {row.verdict}"
        )


if __name__ == "__main__":
    main()
