"""Depth clamps: properties of the shipped clamps, and a further clamp."""

from __future__ import annotations

import numpy as np
import pytest

import asperity as asp
from asperity.core.errors import ParameterError
from asperity.laws.clamps import BACKED, CLAMPS, LATERAL, NONE, WHOLE, Clamp, find_clamp

UPWARD = Clamp("upward", "the depth of the vertical force is held at max_depth", (2,))
WAVE = asp.Sinusoid(0.2e-3, 1e-3, 0.4, (2.0, 1.0))
DEPTH = 0.3e-3


@pytest.fixture
def upward(monkeypatch: pytest.MonkeyPatch) -> Clamp:
    monkeypatch.setitem(CLAMPS, UPWARD.name, UPWARD)
    return UPWARD


def test_properties_of_the_shipped_clamps() -> None:
    assert list(CLAMPS.values()) == [NONE, WHOLE, LATERAL, BACKED]
    assert [str(clamp) for clamp in CLAMPS.values()] == list(CLAMPS)
    assert [clamp.changes_force for clamp in CLAMPS.values()] == [False, True, True, True]
    assert [clamp.holds_whole_force for clamp in CLAMPS.values()] == [False, True, False, True]
    assert [clamp.has_potential for clamp in CLAMPS.values()] == [True, True, False, True]
    assert [clamp.has_backing_wall for clamp in CLAMPS.values()] == [False, False, False, True]


def test_error_for_an_unknown_clamp_lists_all_names() -> None:
    with pytest.raises(ParameterError, match="must be one of none, whole, lateral, backed"):
        find_clamp("upward")
    with pytest.raises(ParameterError, match="must be one of none, whole, lateral, backed"):
        asp.Surface(WAVE, clamp="upward")


def probes(count: int = 200) -> np.ndarray:
    rng = np.random.default_rng(5)
    xy = rng.uniform(0.0, 2e-3, (count, 2))
    depth = rng.uniform(0.1 * DEPTH, 2.3 * DEPTH, count)
    return np.column_stack([xy, WAVE.height(xy) - depth])


def test_further_clamp_renders_its_force_and_jacobian(upward: Clamp) -> None:
    """The vertical force is that at max_depth, the lateral force that of the law."""
    plain = asp.Surface(WAVE, "B", max_depth=DEPTH)
    surface, whole = (
        asp.Surface(WAVE, "B", max_depth=DEPTH, clamp=name) for name in (upward.name, "whole")
    )
    p = probes()
    force, jacobian = surface.force_and_jacobian(p)
    np.testing.assert_allclose(force, surface.force(p), atol=1e-13)
    for component, expected in enumerate((plain, plain, whole)):
        value = expected.force_and_jacobian(p)
        np.testing.assert_allclose(force[:, component], value[0][:, component], atol=1e-13)
        np.testing.assert_allclose(jacobian[:, component], value[1][:, component], rtol=1e-11)
    assert np.abs(force - plain.force(p)).max() > 0.1


def test_further_clamp_has_facts_and_a_characteristic_number(upward: Clamp) -> None:
    surface = asp.Surface(WAVE, "C", max_depth=DEPTH, clamp=upward.name)
    assert not surface.facts.conservative
    assert "below max_depth the upward clamp gives the force a curl" in surface.facts.reason
    assert surface.clamped_depth > DEPTH
    q = asp.characteristic_number(surface)  # holds down to the clamped depth, 2.33 max_depth
    norms = np.linalg.norm(surface.jacobian(probes()), 2, axis=(1, 2))
    assert norms.max() <= q.upper * surface.stiffness * (1.0 + 1e-9)
