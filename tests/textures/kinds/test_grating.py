"""Gratings: levels, duty, edges, and the spline against the closed form of the profile."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.optimize import brentq

from asperity.core.errors import ParameterError
from asperity.textures import Profile
from asperity.textures.kinds.grating import Grating

SHAPES = [
    (0.2e-3, 2e-3, 0.5, None),
    (0.2e-3, 2e-3, 0.25, 0.1e-3),
    (1.5e-3, 1e-3, 0.7, 0.2e-3),
    (5e-6, 0.3e-3, 0.31, 0.02e-3),
]
every_shape = pytest.mark.parametrize(("height", "period", "duty", "edge"), SHAPES)


def on_line(x: Any) -> np.ndarray:
    x = np.atleast_1d(np.asarray(x, dtype=float))
    return np.column_stack([x, np.cos(7e3 * x)])  # y does not matter


def reference_height(x: float, height: float, period: float, duty: float, edge: float) -> float:
    """Return the height by cases: top, edge (by integrating its slope) and groove."""
    u = abs((x + period / 2) % period - period / 2)
    inner, outer = duty * period / 2 - edge / 2, duty * period / 2 + edge / 2
    if u <= inner:
        return height / 2
    if u >= outer:
        return -height / 2
    # The slope of the edge is height/edge (1 - cos 2πt): Simpson's rule on many steps.
    t = np.linspace(0.0, (u - inner) / edge, 401)
    f = 1.0 - np.cos(2 * np.pi * t)
    weights = np.ones(401)
    weights[1:-1:2], weights[2:-1:2] = 4.0, 2.0
    return float(height / 2 - height * (t[1] / 3.0) * (weights @ f))


@every_shape
def test_height_matches_the_reference_by_cases(
    height: float, period: float, duty: float, edge: Any
):
    grating = Grating(height, period, duty, edge)
    x = np.random.default_rng(1).uniform(-2, 3, 400) * period
    expected = [reference_height(one, height, period, duty, grating.edge) for one in x]
    np.testing.assert_allclose(grating.height(on_line(x)), expected, rtol=0, atol=2e-5 * height)
    np.testing.assert_allclose(grating.closed_form(x), expected, rtol=0, atol=1e-9 * height)


@every_shape
def test_levels_are_plus_and_minus_half_the_height(
    height: float, period: float, duty: float, edge: Any
):
    grating = Grating(height, period, duty, edge)
    low, high = grating.extremes
    assert (low, high) == pytest.approx((-height / 2, height / 2), rel=5e-5)
    middle = grating.height(on_line([0.0, period / 2, 5 * period]))
    np.testing.assert_allclose(middle, [height / 2, -height / 2, height / 2], rtol=5e-5)


@every_shape
def test_duty_is_measured_at_half_height(height: float, period: float, duty: float, edge: Any):
    grating = Grating(height, period, duty, edge)

    def crossing(a: float, b: float) -> float:
        return float(brentq(lambda x: grating.height(on_line(x))[0], a, b, xtol=1e-15))

    right, left = crossing(0.0, period / 2), crossing(-period / 2, 0.0)
    assert (right - left) / period == pytest.approx(duty, abs=1e-6)
    assert right == pytest.approx(-left, rel=1e-6)
    mean = grating.heights.mean() / height
    assert mean == pytest.approx(duty - 0.5, abs=1e-6)


@every_shape
def test_edge_has_the_stated_width(height: float, period: float, duty: float, edge: Any):
    grating = Grating(height, period, duty, edge)
    begin = duty * period / 2 - grating.edge / 2
    # At 0.2 of its width an edge has risen by 0.2 - sin(0.4 π)/(2π) = 4.86 % of the height.
    share = 0.2 - math.sin(0.4 * math.pi) / (2 * math.pi)
    t = np.array([-0.1, 0.0, 0.2, 0.5, 0.8, 1.0, 1.1])
    fallen = 0.5 - grating.height(on_line(begin + t * grating.edge)) / height
    np.testing.assert_allclose(fallen, [0, 0, share, 0.5, 1 - share, 1, 1], atol=2e-5)


@every_shape
def test_slope_and_curvature_of_the_edge(height: float, period: float, duty: float, edge: Any):
    grating = Grating(height, period, duty, edge)
    steepest, greatest = 2 * height / grating.edge, 2 * np.pi * height / grating.edge**2
    middle = duty * period / 2
    t = np.linspace(0.0, 1.0, 41)
    xy = on_line(middle + (t - 0.5) * grating.edge)
    slope = -height / grating.edge * (1.0 - np.cos(2 * np.pi * t))
    curvature = -greatest * np.sin(2 * np.pi * t)
    np.testing.assert_allclose(grating.gradient(xy)[:, 0], slope, atol=1.5e-3 * steepest)
    np.testing.assert_allclose(grating.hessian(xy)[:, 0, 0], curvature, atol=0.05 * greatest)
    assert grating.gradient(on_line(middle))[0, 0] == pytest.approx(-steepest, rel=2e-4)
    assert grating.bounds[0] == pytest.approx(steepest, rel=3e-3)
    assert grating.bounds[1] == pytest.approx(greatest, rel=0.03)


def test_closed_form_is_twice_differentiable():
    """The second derivative is continuous at both ends of an edge, unlike a raised cosine's."""
    grating = Grating(0.2e-3, 2e-3, 0.4, 0.3e-3)
    step = 1e-3 * grating.edge
    ends = 0.4e-3 + np.array([-0.5, 0.5]) * grating.edge
    second = [
        (
            grating.closed_form(ends + (i + 1) * step)
            - 2 * grating.closed_form(ends + i * step)
            + grating.closed_form(ends + (i - 1) * step)
        )
        / step**2
        for i in (-3, -1, 0, 1, 3)
    ]
    assert np.abs(second).max() < 0.03 * 2 * np.pi * grating.ridge_height / grating.edge**2


