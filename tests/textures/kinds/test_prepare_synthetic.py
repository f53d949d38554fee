"""Preparation of synthetic textures: magnify, scale, filter and scan with a tip."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.measured.file_arguments import SYNTHETIC_ARGUMENTS
from asperity.scene import load_scene
from asperity.textures import Fourier, HeightMap, Sinusoid, Texture
from asperity.textures.catalogue import CATALOGUE
from asperity.textures.domain import Domain, ScanLine
from asperity.textures.kinds.prepare_synthetic import prepare_texture

RNG = np.random.default_rng(5)
POINTS = RNG.uniform(-5e-3, 5e-3, (40, 2))


def example(name: str) -> Texture:
    kind = CATALOGUE[name]
    return kind.factory(**kind.example)


@pytest.mark.parametrize("name", [*CATALOGUE])
def test_every_kind_is_magnified(name: str) -> None:
    """h'(x) = b h(x/a), computed from the parameters of the kind, not from samples."""
    texture = example(name)
    larger = prepare_texture(texture, magnify=3.0, magnify_height=2.0)
    np.testing.assert_allclose(
        larger.height(3.0 * POINTS), 2.0 * texture.height(POINTS), atol=1e-12, rtol=1e-9
    )
    assert larger.peak_to_valley == pytest.approx(2.0 * texture.peak_to_valley, rel=1e-9)
    assert larger.preparation[-1] == "magnified 3 times laterally and 2 times in height"
    other = 2.001 * texture.height(POINTS)
    assert not np.allclose(larger.height(3.0 * POINTS), other, atol=1e-12, rtol=1e-9)


@pytest.mark.parametrize("name", ["sinusoid", "cloth", "grating"])
def test_heights_are_scaled_to_a_range(name: str) -> None:
    scaled = prepare_texture(example(name), height_range=0.123e-3)
    assert scaled.peak_to_valley == pytest.approx(0.123e-3, rel=1e-9)


def transfer(cutoff: float, length: float) -> float:
    """Return the transmission of ISO 16610-21, one half at the cut-off."""
    return float(0.5 ** ((cutoff / length) ** 2))


def test_amplitudes_are_multiplied_by_the_filter_transfer() -> None:
    texture = Fourier(
        [3e-4, -2e-4], 2 * np.pi / 1e-3 * np.array([[0.6, 0.8], [0.0, 3.0]]), [0.3, 1]
    )
    filtered = prepare_texture(texture, s_cutoff=0.5e-3, l_cutoff=2e-3, magnify=2.0)
    assert isinstance(filtered, Fourier)
    lengths = np.array([1e-3, 1e-3 / 3.0])
    expected = [transfer(0.5e-3, length) * (1 - transfer(2e-3, length)) for length in lengths]
    np.testing.assert_allclose(filtered.amplitudes, 2 * texture.amplitudes * expected, rtol=1e-12)
    np.testing.assert_allclose(filtered.wavevectors, texture.wavevectors / 2.0)
    np.testing.assert_array_equal(filtered.phases, texture.phases)


def test_filtered_sinusoid_is_a_sinusoid() -> None:
    texture = Sinusoid(1e-3, 2e-3, 0.7, (3.0, 4.0))
    filtered = prepare_texture(texture, s_cutoff=2e-3, magnify=1.5)
    assert isinstance(filtered, Sinusoid)
    assert filtered.amplitude == pytest.approx(0.75e-3, rel=1e-12)
    assert (filtered.period, filtered.phase, filtered.direction) == (3e-3, 0.7, (0.6, 0.8))
    assert texture.amplitude == 1e-3
    assert texture.preparation == ()


