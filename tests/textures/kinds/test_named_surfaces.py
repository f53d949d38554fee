"""Named surfaces: properties common to all, and the characteristic features of each."""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest

import asperity
from asperity.core.errors import ParameterError
from asperity.textures import HeightMap
from asperity.textures.catalogue import CATALOGUE
from asperity.textures.kinds import surface_patches
from asperity.textures.kinds.named_surfaces import (
    LIBRARY,
    NamedSurface,
    named_surface,
    surface_names,
)
from asperity.textures.kinds.noise import low_pass
from asperity.textures.kinds.surface_patches import GRAIN_SIZES

NAMES = ("cloth", "brushed-metal", "sandpaper", "wood", "knurl", "tile")
every_surface = pytest.mark.parametrize("name", NAMES)
SEEDED = [name for name in NAMES if name != "knurl"]


def spectrum(surface: HeightMap) -> np.ndarray:
    """Return the power of every wave (n, m), computed from the heights."""
    return np.abs(np.fft.fft2(surface.heights)) ** 2


def strongest_wave(surface: HeightMap) -> tuple[float, float]:
    """Return the wavelengths along x and y [m] of the strongest wave, inf for none."""
    power = spectrum(surface)
    n, m = np.unravel_index(np.argmax(power), power.shape)
    ny, nx = power.shape
    along_x, along_y = abs(np.fft.fftfreq(nx)[m]), abs(np.fft.fftfreq(ny)[n])
    px, py = surface.pitch
    return (px / along_x if along_x else math.inf, py / along_y if along_y else math.inf)


def rms_slopes(surface: HeightMap) -> tuple[float, float]:
    h, (px, py) = surface.heights, surface.pitch
    return (
        float(np.sqrt(np.mean((np.roll(h, -1, 1) - h) ** 2))) / px,
        float(np.sqrt(np.mean((np.roll(h, -1, 0) - h) ** 2))) / py,
    )


# --- common properties ----------------------------------------------------------------------------


def test_surface_names_and_catalogue():
    assert surface_names() == NAMES
    assert tuple(LIBRARY) == NAMES
    synthetic = {"sinusoid", "fourier", "grating", "noise", "noise-profile"}
    assert set(CATALOGUE) == set(NAMES) | synthetic


@every_surface
def test_heights_are_reproducible(name: str):
    np.testing.assert_array_equal(named_surface(name).heights, named_surface(name).heights)


@pytest.mark.parametrize("name", SEEDED)
def test_another_seed_has_the_same_statistics(name: str):
    first, second = named_surface(name), named_surface(name, seed=1)
    scale = first.heights.std()
    assert np.abs(first.heights - second.heights).max() > 0.1 * scale
    assert second.heights.std() == pytest.approx(scale, rel=0.2)


@every_surface
def test_spectrum_is_zero_beyond_the_cut_off(name: str):
    surface = named_surface(name)
    power = spectrum(surface)
    ny, nx = power.shape
    px, py = surface.pitch
    fx, fy = np.fft.fftfreq(nx, px)[None, :], np.fft.fftfreq(ny, py)[:, None]
    beyond = np.hypot(fx * surface.cutoff[0], fy * surface.cutoff[1]) >= 1.0
    assert beyond.mean() > 0.7
    assert power[beyond].max() < 1e-26 * power.max()
    np.testing.assert_allclose(surface.cutoff, (4 * px, 4 * py))


@every_surface
def test_surface_is_periodic_without_a_seam(name: str):
    """Changes over eight nodes, more than the low-pass, are not greater at the border."""
    surface = named_surface(name)
    assert surface.domain.periodic
    for axis in (0, 1):
        change = np.roll(surface.heights, -8, axis) - surface.heights
        lines = np.sqrt((change**2).mean(axis=1 - axis))
        assert lines[-8:].max() < 1.3 * np.quantile(lines[:-8], 0.99)


@every_surface
def test_number_of_nodes_and_zero_mean(name: str):
    surface = named_surface(name)
    assert min(surface.heights.shape) >= 256
    assert max(surface.heights.shape) <= 512
    assert abs(surface.heights.mean()) < 1e-12 * surface.heights.std()


@every_surface
def test_description_has_every_parameter(name: str):
    surface = named_surface(name)
    description = surface.describe()
    assert description["kind"] == name
    for argument in LIBRARY[name].arguments:
        assert description[argument.name] == argument.default
    assert description["points"] == list(surface.heights.shape[::-1])
    assert "not measured" in description["preparation"][0]


