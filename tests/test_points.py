"""Functions of points accept a single point and return the row of a one-row array."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import asperity as asp

PROBE, PLACE = (0.31e-3, -0.17e-3, -0.05e-3), (0.31e-3, -0.17e-3)
PULLED = (2e-4, -1e-4)
STEEP = asp.Sinusoid(0.2e-3, 1e-3, direction=(3, 4))


def surface(law: str) -> asp.Surface:
    return asp.Surface(STEEP, law)


def baked() -> asp.Surface:
    return asp.bake(surface("H"), resolution=40e-6)


FUNCTIONS: dict[str, tuple[Callable[[], Callable[[Any], Any]], tuple[float, ...]]] = {
    "height": (lambda: STEEP.height, PLACE),
    "gradient": (lambda: STEEP.gradient, PLACE),
    "hessian": (lambda: STEEP.hessian, PLACE),
    "derivatives": (lambda: STEEP.derivatives, PLACE),
    "nearest": (lambda: STEEP.nearest, PROBE),
    **{f"force {law}": (lambda law=law: surface(law).force, PROBE) for law in "WABCDEFGH"},
    **{f"jacobian {law}": (lambda law=law: surface(law).jacobian, PROBE) for law in "BF"},
    "force_and_jacobian": (lambda: surface("C").force_and_jacobian, PROBE),
    "baked force": (lambda: baked().force, PROBE),
    "baked jacobian": (lambda: baked().jacobian, PROBE),
    "baked split_state": (lambda: lambda at: parts(asp.split_state(baked(), at)), PROBE),
    "split_state": (lambda: lambda at: parts(asp.split_state(surface("H"), at)), PROBE),
}


def parts(state: asp.SplitState) -> tuple[Any, ...]:
    return state.potential, state.atoms, state.gap


def as_tuple(result: Any) -> tuple[Any, ...]:
    return result if isinstance(result, tuple) else (result,)


@pytest.mark.parametrize("name", FUNCTIONS)
def test_single_point_equals_a_one_row_array(name: str) -> None:
    get_function, point = FUNCTIONS[name]
    function = get_function()
    rows, single = as_tuple(function([point])), as_tuple(function(point))
    for row, value in zip(rows, single, strict=True):
        assert row.shape[0] == 1
        assert value.shape == row.shape[1:]
        assert np.array_equal(value, row[0])
        assert value.ndim or float(value) == float(row[0])  # a number, no array
        assert value.ndim or not isinstance(value, np.ndarray)
    assert any(np.any(value != 0) for value in single) or name == "beyond"


@pytest.mark.parametrize("name", FUNCTIONS)
def test_no_points_give_empty_results(name: str) -> None:
    get_function, point = FUNCTIONS[name]
    for result in as_tuple(get_function()(np.empty((0, len(point))))):
        assert len(result) == 0


@pytest.mark.parametrize("name", FUNCTIONS)
@pytest.mark.parametrize(
    "wrong", [lambda p: [[p]], lambda p: p[:-1], lambda p: (*p, 0.0), lambda _: []]
)
def test_error_for_a_wrong_shape_names_both_shapes(name: str, wrong: Callable[[Any], Any]) -> None:
    get_function, point = FUNCTIONS[name]
    width = len(point)
    message = rf"must have shape \(n, {width}\), or \({width},\) for one point \[m\]"
    with pytest.raises(asp.ParameterError, match=message):
        get_function()(wrong(point))


def test_state_of_a_single_point_has_no_first_axis() -> None:
    law_f = surface("F")
    forces, matrices = law_f.force_and_jacobian([PROBE], [PULLED], [True])
    force, matrix = law_f.force_and_jacobian(PROBE, PULLED, True)
    assert np.array_equal(force, forces[0])
    assert np.array_equal(matrix, matrices[0])
    assert np.array_equal(law_f.jacobian(PROBE, PULLED, np.True_), matrices[0])
    assert np.array_equal(law_f.force(PROBE, PULLED), law_f.force([PROBE], [PULLED])[0])
    sticking = law_f.jacobian(PROBE, PULLED, False)
    assert not np.array_equal(sticking, matrix)
    assert not np.array_equal(law_f.force(PROBE), force)


def test_state_of_a_wrong_shape_is_refused() -> None:
    law_f = surface("F")
    with pytest.raises(asp.ParameterError, match=r"deflection must have shape \(2,\) \[m\]"):
        law_f.force(PROBE, [PULLED])
    with pytest.raises(asp.ParameterError, match=r"deflection must have shape \(1, 2\) \[m\]"):
        law_f.force([PROBE], PULLED)
    with pytest.raises(asp.ParameterError, match="sliding must be one truth value"):
        law_f.jacobian(PROBE, PULLED, [True])
    with pytest.raises(asp.ParameterError, match="sliding must be 1 truth values"):
        law_f.jacobian([PROBE], [PULLED], True)
    with pytest.raises(asp.ParameterError, match="max_deflection"):
        law_f.force(PROBE, (1.0, 0.0))


def test_masked_values_are_refused() -> None:
    heights = np.ma.masked_greater(np.arange(36.0).reshape(6, 6), 30.0)
    with pytest.raises(asp.ParameterError, match="heights must have no masked values"):
        asp.HeightMap(heights, 1e-4)


def test_error_names_the_coordinate_that_is_not_finite() -> None:
    with pytest.raises(asp.ParameterError, match=r"must be finite \[m\]; the value at \[0, 2\]"):
        surface("C").force((0.0, 0.0, np.nan))


def test_paths_and_polygons_must_be_arrays_of_rows() -> None:
    with pytest.raises(asp.ParameterError, match=r"path must have shape \(n, 3\) \[m\]"):
        surface("C").trace(PROBE)
    with pytest.raises(asp.ParameterError, match=r"vertices must have shape \(n, 3\) \[m\]"):
        asp.loop_work(surface("C"), PROBE)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
@pytest.mark.parametrize("place", range(3))
@pytest.mark.parametrize("form", [list, np.array, lambda row: np.array([row])])
def test_single_point_that_is_not_finite_is_refused(
    bad: float, place: int, form: Callable[[list[float]], Any]
) -> None:
    row = list(PROBE)
    row[place] = bad
    with pytest.raises(asp.ParameterError, match=rf"finite .*\[0, {place}\] is {bad}"):
        surface("C").force(form(row))


def test_infinities_that_cancel_are_refused() -> None:
    with pytest.raises(asp.ParameterError, match="finite"):
        surface("C").force(np.array([np.inf, -np.inf, 0.0]))


def test_numbers_whose_sum_overflows_are_valid() -> None:
    far = np.array([1.7e308, 1.7e308, -1e-3])
    assert surface("W").force(far)[2] > 0.0


def test_strided_points_are_valid() -> None:
    spread = np.repeat(PROBE, 3)[::3]
    assert not spread.flags.c_contiguous
    assert np.array_equal(surface("C").force(spread), surface("C").force(PROBE))