@settings(max_examples=30, deadline=None)
@given(duty=st.floats(0.05, 0.95), share=st.floats(0.05, 1.0))
def test_spline_error_is_below_the_stated_fraction(duty: float, share: float):
    period = 1e-3
    grating = Grating(1e-4, period, duty, share * min(duty, 1 - duty) * period)
    assert grating.pitch <= grating.edge / 40 * (1 + 1e-9)
    x = np.linspace(0.0, period, 8001)
    assert np.abs(grating.height(on_line(x)) - grating.closed_form(x)).max() < 2e-5 * 1e-4


def test_default_edge_is_a_quarter_of_the_narrower_level():
    assert Grating(1e-4, 1e-3, 0.2).edge == pytest.approx(0.05e-3)
    assert Grating(1e-4, 1e-3, 0.8).edge == pytest.approx(0.05e-3)


def test_edge_as_wide_as_the_ridge_reaches_full_height():
    grating = Grating(1e-4, 1e-3, 0.5, 0.5e-3)
    assert grating.peak_to_valley == pytest.approx(1e-4, rel=1e-4)


def test_grating_is_a_periodic_profile_with_a_description():
    grating = Grating(1e-4, 1e-3, 0.3, 0.1e-3)
    assert isinstance(grating, Profile)
    assert grating.is_profile
    assert grating.domain.periodic
    assert grating.domain.spans[0, 0] == pytest.approx(1e-3, rel=1e-14)
    description = grating.describe()
    expected = {"kind": "grating", "height": 1e-4, "period": 1e-3, "duty": 0.3, "edge": 0.1e-3}
    assert {name: description[name] for name in expected} == expected
    rebuilt = eval(repr(grating), {"Grating": Grating})
    np.testing.assert_array_equal(rebuilt.heights, grating.heights)


@pytest.mark.parametrize(
    ("argument", "changed"),
    [
        ("height", {"height": 0.0}),
        ("height", {"height": -1e-4}),
        ("height", {"height": "1 kg"}),
        ("period", {"period": 0.0}),
        ("period", {"period": math.inf}),
        ("duty", {"duty": 0.0}),
        ("duty", {"duty": 1.0}),
        ("duty", {"duty": math.nan}),
        ("edge", {"edge": 0.0}),
        ("edge", {"edge": 0.51e-3}),
        ("edge", {"edge": 0.31e-3, "duty": 0.7}),
        ("edge", {"edge": 1e-7}),
    ],
)
def test_invalid_arguments_are_refused(argument: str, changed: dict[str, Any]):
    with pytest.raises(ParameterError, match=f"^{argument} ") as caught:
        Grating(**({"height": 1e-4, "period": 1e-3} | changed))
    assert caught.value.argument == argument
