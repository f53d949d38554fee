"""The certified curl integral with few pieces, where every error term is significant."""

from __future__ import annotations

import math
from itertools import pairwise

import numpy as np
import pytest

from asperity.analysis.energy import curl_columns as columns
from asperity.enclosures.taylor import TaylorModel
from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures.domain import ScanLine
from asperity.textures.kinds.fourier import Fourier
from asperity.textures.kinds.sinusoid import Sinusoid

K, L, D = 1000.0, 2e-3, 0.3e-3
SAW = Fourier([0.1e-3, 0.05e-3], [2 * math.pi / L, 4 * math.pi / L], [0.3, 1.0])
SQUARE = Law(
    "Q",
    "square",
    "vertical",
    lambda c: c.k * c.depth**2 / c.parameter("size") * c.normal,
    parameters={"size": D},
)


def taylor_model(c: float, t: float, d: float, e: float) -> TaylorModel:
    """Return c + t ξ + d η ± e on one piece, with ξ along the line and η down a layer."""
    return TaylorModel(np.array([c]), np.array([[t], [d]]), np.array([e]))


def edge(c: float, t: float) -> TaylorModel:
    return TaylorModel(np.array([c]), np.array([[t]]), np.array([0.0]))


# A curl f(ξ, η), its edges η = ±1, its nearest affine function with error, and the chord error.
CURLS = {
    "t": ((0.0, 1.0), (0.0, 1.0), (0.0, 1.0, 0.0, 0.0), 0.0),
    "d": ((-1.0, 0.0), (1.0, 0.0), (0.0, 0.0, 1.0, 0.0), 0.0),
    "3 + t - 2 d": ((5.0, 1.0), (1.0, 1.0), (3.0, 1.0, -2.0, 0.0), 0.0),
    "d²": ((1.0, 0.0), (1.0, 0.0), (0.5, 0.0, 0.0, 0.5), 1.0),
    "t d": ((0.0, -1.0), (0.0, 1.0), (0.0, 0.0, 0.0, 1.0), 2.0),
    # Deviates by 2/√27 = 0.385 from its chord t d/4, more than the error alone.
    "t (d³ - 3 d/4)": ((0.0, -0.25), (0.0, 0.25), (0.0, 0.0, 0.0, 0.25), 0.5),
}