def test_periodic_map_is_filtered_across_its_border() -> None:
    wave = 1e-4 * np.cos(2 * np.pi * (np.arange(64) + 3) / 64)
    texture = HeightMap(np.tile(wave, (8, 1)), 1e-5, periodic=True)
    filtered = prepare_texture(texture, s_cutoff=0.64e-3 * 0.9)
    assert isinstance(filtered, HeightMap)
    np.testing.assert_allclose(filtered.heights, transfer(0.9, 1.0) * texture.heights, atol=1e-16)
    finite = HeightMap(texture.heights, 1e-5)
    mirrored = prepare_texture(finite, s_cutoff=0.64e-3 * 0.9)
    assert isinstance(mirrored, HeightMap)
    assert not np.allclose(mirrored.heights, filtered.heights, atol=1e-6)


class Hill(Texture):
    """A user-defined texture with only the abstract members and the sampler of a sinusoid."""

    kind = "hill"
    wave = Sinusoid(1e-4, 2e-3)
    sampler = wave.sampler
    arguments = wave.arguments
    extremes = (-1e-4, 1e-4)
    bounds = wave.bounds
    domain = Domain(np.zeros(2), 2e-3 * np.eye(1, 2), periodic=True, description="one period")

    def scan_line(self) -> ScanLine:
        return self.wave.scan_line()

    def describe(self) -> dict[str, object]:
        return {"kind": self.kind}


def test_texture_without_optional_members_is_sampled() -> None:
    prepared = prepare_texture(Hill(), magnify=2.0, s_cutoff=2e-3)
    np.testing.assert_allclose(
        prepared.height(2.0 * POINTS), Hill.wave.height(POINTS), atol=1e-9, rtol=1e-6
    )


BAD = [
    ("sinusoid:amplitude=1mm,period=1mm", {"form": 2}, "form applies to measured surfaces only"),
    ("knurl", {"outliers": 6.0}, "others take height_range, s_cutoff, l_cutoff, tip_radius"),
    ("knurl", {"magnify": 0.0}, "magnify must be positive"),
    ("knurl", {"s_cutoff": 1.0}, "s_cutoff must be at most"),
    ("sinusoid:amplitude=1mm,period=1mm", {"s_cutoff": -1.0}, "s_cutoff must be positive"),
    ("sinusoid:amplitude=1mm,period=1mm,magnify=2mm", {}, "magnify must be a number"),
    ("sinusoid:amplitude=1mm,period=1mm,s_cutoff=2", {}, "s_cutoff needs a unit"),
    ("sinusoid:amplitude=1mm,period=1mm,outliers=2", {}, "sinusoid.outliers is unknown"),
]


@pytest.mark.parametrize(("source", "values", "message"), BAD)
def test_invalid_preparations_are_errors(
    source: str, values: dict[str, float], message: str
) -> None:
    with pytest.raises(ParameterError, match=message):
        load_scene(source, values)


def test_specifications_scenes_and_options_agree(tmp_path: Path) -> None:
    expected = load_scene("knurl").texture.peak_to_valley * 2.5
    scene = tmp_path / "scene.toml"
    scene.write_text('[texture]\nkind = "knurl"\nmagnify = 2.5\nl_cutoff = "3 mm"\n')
    scenes = [
        load_scene("knurl:magnify=2.5,l_cutoff=3mm"),
        load_scene("knurl:l_cutoff=3mm", {"magnify": 2.5}),
        load_scene(str(scene)),
        load_scene(str(scene), {"l_cutoff": 3e-3}),
    ]
    heights = [one.texture.height(POINTS) for one in scenes]
    for other in heights[1:]:
        np.testing.assert_array_equal(other, heights[0])
    assert load_scene("knurl", {"magnify": 2.5}).texture.peak_to_valley == pytest.approx(expected)


def test_texture_argument_precedes_a_preparation_of_the_same_name() -> None:
    """``cutoff`` of noise is its shortest wave; ``s_cutoff`` is a filter."""
    unfiltered = load_scene("noise:rms=20um,size=5mm,cutoff=0.5mm").texture
    assert not any("filtered" in step for step in unfiltered.preparation)
    filtered = load_scene("noise:rms=20um,size=5mm", {"s_cutoff": 0.5e-3}).texture
    assert any("filtered" in step for step in filtered.preparation)


