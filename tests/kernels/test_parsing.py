"""Source text is parsed safely in concurrent threads, even while garbage is collected."""

from __future__ import annotations

import gc
import inspect
import sys
from concurrent.futures import ThreadPoolExecutor

from asperity.kernels import link
from asperity.kernels.link import parse_source


def test_threads_can_parse_concurrently() -> None:
    """Without a lock Python 3.11 fails here."""
    text, switch_interval, thresholds = (
        inspect.getsource(link),
        sys.getswitchinterval(),
        gc.get_threshold(),
    )

    def run_python(_phase: str, _about: dict[str, int]) -> None:
        list(range(200))  # Python code, during which threads may switch

    gc.callbacks.append(run_python)
    gc.set_threshold(100)
    sys.setswitchinterval(1e-6)
    try:
        with ThreadPoolExecutor(4) as pool:
            trees = list(pool.map(parse_source, [text] * 200))
    finally:
        sys.setswitchinterval(switch_interval)
        gc.set_threshold(*thresholds)
        gc.callbacks.remove(run_python)
    assert {len(tree.body) for tree in trees} == {len(trees[0].body)}
