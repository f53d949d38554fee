"""Exported C in single precision."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.exported import header, library, ticks

from asperity.errors import ParameterError
from asperity.laws import LAWS
from asperity.surface import Surface
from asperity.textures import Texture


def _allowed(surface: Surface, at: np.ndarray, kernel: np.ndarray) -> np.ndarray:
    """Return 1e-5 k max(|h|, |z|), and what one rounding of the position changes (at a ridge)."""
    h = surface.texture.height(np.ascontiguousarray(at[:, :2]))
    scale = np.maximum(np.maximum(np.abs(h), np.abs(at[:, 2])), 0.05 * surface.max_depth)
    moved = np.zeros(len(at))
    if not surface.law.stateful:
        step = 4.0 * np.spacing(np.abs(at).astype(np.float32)).astype(float)
        for axis in range(3):
            for sign in (-1.0, 1.0):
                near = at.copy()
                near[:, axis] += sign * step[:, axis]
                moved = np.maximum(moved, np.abs(surface.force(near) - kernel).max(axis=1))
    return 1e-5 * surface.stiffness * scale + moved


@pytest.mark.parametrize("kind", ["sinusoid", "fourier", "map", "profile"])
def test_close_to_the_kernel(
    kind: str, make_texture: Callable[[str], Texture], tmp_path: Path
) -> None:
    texture = make_texture(kind)
    letters = [x for x in LAWS if x != "H" or kind == "sinusoid"]
    surfaces = {f"t{x}": Surface(texture, x, clamp="backed") for x in letters}
    headers = {name: header(surface, name, "float") for name, surface in surfaces.items()}
    made = library(tmp_path, "gcc", headers, "-O1", "-Wdouble-promotion", single=True)
    rng = np.random.default_rng(8)
    n = 1500
    xy = texture.domain.points(rng.uniform(0.0, 1.0, (n, len(texture.domain.spans))))
    z = texture.height(xy) - rng.uniform(-0.1, 1.5, n) * surfaces["tB"].max_depth
    at = np.column_stack([xy, z]).astype(np.float32)
    for name, surface in surfaces.items():
        exact = at.astype(float)
        kernel = surface.trace(exact)
        error = np.abs(ticks(made, name, at)[:, :3] - kernel).max(axis=1)
        assert (error <= _allowed(surface, exact, kernel)).mean() >= 0.998, name
        assert np.quantile(error, 0.5) < 1e-6 * surface.stiffness * surface.max_depth


def test_float_throughout(make_texture: Callable[[str], Texture]) -> None:
    text = header(Surface(make_texture("map"), "D"), "t", "float")
    code = re.sub(r"/\*.*?\*/", "", text, flags=re.DOTALL).split("typedef struct t_state")[1]
    assert "double" not in code
    assert not re.search(r"\b(sqrt|sin|cos|fabs|copysign)\(", code)
    assert not re.search(r"\d\.\d+(e-?\d+)?(?![\dfe])", code)


def test_what_iterates_to_rounding_is_refused(make_texture: Callable[[str], Texture]) -> None:
    with pytest.raises(ParameterError, match=r"precision must be double: law H .* on this texture"):
        header(Surface(make_texture("map"), "H"), "t", "float")
    assert header(Surface(make_texture("sinusoid"), "H"), "t", "float")