@pytest.mark.parametrize(("top", "bottom", "inside", "sag"), CURLS.values(), ids=list(CURLS))
def test_chord_error_of_known_curls(
    top: tuple[float, float],
    bottom: tuple[float, float],
    inside: tuple[float, float, float, float],
    sag: float,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(columns, "_curl_model", lambda *_, **__: taylor_model(*inside))
    pieces = SAW.line_segments(SAW.scan_line(), 1)
    alone = type(pieces)(pieces.cells, pieces.centres[:1], pieces.half, pieces.length)
    edges = [edge(*top), edge(*bottom)]
    surface = Surface(SAW, "B", K, D)
    result = columns._chord_error(surface, SAW.scan_line(), alone, columns.Layer(0.0, D), edges)
    assert result[0] == pytest.approx(sag, abs=1e-15)


def dense_signed_integrals(surface: Surface, level_count: int = 400) -> tuple[float, float]:
    """Return ∬curl⁺ and ∬curl⁻ from the Jacobian at the centres of many small cells."""
    line = surface.texture.scan_line()
    x = (np.arange(2000) + 0.5) * line.length / 2000
    xy = line.start + x[:, None] * line.direction
    top, total = surface.law.contact.contact_height(surface.texture, xy), np.zeros(2)
    for part in (np.arange(level_count) + 0.5) / level_count:
        points = np.column_stack([xy, top - part * surface.max_depth])
        curl = columns.plane_curl(surface.jacobian(points), line)
        total += [np.maximum(curl, 0.0).mean(), np.maximum(-curl, 0.0).mean()]
    plus, minus = total * line.length * surface.max_depth / level_count
    return float(plus), float(minus)


@pytest.mark.parametrize("law", ["A", "B", "G", SQUARE], ids=str)
@pytest.mark.parametrize("count", [8, 16, 64])
def test_few_pieces_enclose_the_integral(
    law: str | Law, count: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(columns, "_LAYER_COUNT", 2)
    surface = Surface(SAW, law, K, D)
    line, parts = SAW.scan_line(), columns.depth_layers(surface)
    for sign, exact in zip((1.0, -1.0), dense_signed_integrals(surface), strict=True):
        pieces = SAW.line_segments(line, count)
        low, high = columns._signed_integral_bounds(surface, line, pieces, parts, sign)
        assert 0.0 <= low <= exact * (1 + 1e-5)
        assert exact * (1 - 1e-5) <= high
        if count == 64 and law in ("A", "G"):
            assert high - low < 0.2 * exact


def test_model_error_widens_both_bounds_once(monkeypatch: pytest.MonkeyPatch) -> None:
    """A constant curl of 2 with error 0.5 at one edge and 0.3 at the other gives 2 ± 0.4."""
    models = iter([0.5, 0.3])

    def next_model(*_: object, **__: object) -> TaylorModel:
        return TaylorModel(np.array([2.0]), np.array([[0.0]]), np.array([next(models)]))

    monkeypatch.setattr(columns, "_curl_model", next_model)
    surface, line = Surface(SAW, "B", K, D), SAW.scan_line()
    pieces = SAW.line_segments(line, 1)
    low, high = columns._signed_integral_bounds(surface, line, pieces, [columns.Layer(0.0, D)], 1.0)
    size = K * D * pieces.length
    assert (low / size, high / size) == pytest.approx((1.6, 2.4), rel=1e-11)
    assert low < 1.6 * size * (1 - 1e-13)  # rounded outwards
    assert high > 2.4 * size * (1 + 1e-13)


def test_sign_change_within_a_piece_is_bounded_by_its_ends(monkeypatch: pytest.MonkeyPatch) -> None:
    """For ξ from -1 to 1 the bounds are 0 (centre) and ½ (mean of ends); the exact value is ¼."""
    monkeypatch.setattr(columns, "_curl_model", lambda *_, **__: edge(0.0, 1.0))
    line = SAW.scan_line()
    pieces = SAW.line_segments(line, 1)
    alone = type(pieces)(pieces.cells, pieces.centres[:1], pieces.half, pieces.length)
    parts = [columns.Layer(0.0, D)]
    low, high = columns._signed_integral_bounds(Surface(SAW, "B", K, D), line, alone, parts, 1.0)
    assert (low, high / (K * D * pieces.length)) == (0.0, pytest.approx(0.5, rel=1e-11))


def test_pieces_are_subdivided_until_the_larger_side_converges(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """On one flank the curl of A has one sign; the side near zero does not decide convergence."""
    monkeypatch.setattr(columns, "_MIN_PIECES", 8)
    flank = ScanLine(np.array([-0.25 * L, 0.0]), np.array([1.0, 0.0]), 0.5 * L, periodic=False)
    bounds = columns.curl_integral_bounds(Surface(Sinusoid(1e-4, L), "A", K, D), flank)
    assert bounds is not None
    low, high = max(bounds)
    assert min(bounds)[1] < 1e-3 * high
    assert high - low <= 1e-4 * high


def test_mean_positive_part_of_affine_functions() -> None:
    """∫(α + (γ - α) s)⁺ ds is the mean, zero, or the triangle at the positive end."""
    alpha, gamma = np.array([1.0, -1.0, -1.0, 3.0, 0.0]), np.array([3.0, -2.0, 3.0, -1.0, 0.0])
    expected = [2.0, 0.0, 0.5 * 9 / 4, 0.5 * 9 / 4, 0.0]
    np.testing.assert_allclose(columns._mean_positive_part(alpha, gamma), expected, rtol=1e-15)


def test_depth_layers_are_contiguous_down_to_the_depth() -> None:
    parts = columns.depth_layers(Surface(SAW, SQUARE, K, D), extra_depth=1e-5)
    ends = [parts[0].top, *(layer.bottom for layer in parts)]
    assert all(a < b for a, b in pairwise(ends))
    assert (ends[0], ends[-1]) == (0.0, pytest.approx(D + 1e-5))
    assert columns.depth_layers(Surface(SAW, "C", K, D, clamp="whole"))[0].top == D


def test_curl_integral_of_a_constant_curl() -> None:
    """The curl of k (δ e_x + δ³ e_z/s²) on the smooth wall is -k; J is not affine in δ."""
    law = Law(
        "P",
        "pushed",
        "nominal",
        lambda c: (
            c.k * (c.depth * c.tangential((1, 0)) + c.depth**3 / c.parameter("size") ** 2 * c.e_z)
        ),
        parameters={"size": D},
    )
    surface = Surface(SAW, law, K, D)
    assert not surface.facts.affine_in_depth
    bounds = columns.curl_integral_bounds(surface, SAW.scan_line())
    assert bounds is not None
    np.testing.assert_allclose(bounds, [[0.0, 0.0], [K * L * D, K * L * D]], rtol=1e-9, atol=0.0)
