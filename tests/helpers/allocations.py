"""Memory allocations of a call, measured with tracemalloc."""

from __future__ import annotations

import tracemalloc
from collections.abc import Callable


def traced_peak(run: Callable[[], object]) -> int:
    """Return the peak of the allocations of a call [bytes], those of NumPy included.

    Tracing is stopped after errors, too: it slows down every allocation of later tests.
    """
    tracemalloc.start()
    try:
        run()
        return tracemalloc.get_traced_memory()[1]
    finally:
        tracemalloc.stop()
