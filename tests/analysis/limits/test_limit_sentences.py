"""The result of limits as sentences, as data and in a notebook, and on a flat surface."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest
from tests.analysis.limits.bench_limits import NUMBERS, A, L, V, default_limits, device, verdicts

from asperity.analysis.results.check_limits import limits
from asperity.textures import Fourier, HeightMap, Sinusoid

TWO = Fourier([5e-5, 2.4e-5], [2 * math.pi / 0.8e-3, 2 * math.pi / 0.32e-3], [0.2, 1.0])
LONG = 5.0**2 / (5.0**2 + 2.4**2)  # share of the long wave


@pytest.mark.parametrize(
    ("changes", "words"),
    [
        ({"bandwidth": None}, "limits 1, 2, 3, 4 and 5 hold at 0.12 m/s"),
        (dict.fromkeys(NUMBERS.keys() - {"max_stiffness"}), "limit 5 holds at 0.12 m/s"),
    ],
)
def test_answer_lists_the_limits_that_hold(changes: dict[str, None], words: str) -> None:
    result = default_limits(device=device(**changes))
    assert f"As far as can be decided: {words}. Not decidable: " in result.answer


def test_limits_to_dict_is_complete() -> None:
    result = default_limits(TWO)
    content = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert content["schema"] == 4
    assert [limit["number"] for limit in content["limits"]] == [1, 2, 3, 4, 5, 6]
    assert content["limits"][1]["speeds"] == [0.0, "inf"]
    assert content["waves"][0]["holds"] == {"1": True, "2": True, "3": True, "4": True, "6": True}
    assert content["speed"] == V
    assert content["perceptibility"]["resolved"] == pytest.approx(LONG)
    assert content["gain"]["symbol"] == "q"


def test_assumptions_state_the_defaults_in_use() -> None:
    assumptions = " | ".join(limits(Sinusoid(A, L), device()).assumptions)
    for phrase in ("Default speed 0.1 m/s", "α = 5, β = 5, γ = 5", "Default max depth 100 µm"):
        assert phrase in assumptions
    explicit = " | ".join(
        default_limits(time_samples=5.0, position_samples=5.0, force_steps=5.0).assumptions
    )
    for phrase in ("Default speed", "α = ", "Default max depth", "Stiffness"):
        assert phrase not in explicit
    assert "Not verified for the bench: update rate 2 kHz" in assumptions


def test_verified_device_data_are_not_reported_as_unverified() -> None:
    assumptions = " | ".join(limits(Sinusoid(A, L), "inverse3").assumptions)
    assert "Not verified" not in assumptions
    assert "filters the force" in assumptions


def test_notebook_representation_is_a_table() -> None:
    text = default_limits(device=device(bandwidth=None))._repr_html_()
    assert text.count("<tr") == 7
    assert "needs" in text
    assert "bandwidth" in text


def test_flat_surface_is_reported_as_flat() -> None:
    result = default_limits(HeightMap(np.full((6, 6), 1e-3), 1e-4))
    assert result.answer == "The surface is flat: there is no texture to feel."
    assert verdicts(result) == {**dict.fromkeys([1, 2, 3, 4, 6]), 5: True}
    assert result.limit(1).missing_data == ("waves: the surface is flat",)
    assert result.resolved_share == 0.0
    json.dumps(result.to_dict(), allow_nan=False)
