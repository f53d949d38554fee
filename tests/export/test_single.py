"""Exported C in single precision."""

from __future__ import annotations

import re
from collections.abc import Callable
from typing import Any

import pytest
from bench import single as bench_single
from bench.single import measure_single_precision
from tests.helpers.c_programs import header

from asperity.laws import LAWS
from asperity.surface import Surface
from asperity.textures import Texture


@pytest.mark.parametrize("kind", ["sinusoid", "fourier", "map", "profile"])
def test_close_to_the_force_in_double(kind: str, make_texture: Callable[[str], Texture]) -> None:
    """Within 1e-5, or where rounding of the position, a tie or the solver says why not."""
    for letter in LAWS:
        surface = Surface(make_texture(kind), letter, clamp="backed")
        found = measure_single_precision(
            surface, 200 if surface.law.contact.requires_search else 1000
        )
        assert found.unexplained == 0, letter
        assert found.near + found.position >= 0.94 * sum(found[:5]), letter


def test_another_force_is_not_explained(
    make_texture: Callable[[str], Texture], monkeypatch: pytest.MonkeyPatch
) -> None:
    surface = Surface(make_texture("map"), "D", clamp="backed")
    right = bench_single.ticks

    def wrong(made: Any, name: str, at: Any) -> Any:
        return right(made, name, at) * (1.0002 if name == "f" else 1.0)

    monkeypatch.setattr(bench_single, "ticks", wrong)
    assert measure_single_precision(surface, 200).unexplained > 100


def test_float_throughout(make_texture: Callable[[str], Texture]) -> None:
    text = header(Surface(make_texture("map"), "D"), "t", "float")
    code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL).split("typedef struct t_state")[1]
    assert "double" not in code
    assert "1.1920929e-07f" in code  # where iterations end
    assert "2.220446e-16f" not in code
    assert not re.search(r"\b(sqrt|sin|cos|fabs|copysign)\(", code)
    assert not re.search(r"\d\.\d+(e-?\d+)?(?![\dfe])", code)
