"""Exported C in single precision."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from bench.stress import single as bench_single
from bench.stress.single import measure_single_precision
from tests.helpers.c_programs import header

from asperity.export.expressions import real_literal, real_literals
from asperity.laws import LAWS
from asperity.surface import Surface
from asperity.textures import Texture


@pytest.mark.parametrize(
    ("kind", "laws"),
    [("sinusoid", "".join(LAWS)), ("fourier", "".join(LAWS)), ("map", "BFDH"), ("profile", "CEG")],
)
def test_single_precision_force_is_close_to_double(
    kind: str, laws: str, make_texture: Callable[[str], Texture]
) -> None:
    """The error is below 1e-5, or explained by rounding of the position, or a tie."""
    for letter in laws:
        surface = Surface(make_texture(kind), letter, clamp="backed")
        counts = measure_single_precision(
            surface, 200 if surface.law.contact.requires_search else 1000
        )
        assert counts.unexplained == 0, letter
        assert counts.near + counts.position >= 0.94 * sum(counts[:4]), letter


def test_changed_force_is_not_explained(
    make_texture: Callable[[str], Texture], monkeypatch: pytest.MonkeyPatch
) -> None:
    surface = Surface(make_texture("fourier"), "D", clamp="backed")
    ticks = bench_single.ticks

    def scaled_ticks(program: Any, name: str, points: Any) -> Any:
        return ticks(program, name, points) * (1.0002 if name == "f" else 1.0)

    monkeypatch.setattr(bench_single, "ticks", scaled_ticks)
    assert measure_single_precision(surface, 200).unexplained > 100


def test_single_precision_code_contains_no_double(make_texture: Callable[[str], Texture]) -> None:
    text = header(Surface(make_texture("map"), "D"), "t", "float")
    code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL).split("typedef struct t_state")[1]
    assert "double" not in code
    assert "1.1920929e-07f" in code  # where iterations end
    assert "2.220446e-16f" not in code
    assert not re.search(r"\b(sqrt|sin|cos|fabs|copysign)\(", code)
    assert not re.search(r"\d\.\d+(e-?\d+)?(?![\dfe])", code)


def test_literals_of_an_array_have_the_bits_of_each_number() -> None:
    special = [0.0, -0.0, 1.0, -3e7, 1e-300, -1e-40, 1e39, -1e39, math.inf, math.nan]
    random = np.random.default_rng(8).normal(size=(60, 30)) * 10.0 ** np.arange(-30, 30)[:, None]
    random = random.ravel()
    values = np.concatenate([special, random])
    for single, kind in ((True, np.float32), (False, np.float64)):
        texts = real_literals(values, single)
        assert texts[: len(special)] == [real_literal(value, single) for value in special]
        for text, value in zip(texts[len(special) :], random, strict=True):
            assert single == text.endswith("f")
            assert "." in text or "e" in text
            assert kind(text.removesuffix("f")) == kind(value)