@every_surface
def test_repr_gives_the_same_texture(name: str):
    changed = {} if name == "knurl" else {"seed": 3}
    surface = named_surface(name, **changed)
    rebuilt = eval(repr(surface), {"named_surface": named_surface})
    np.testing.assert_array_equal(rebuilt.heights, surface.heights)


@every_surface
def test_every_argument_is_documented_and_has_an_effect(name: str):
    kind = LIBRARY[name]
    assert kind.summary
    assert kind.source
    assert len(kind.summary) < 60
    plain = named_surface(name)
    for argument in kind.arguments:
        assert argument.description
        value: Any = "P80" if argument.form == "text" else 0.8 * float(argument.default or 0)
        changed = named_surface(name, **{argument.name: 5 if argument.name == "seed" else value})
        same_grid = changed.pitch == plain.pitch
        assert not same_grid or np.abs(changed.heights - plain.heights).max() > 1e-3 * (
            plain.heights.std()
        )


@pytest.mark.parametrize(
    ("name", "lengths"),
    [
        ("cloth", ["spacing", "yarn_thickness"]),
        ("brushed-metal", ["rms", "scratch_width", "scratch_length"]),
        ("wood", ["ring_spacing", "ring_height", "pore_width", "pore_depth"]),
        ("knurl", ["spacing"]),
        ("tile", ["tile_size", "joint_width", "joint_depth", "lippage"]),
    ],
)
def test_scaling_all_lengths_scales_the_surface(name: str, lengths: list[str]):
    plain = named_surface(name)
    doubled = named_surface(name, **{one: 2.0 * plain.parameters[one] for one in lengths})
    np.testing.assert_allclose(doubled.pitch, 2.0 * np.array(plain.pitch))
    np.testing.assert_allclose(
        doubled.heights, 2.0 * plain.heights, atol=1e-9 * plain.heights.std()
    )


@pytest.mark.parametrize("name", ["brushed-metal", "knurl"])
def test_laws_can_be_compared_on_a_named_surface(name: str):
    result = asperity.compare(named_surface(name), laws="WAC")
    numbers = [
        (
            row.q.value,
            row.one_sided.value,
            row.stability_limit.stiffness,
            row.leak.energy,
            row.strength,
        )
        for row in result.rows
    ]
    assert np.isfinite(numbers).all()
    assert result.row("C").q.value > result.row("W").q.value == 1.0
    assert result.row("A").leak.energy > 0.0 == result.row("C").leak.energy
    assert any("not measured" in line for line in result.assumptions)


# --- features of each surface ---------------------------------------------------------------------


@pytest.mark.parametrize("spacing", [0.42e-3, 0.6e-3])
def test_cloth_is_a_plain_weave(spacing: float):
    """At each crossing the upper yarn curves more across than along, in a chequerboard pattern."""
    cloth = named_surface(
        "cloth", spacing=spacing, cover=0.5, yarn_thickness=0.3 * spacing, irregularity=0.0
    )
    np.testing.assert_allclose(cloth.domain.spans, np.diag([8 * spacing] * 2))
    i, j = np.indices((8, 8))
    crossings = np.stack([j, i], -1).reshape(-1, 2) * spacing - 0.5 * cloth.pitch[0]
    hessians = cloth.hessian(crossings)
    upper_along_y = (hessians[:, 0, 0] < 2.0 * hessians[:, 1, 1]).reshape(8, 8)
    upper_along_x = (hessians[:, 1, 1] < 2.0 * hessians[:, 0, 0]).reshape(8, 8)
    chequerboard = (i + j) % 2 == 0
    np.testing.assert_array_equal(upper_along_y, chequerboard == upper_along_y[0, 0])
    np.testing.assert_array_equal(upper_along_x, ~upper_along_y)
    # A crossing is one thickness above the mid-plane, the floor half a thickness below.
    assert 0.85 < cloth.peak_to_valley / (1.5 * 0.3 * spacing) < 1.1


def test_brushed_metal_has_long_scratches_of_the_stated_rms():
    metal = named_surface("brushed-metal", rms=1e-6, seed=2)
    assert metal.heights.std() == pytest.approx(1e-6, rel=1e-12)
    across, along = rms_slopes(metal)
    assert across > 15 * along
    assert 2e-6 < np.ptp(metal.heights) < 12e-6
    # Scratches are cut, so the skewness is negative.
    assert np.mean(metal.heights**3) < -0.2e-18


