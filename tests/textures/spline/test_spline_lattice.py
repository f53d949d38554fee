"""The nodes that a lattice stores are the nearest ones, by exhaustion."""

from __future__ import annotations

import numpy as np
import pytest

from asperity.textures.spline.pyramid import build_lattice
from asperity.textures.spline.spline_texture import HeightMap, Profile

RNG = np.random.default_rng(11)
ROUGH = RNG.normal(size=(14, 17))
SPLINES = {
    "periodic map": HeightMap(6e-5 * ROUGH, (1e-4, 1.3e-4), periodic=True, origin=(1e-4, -2e-4)),
    "profile": Profile(8e-5 * ROUGH.ravel(), 1e-4, origin=2e-4),
}


@pytest.mark.parametrize("name", SPLINES)
def test_each_place_has_the_nearest_node(name: str) -> None:
    spline = SPLINES[name]
    bottom = spline.extremes[0] - 1e-4
    pitches = np.atleast_1d(spline.pitch).tolist()
    levels = np.array([bottom - 3e-3, bottom - 2e-4, *np.arange(bottom, spline.extremes[1], 4e-5)])
    lattice = build_lattice(spline, pitches, (4e-5, 4e-5)[: spline.axes], levels)
    rows, columns = lattice.heights.shape
    i, j = np.indices((rows, columns))
    for _ in range(40):
        m, r, c = (RNG.integers(0, n) for n in lattice.nearest.shape)
        z = levels[m]
        squares = ((j - c * lattice.stride) * lattice.side_x) ** 2
        squares = squares + ((i - r * lattice.stride) * lattice.side_y) ** 2
        squares = squares + np.maximum(lattice.heights - z, 0.0) ** 2
        found = squares.ravel()[lattice.nearest[m, r, c]]
        assert found == pytest.approx(squares.min(), rel=1e-9, abs=1e-20)
    # Negative control: the node straight above is mostly not the nearest.
    places = (i * columns + j)[:: lattice.stride, :: lattice.stride]
    assert (lattice.nearest[2] == places).mean() < 0.5
