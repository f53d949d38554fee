"""Text is parsed in several threads at once, whatever the collector of garbage runs meanwhile."""

from __future__ import annotations

import gc
import inspect
import sys
from concurrent.futures import ThreadPoolExecutor

from asperity.kernels import link
from asperity.kernels.link import parse_source


def test_threads_parse_at_the_same_time() -> None:
    """Without a lock Python 3.11 fails here."""
    text, often, thresholds = inspect.getsource(link), sys.getswitchinterval(), gc.get_threshold()

    def called(_phase: str, _about: dict[str, int]) -> None:
        list(range(200))  # Python code, in which another thread may take over

    gc.callbacks.append(called)
    gc.set_threshold(100)
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(4) as pool:
            trees = list(pool.map(parse_source, [text] * 200))
    finally:
        sys.setswitchinterval(often)
        gc.set_threshold(*thresholds)
        gc.callbacks.remove(called)
    assert {len(tree.body) for tree in trees} == {len(trees[0].body)}
