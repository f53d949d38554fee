"""Are the borders of envelopes those of comparisons, on 200 random ones?

``python -m bench.stress.envelopes [COUNT]`` runs the check of ``tests/envelopes`` on that many
borders.
"""

from __future__ import annotations

import sys
import time

from tests.envelopes import test_envelope_borders as borders


def main() -> None:
    borders.COUNT = int(sys.argv[1]) if len(sys.argv) > 1 else 200
    start = time.perf_counter()
    borders.test_random_borders_are_those_of_comparisons()
    print(f"{borders.COUNT} borders hold, {time.perf_counter() - start:.0f} s")


if __name__ == "__main__":
    main()
