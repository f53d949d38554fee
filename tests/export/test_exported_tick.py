"""The exported tick of laws with a search: its budget, what it remembers, and its gap."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.helpers.c_programs import (
    compile_library,
    header,
    kernel_ticks,
    library,
    probes,
    same_bits,
    ticks,
)

from asperity.core.errors import ParameterError
from asperity.export.export_request import ExportRequest
from asperity.surface import Surface
from asperity.textures import Texture

FEW = 60


def path_of(surface: Surface) -> np.ndarray:
    """Return probes anywhere, then a stroke on which each tick begins near the last."""
    anywhere = probes(surface.texture, surface.max_depth, 400, 5)
    share = np.linspace(0.2, 0.7, 400)[:, None] * np.ones(len(surface.texture.domain.spans))
    xy = surface.texture.domain.points(share)
    stroke = np.column_stack([xy, surface.texture.height(xy) - 0.5 * surface.max_depth])
    return np.ascontiguousarray(np.vstack([anywhere, stroke]))


def test_a_tick_is_the_kernel_s_within_any_budget(
    make_texture: Callable[[str], Texture], tmp_path: Path
) -> None:
    surfaces = {x: Surface(make_texture("map"), x, clamp="backed") for x in "DH"}
    orders = {f"{x}_{looks:g}": (x, looks) for x in surfaces for looks in (FEW, np.inf)}
    headers = {n: header(surfaces[x], n, max_evaluations=looks) for n, (x, looks) in orders.items()}
    made = library(tmp_path, "gcc", headers, "-O1")
    for name, (x, looks) in orders.items():
        at = path_of(surfaces[x])
        found = ticks(made, name, at)
        assert same_bits(found, kernel_ticks(surfaces[x], at, looks)).all(), name
        if looks == np.inf:
            assert not found[:, 3].any()
        else:
            assert 0.0 < (found[:, 3] > 0.0).mean() < 1.0


def test_few_looks_change_the_force_by_at_most_the_gap(
    make_texture: Callable[[str], Texture], tmp_path: Path
) -> None:
    surface = Surface(make_texture("map"), "H", clamp="backed")
    made = library(tmp_path, "gcc", {"t": header(surface, "t", max_evaluations=FEW)}, "-O1")
    at = path_of(surface)
    found = ticks(made, "t", at)
    exact = kernel_ticks(surface, at, np.inf)
    away = np.linalg.norm(found[:, :3] - exact[:, :3], axis=1)
    assert (away <= surface.stiffness * found[:, 3] * (1.0 + 1e-9) + 1e-9).all()
    assert away.max() > 1e-3  # and they do change it


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


def test_a_state_of_zeros_is_a_fresh_one(
    make_texture: Callable[[str], Texture], tmp_path: Path
) -> None:
    """So is one that was told a position beyond all bounds."""
    surface = Surface(make_texture("map"), "H", clamp="backed")
    (tmp_path / "t.h").write_text(header(surface, "t", max_evaluations=FEW))
    (tmp_path / "t.c").write_text(_STATES)
    made = compile_library(tmp_path, "gcc", tmp_path / "t.c")
    at, found = probes(surface.texture, surface.max_depth, 40, 2), np.empty(7)
    for point in np.ascontiguousarray(at):
        made.t_twice(point.ctypes, found.ctypes)
        expected = kernel_ticks(surface, point[None], FEW)[0, :3]
        assert found.tolist() == [*expected, *expected, 0.0]


@pytest.mark.parametrize(
    ("law", "looks", "said"),
    [
        ("B", None, "1.0"), ("B", 50, "1.0"), ("D", None, "600.0"), ("H", None, "1800.0"),
        ("H", 50, "50"), ("E", np.inf, "HUGE_VAL"),
    ],
)  # fmt: skip
def test_the_most_work_is_stated(law: str, looks: float | None, said: str, wave: Texture) -> None:
    text = header(Surface(wave, law), "t", max_evaluations=looks)
    assert re.search(rf"#define T_MAX_EVALUATIONS {re.escape(said)} ", text)


@pytest.mark.parametrize("looks", [0, -1, np.nan, -np.inf])
def test_looks_that_are_none_are_refused(looks: float, wave: Texture) -> None:
    with pytest.raises(ParameterError, match="max_evaluations must be"):
        ExportRequest(Surface(wave, "D"), max_evaluations=looks)