@pytest.mark.parametrize(
    ("grit", "size"),
    [("P60", 269), ("P80", 201), ("P120", 125), ("P180", 82), ("P240", 58.5), ("P400", 35)],
)
def test_sandpaper_has_the_grain_size_of_its_grade(grit: str, size: float):
    paper = named_surface("sandpaper", grit=grit)
    assert GRAIN_SIZES[grit] == pytest.approx(size * 1e-6)
    assert 0.6 < np.ptp(paper.heights) / (size * 1e-6) < 1.3
    # The autocorrelation falls to one half within about half a grain.
    power = spectrum(paper)
    correlation = np.fft.ifft2(power).real[0]
    half = np.argmax(correlation < 0.5 * correlation[0]) * paper.pitch[0]
    assert 0.3 < half / (size * 1e-6) < 0.6


def test_grit_ignores_case():
    assert named_surface("sandpaper", grit="p80").parameters["grit"] == "P80"


def test_coverage_and_embedding_of_sandpaper():
    dense, sparse = (named_surface("sandpaper", coverage=c).heights for c in (1.2, 0.2))
    # The glue is level and visible where no grain covers it.
    level = [float((np.abs(h - h.min()) < 0.05 * np.ptp(h)).mean()) for h in (dense, sparse)]
    assert level[0] < 0.35
    assert level[1] > 0.6
    deep, shallow = (np.ptp(named_surface("sandpaper", embedding=e).heights) for e in (0.8, 0.3))
    assert deep < 0.7 * shallow


def test_wood_has_rings_and_pores_along_the_grain():
    wood = named_surface("wood")
    across, along = rms_slopes(wood)
    assert across > 5 * along
    assert wood.domain.spans[0, 0] == pytest.approx(4 * 3e-3)
    mean = np.abs(np.fft.rfft(wood.heights.mean(axis=0)))
    assert np.argmax(mean[1:]) + 1 == 4  # four rings across
    smooth = named_surface("wood", pore_depth=0.0)
    mean = np.abs(np.fft.rfft(smooth.heights.mean(axis=0)))
    assert mean[4] > 3.0 * max(mean[3], mean[5])
    assert np.ptp(smooth.heights) < 0.4 * np.ptp(wood.heights)
    # Pores are cut, so valleys are deeper than peaks are high.
    assert -wood.heights.min() > 1.5 * wood.heights.max()


@pytest.mark.parametrize(("spacing", "degrees"), [(1e-3, 30.0), (0.6e-3, 30.0), (1e-3, 45.0)])
def test_knurl_has_grooves_of_the_stated_spacing_and_angle(spacing: float, degrees: float):
    knurl = named_surface("knurl", spacing=spacing, groove_angle=math.radians(degrees))
    along_x, along_y = strongest_wave(knurl)
    angle = math.radians(degrees)
    assert along_x == pytest.approx(spacing / math.cos(angle), rel=1e-9)
    assert along_y == pytest.approx(spacing / math.sin(angle), rel=1e-9)
    # The distance across the grooves follows from the wave vector (1/along_x, 1/along_y).
    assert 1.0 / math.hypot(1 / along_x, 1 / along_y) == pytest.approx(spacing, rel=1e-9)


@pytest.mark.parametrize("profile", [90.0, 120.0])
def test_knurl_flanks_and_depth(profile: float):
    knurl = named_surface("knurl", profile_angle=math.radians(profile))
    flank = 1.0 / math.tan(math.radians(profile / 2))
    xy = np.random.default_rng(1).random((4000, 2)) * knurl.domain.spans.diagonal()
    slopes = np.hypot(*knurl.gradient(xy).T)
    assert np.median(slopes) == pytest.approx(flank, rel=0.01)
    sharp = 0.5 * 0.9 * 1e-3 * flank
    assert 0.93 * sharp < knurl.peak_to_valley < sharp


def test_tile_has_joints_of_the_stated_width_and_depth():
    tile = named_surface("tile", lippage=0.0)
    np.testing.assert_allclose(tile.domain.spans, np.diag([50e-3, 50e-3]))
    low, high = tile.extremes
    assert high - low == pytest.approx(0.8e-3, rel=0.3)
    line = tile.scan_line()
    x = np.linspace(0.0, 50e-3, 5001)
    heights = tile.height(np.column_stack([x, np.full_like(x, line.start[1])]))
    is_joint = heights < heights.max() - 0.5 * 0.8e-3
    assert np.diff(is_joint.astype(int)).clip(0).sum() == 2  # two joints across
    # At half depth, the rounded edges of both tiles widen a joint by 0.13 widths each.
    assert is_joint.mean() * 50e-3 / 2 == pytest.approx(2e-3 * (1 + 2 * 0.9 * 0.134), rel=0.1)


