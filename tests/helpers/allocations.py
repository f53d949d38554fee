"""What a call allocates, seen by Python."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable


def traced_peak(run: Callable[[], object]) -> int:
    """Return the peak of a call's allocations [bytes], Python's own and NumPy's.

    Tracing ends whatever happens: it slows down whatever allocates, and so all later tests.
    """
    tracemalloc.start()
    try:
        run()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
