"""The number of package functions that one analysis call enters."""

from __future__ import annotations

import sys
from collections.abc import Callable
from types import FrameType
from typing import Any

import pytest

import asperity
from asperity.analysis import characteristic_number
from asperity.surface import Surface
from asperity.textures import Sinusoid

_PACKAGE = asperity.__path__[0]


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


@pytest.mark.parametrize("law", ["W", "A", "B", "E", "G"])
def test_closed_form_number_enters_few_functions(law: str) -> None:
    texture = Sinusoid(amplitude=0.8e-3, period=1e-3)
    characteristic_number(Surface(texture, law))  # compile before counting
    surface = Surface(Sinusoid(amplitude=0.7e-3, period=1e-3), law)
    entered = entered_functions(lambda: characteristic_number(surface))
    assert 10 < len(entered) <= 40, sorted(entered)