def test_lippage_shifts_whole_tiles():
    flat, uneven = (named_surface("tile", lippage=one) for one in (0.0, 0.2e-3))
    difference = uneven.heights - flat.heights
    assert np.ptp(difference) > 0.1e-3
    middle = difference[200:280, 200:280]
    assert np.ptp(middle) < 1e-9


# --- the low-pass ---------------------------------------------------------------------------------


def test_low_pass_transmission_at_multiples_of_the_cut_off():
    i = np.arange(64)
    for nodes, expected in ((4.0, 0.0), (8.0, 0.5), (16.0, math.cos(math.pi / 8) ** 2)):
        wave = np.cos(2 * np.pi * i / nodes)[None, :] * np.ones((8, 1))
        np.testing.assert_allclose(low_pass(wave), expected * wave, atol=1e-14)
        np.testing.assert_allclose(low_pass(wave.T), expected * wave.T, atol=1e-14)


def test_low_pass_overshoots_a_step_by_less_than_one_percent():
    step = np.where(np.arange(512) < 256, 1.0, 0.0)[None, :] * np.ones((8, 1))
    smooth = low_pass(step)
    assert 1.0 + 1e-4 < smooth.max() < 1.01
    assert smooth.min() == pytest.approx(1.0 - smooth.max(), abs=1e-12)


# --- invalid arguments ----------------------------------------------------------------------------


@pytest.mark.parametrize(("name", "suggestion"), [("clot", "cloth"), ("sand paper", "sandpaper")])
def test_unknown_name_suggests_the_nearest(name: str, suggestion: str):
    with pytest.raises(ParameterError, match=f"did you mean '{suggestion}'"):
        named_surface(name)


def test_names_ignore_case_and_hyphens():
    assert isinstance(named_surface("Brushed_Metal"), NamedSurface)


def test_unknown_parameter_suggests_the_nearest():
    with pytest.raises(
        ParameterError, match=r"yarn_thicknes is unknown.*did you mean 'yarn_thickness'"
    ):
        named_surface("cloth", yarn_thicknes=1e-3)


@pytest.mark.parametrize(
    ("name", "argument", "value"),
    [
        ("sandpaper", "grit", "P90"),
        ("sandpaper", "grit", 120),
        ("sandpaper", "coverage", 0.0),
        ("sandpaper", "seed", -1),
        ("sandpaper", "seed", 0.5),
        ("cloth", "spacing", 0.0),
        ("cloth", "spacing", math.nan),
        ("cloth", "spacing", "1 kg"),
        ("cloth", "cover", 1.2),
        ("cloth", "irregularity", 0.5),
        ("knurl", "groove_angle", 1.5),
        ("knurl", "flat", -0.1),
        ("tile", "joint_width", 30e-3),
        ("tile", "lippage", -1e-6),
        ("wood", "ring_spacing", -1.0),
        ("brushed-metal", "rms", 0.0),
    ],
)
def test_invalid_values_are_refused(name: str, argument: str, value: Any):
    with pytest.raises(ParameterError, match=f"^{argument} ") as caught:
        named_surface(name, **{argument: value})
    assert caught.value.argument == argument
    assert str(value) in str(caught.value)


@every_surface
def test_limits_of_every_argument_give_finite_heights(name: str):
    """At the limits of an argument, heights are finite or a ``ParameterError`` is raised."""
    for argument in LIBRARY[name].arguments:
        if argument.form != "quantity":
            continue
        for value in (argument.minimum, argument.maximum):
            try:
                surface = named_surface(name, **{argument.name: value})
            except ParameterError:
                continue
            assert np.isfinite(surface.heights).all()


def test_grain_ends_within_its_sieve_to_the_sides_too() -> None:
    """A grain covers 1.3 radii around its centre, whatever its facets are."""
    for seed in range(5):
        numbers = np.random.default_rng(seed).random(24)
        numbers[:2] = 0.5
        paper = np.full((surface_patches._PAPER_NODES,) * 2, -np.inf)
        surface_patches._add_grain(paper, numbers)
        reach = 1.3 * 0.5 * (0.75 + 0.5 * numbers[2]) * surface_patches._NODES_PER_GRAIN
        for axis in (0, 1):
            covered = np.flatnonzero(np.isfinite(paper).any(axis=axis)) - 0.5 * len(paper)
            assert reach - 1.0 <= -covered[0] <= reach + 1.0
            assert reach - 1.0 <= covered[-1] <= reach + 1.0
