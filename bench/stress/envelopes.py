"""Are borders of envelopes those of comparisons, and do designs meet their targets?

``python -m bench.stress.envelopes [COUNT]`` runs the checks of ``tests/envelopes`` on that many
random borders and targets, 200 by default; each design is checked against a random search of 1000
points.
"""

from __future__ import annotations

import sys
import time

from tests.envelopes import test_envelope_borders as borders
from tests.envelopes import test_find_design as designs


def main() -> None:
    borders.COUNT = designs.COUNT = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    designs.POINTS = 1000
    for check in (
        borders.test_random_borders_are_those_of_comparisons,
        designs.test_feasible_targets_are_met_with_the_greatest_margin,
        designs.test_targets_beyond_reach_get_the_nearest_one,
        designs.test_a_requirement_binds_if_and_only_if_relaxing_it_extends_the_reach,
    ):
        start = time.perf_counter()
        check()
        seconds = time.perf_counter() - start
        print(f"{check.__name__}: holds on {designs.COUNT}, {seconds:.0f} s", flush=True)


if __name__ == "__main__":
    main()
