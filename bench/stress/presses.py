"""Are the starts at a press those of an own bisection of k q(D(F))?

``python -m bench.stress.presses [COUNT]`` runs the check of ``tests/analysis/energy/test_press.py``
on that many random waves, laws and forces, 100 by default.
"""

from __future__ import annotations

import sys
import time

from tests.analysis.energy.test_press import check_random_press


def main() -> int:
    """Print how many starts agree, and each that does not."""
    count = int(sys.argv[1]) if len(sys.argv) > 1 else 100
    start = time.perf_counter()
    differing = 0
    found = 0
    for seed in range(count):
        try:
            found += check_random_press(seed)
        except AssertionError as error:
            differing += 1
            print(f"{seed}: {error}", flush=True)
    seconds = time.perf_counter() - start
    agreed = count - differing
    print(f"{agreed} of {count} presses agree within 1 %, {found} with a start, {seconds:.0f} s")
    return int(differing > 0)


if __name__ == "__main__":
    sys.exit(main())