def test_a_scene_may_trace_a_texture_by_a_tip() -> None:
    scene = load_scene("sinusoid:amplitude=0.1mm,period=1mm", {"tip_radius": 1e-3})
    assert "tip of radius 1 mm" in scene.texture.preparation[-1]
    assert scene.texture.peak_to_valley < 0.15e-3


def test_preparation_arguments_are_declared() -> None:
    names = list(prepare_texture.__annotations__)[1:-1]
    assert names == [argument.name for argument in SYNTHETIC_ARGUMENTS]
    assert math.isclose(transfer(1.0, 1.0), 0.5)


_TURNS = 2.0 * math.pi * np.arange(100) / 100.0
SMOOTH_MAP = 3e-5 * (np.sin(_TURNS) + 0.5 * np.cos(2.0 * _TURNS[:, None] + 0.3))


def traced_by_definition(texture: Texture, radius: float, x: float, y: float) -> float:
    """Return max over |u| < R of h(x + u) + sqrt(R² - |u|²) - R on a dense grid."""
    reach = min(radius, math.sqrt(2.0 * radius * texture.peak_to_valley))
    steps = np.linspace(-reach, reach, 1001)
    u, v = np.meshgrid(steps, [0.0] if texture.is_profile else steps)
    left = radius**2 - u**2 - v**2
    inside = left > 0.0
    points = np.column_stack([x + u[inside], y + v[inside]])
    return float((texture.height(points) + np.sqrt(left[inside]) - radius).max())


@pytest.mark.parametrize("radius", [0.1e-3, 0.5e-3, 2e-3])
@pytest.mark.parametrize(
    "texture",
    [
        Sinusoid(4e-4, 1.5e-3, phase=0.4),
        Fourier([1e-4, 5e-5], [[3000.0, 0.0], [0.0, 4000.0]], [0.2, 0.9]),
        HeightMap(SMOOTH_MAP, (1e-5, 1e-5), periodic=True),
    ],
)
def test_a_ball_traces_every_texture(texture: Texture, radius: float) -> None:
    """Also balls larger than a period, and around the seam of a surface that repeats."""
    if not texture.is_profile:
        radius *= 0.25
    traced = prepare_texture(texture, tip_radius=radius)
    assert traced.domain.periodic
    assert "felt with a tip of radius" in traced.preparation[-1]
    tolerance = 2e-3 * texture.peak_to_valley
    if isinstance(texture, HeightMap):
        tolerance *= 4.0  # the ball touches nodes, which are 10 µm apart
    for x, y in ((1e-5, 2e-5), (7e-4, 5e-4), (1.45e-3, 1.9e-3)):
        expected = traced_by_definition(texture, radius, x, y)
        assert traced.height(np.array([[x, y]]))[0] == pytest.approx(expected, abs=tolerance)
    assert traced.peak_to_valley <= texture.peak_to_valley * (1.0 + 1e-3)


def test_a_tip_comes_before_magnification_and_larger_than_a_finite_surface_is_refused() -> None:
    wave = Sinusoid(4e-4, 1.5e-3)
    once = prepare_texture(wave, tip_radius=0.5e-3)
    larger = prepare_texture(wave, tip_radius=0.5e-3, magnify=2.0)
    assert larger.peak_to_valley == pytest.approx(2.0 * once.peak_to_valley)
    assert once.peak_to_valley < 0.8 * wave.peak_to_valley
    small = HeightMap(1e-5 * RNG.random((20, 20)), (1e-5, 1e-5))
    with pytest.raises(ParameterError, match="tip_radius must be at most"):
        prepare_texture(small, tip_radius=1e-3)
    with pytest.raises(ParameterError, match="tip_radius must be positive"):
        prepare_texture(wave, tip_radius=0.0)
