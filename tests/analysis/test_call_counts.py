"""The number of package functions that one analysis call enters."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import FrameType
from typing import Any

import pytest

import asperity
from asperity.analysis import characteristic_number
from asperity.analysis.results.compare import compare
from asperity.devices import load_device, override_device
from asperity.surface import Surface
from asperity.textures import Sinusoid

_PACKAGE = asperity.__path__[0]
_TEXTURE = Sinusoid(amplitude=0.7e-3, period=1e-3)


def entered_functions(call: Callable[[], Any]) -> set[tuple[str, str]]:
    """Return file and name of the functions entered, without lambdas and comprehensions."""
    entered = set()

    def on_event(frame: FrameType, event: str, _argument: Any) -> None:
        code = frame.f_code
        if event == "call" and code.co_filename.startswith(_PACKAGE):
            entered.add((code.co_filename, code.co_qualname))

    sys.setprofile(on_event)
    try:
        call()
    finally:
        sys.setprofile(None)
    return {(file, name) for file, name in entered if not name.endswith(">")}


@pytest.mark.parametrize("amplitude", [0.1e-3, 0.7e-3])
@pytest.mark.parametrize("law", ["W", "A", "B", "C", "D", "E", "G", "H"])
def test_number_without_search_enters_few_functions(law: str, amplitude: float) -> None:
    """Law F's number and, on sums of waves, all others need a search."""
    for factor in (1.01, 1.02):  # compile before counting
        characteristic_number(Surface(Sinusoid(factor * amplitude, period=1e-3), law))
    surface = Surface(Sinusoid(amplitude, period=1e-3), law)
    entered = entered_functions(lambda: characteristic_number(surface))
    assert 10 < len(entered) <= 41, sorted(entered)


@pytest.mark.caches_results
def test_cached_number_enters_few_functions() -> None:
    surface = Surface(_TEXTURE, "F")
    characteristic_number(surface)
    entered = entered_functions(lambda: characteristic_number(surface))
    assert 10 < len(entered) <= 40, sorted(entered)


@pytest.mark.caches_results
@pytest.mark.parametrize("law", "WABCDEFGH")
def test_cached_row_of_a_comparison_enters_few_functions(
    law: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    # On a stiff device every law is felt, and nothing is looked for that would be.
    device = override_device(load_device("omega.3"), {"max_stiffness": "20 kN/m"})
    compare(_TEXTURE, device, laws=law)
    module, entered = sys.modules["asperity.analysis.results.comparison_rows"], set()
    compute_row = module._compute_row

    def count(*arguments: Any) -> Any:
        rows = []
        entered.update(entered_functions(lambda: rows.append(compute_row(*arguments))))
        return rows[0]

    monkeypatch.setattr(module, "_compute_row", count)
    compare(_TEXTURE, device, laws=law)
    # 90, five of perceptibility shared with envelopes, 18 of friction and of the risk,
    # four of the press, one that reports the part of the row, two of entries of the cache.
    assert 50 < len(entered) <= 120, sorted(entered)
