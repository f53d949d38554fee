"""The sentences of section V that need the closed loop."""

from __future__ import annotations

from functools import partial

from asperity.paper.claim import Check, Claim


def simulated(name: str) -> Check:
    """Return what the simulated experiment of a claim finds."""
    from asperity.paper.experiments.findings import FINDINGS  # and with it the simulation

    return FINDINGS[name]()


def _claim(name: str, section: str, statement: str) -> Claim:
    return Claim(name, (), section, statement, partial(simulated, name))


SECTION_V_A = (
    _claim("sentence-V.A-cycles", "V.A",
           "At 2000 N/m W settles; textured with A or F it enters a limit cycle (Fig. 5)."),
    _claim("sentence-V.A-settles", "V.A",
           "Divided by 5.1 and 8.3 the stiffness of A and F lets them settle (Fig. 5)."),
)  # fmt: skip
SECTION_V_B = (
    _claim("sentence-V.B-A", "V.B", "On a stroke A gains energy along z, none along x (Fig. 6)."),
    _claim("sentence-V.B-G", "V.B", "On a stroke G is marginally passive along x and z (Fig. 6)."),
    _claim("sentence-V.B-D", "V.B",
           "On a stroke D is marginally passive along z, clearly along x (Fig. 6)."),
    _claim("sentence-V.B-F", "V.B",
           "On a stroke F is marginally passive along z, passive along x (Fig. 6)."),
)  # fmt: skip
SECTION_V_C = (
    _claim("sentence-V.C-A", "V.C", "On a 20 mm bump A gains in jumps and loses contact (Fig. 7)."),
    _claim("sentence-V.C-D", "V.C", "On a 20 mm bump D keeps its energy in balance (Fig. 7)."),
)  # fmt: skip
