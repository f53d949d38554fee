"""The exported tick of laws with a search: evaluation budget, state and error bound."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.helpers.c_programs import (
    as_exported,
    compile_library,
    header,
    kernel_ticks,
    library,
    probes,
    same_bits,
    ticks,
)

from asperity.core.errors import ParameterError
from asperity.export.surface_functions import ExportRequest
from asperity.surface import Surface
from asperity.textures import Texture

SMALL_BUDGET = 60


def probe_path(surface: Surface) -> np.ndarray:
    """Return random probes, then a stroke on which each tick starts near the previous one."""
    random_probes = probes(surface.texture, surface.max_depth, 400, 5)
    share = np.linspace(0.2, 0.7, 400)[:, None] * np.ones(len(surface.texture.domain.spans))
    xy = surface.texture.domain.points(share)
    stroke = np.column_stack([xy, surface.texture.height(xy) - 0.5 * surface.max_depth])
    return np.ascontiguousarray(np.vstack([random_probes, stroke]))


def test_tick_equals_the_kernel_with_any_budget(
    make_texture: Callable[[str], Texture], tmp_path: Path
) -> None:
    surfaces = {x: Surface(make_texture("map"), x, clamp="backed") for x in "DE"}
    cases = {f"{x}_{budget:g}": (x, budget) for x in surfaces for budget in (SMALL_BUDGET, np.inf)}
    headers = {
        n: header(surfaces[x], n, max_evaluations=budget) for n, (x, budget) in cases.items()
    }
    program = library(tmp_path, "gcc", headers, "-O1")
    for name, (x, budget) in cases.items():
        path = probe_path(surfaces[x])
        result = ticks(program, name, path)
        assert same_bits(result, kernel_ticks(surfaces[x], path, budget)).all(), name
        if budget == np.inf:
            assert not result[:, 3].any()
        else:
            assert 0.0 < (result[:, 3] > 0.0).mean() < 1.0


@pytest.mark.parametrize("modulation", [0.0, 0.7])
def test_tick_with_friction_equals_the_kernel(
    modulation: float, make_texture: Callable[[str], Texture], tmp_path: Path
) -> None:
    texture = make_texture("map")
    friction = {"friction": 0.6, "friction_modulation": modulation}
    surfaces = {
        x: as_exported(Surface(texture, x, max_depth=2e-4, clamp="backed", **friction))  # type: ignore[arg-type]  # by name
        for x in "WCDH"
    }
    headers = {x: header(surface, x, max_evaluations=np.inf) for x, surface in surfaces.items()}
    program = library(tmp_path, "gcc", headers, "-O1")
    for x, surface in surfaces.items():
        path = probe_path(surface)
        result = ticks(program, x, path)
        assert same_bits(result, kernel_ticks(surface, path, np.inf)).all(), x
        plain = kernel_ticks(surface.without_friction(), path, np.inf)
        assert not same_bits(result, plain).all()


_STATES = """
#include "t.h"
void t_twice(const double *at, double *f);
void t_twice(const double *at, double *f)
{
    t_state zeroed = {{0, 0}, {0}, 0};
    t_state used;
    const double nowhere[3] = {0.0, 0.0, 1e9};
    double other[3] = {at[0] + 1e-3, at[1], at[2]};
    t_force(&zeroed, at, f);
    t_reset(&used);
    t_force(&used, other, f + 3);
    t_force(&used, nowhere, f + 3);
    t_force(&used, at, f + 3);
    f[6] = t_gap(&zeroed) - t_gap(&used);
}
"""


def test_zeroed_state_equals_a_reset_state(
    make_texture: Callable[[str], Texture], tmp_path: Path
) -> None:
    """So does a state after a position beyond all bounds."""
    surface = Surface(make_texture("map"), "D", clamp="backed")
    (tmp_path / "t.h").write_text(header(surface, "t", max_evaluations=SMALL_BUDGET))
    (tmp_path / "t.c").write_text(_STATES)
    program = compile_library(tmp_path, "gcc", tmp_path / "t.c")
    points, result = probes(surface.texture, surface.max_depth, 40, 2), np.empty(7)
    for point in np.ascontiguousarray(points):
        program.t_twice(point.ctypes, result.ctypes)
        expected = kernel_ticks(surface, point[None], SMALL_BUDGET)[0, :3]
        assert result.tolist() == [*expected, *expected, 0.0]


@pytest.mark.parametrize(
    ("law", "budget", "number"),
    [
        ("B", None, "1.0"),
        ("B", 50, "1.0"),
        ("D", None, "1500.0"),
        ("H", None, "1.0"),
        ("H", 50, "1.0"),
        ("D", 50, "50"),
        ("E", np.inf, "HUGE_VAL"),
    ],
)
def test_header_states_the_evaluation_budget(
    law: str, budget: float | None, number: str, wave: Texture
) -> None:
    text = header(Surface(wave, law), "t", max_evaluations=budget)
    assert re.search(rf"#define T_MAX_EVALUATIONS {re.escape(number)} ", text)


@pytest.mark.parametrize("budget", [0, -1, np.nan, -np.inf])
def test_invalid_evaluation_budgets_are_refused(budget: float, wave: Texture) -> None:
    with pytest.raises(ParameterError, match="max_evaluations must be"):
        ExportRequest(Surface(wave, "D"), max_evaluations=budget)
