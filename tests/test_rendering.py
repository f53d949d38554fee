"""How laws are rendered: closed forms, baked fields, and searches with a budget."""

from __future__ import annotations

import dataclasses
from pathlib import Path

import numpy as np
import pytest
from bench.stress import friction as friction_stress

from asperity.analysis.passivity.recommended_stiffness import render_on_device
from asperity.analysis.results.analyze import analyze
from asperity.analysis.results.compare import compare
from asperity.contacts.contact_kinds import SplitContact
from asperity.core.errors import ParameterError
from asperity.core.units import parse_quantity
from asperity.devices import load_device
from asperity.kernels.link import unit_from_module
from asperity.laws import LAWS
from asperity.rendering import (
    assess_rendering,
    bake,
    bake_mesh,
    coarsened_surface,
    default_reach,
    is_searched,
    rendered_surface,
    rendering_sentences,
)
from asperity.surface import Surface
from asperity.textures.kinds.fourier import Fourier
from asperity.textures.kinds.sinusoid import Sinusoid
from asperity.textures.spline.spline_texture import HeightMap, Profile

ROUGH = HeightMap(4e-5 * np.random.default_rng(2).normal(size=(8, 9)), (1e-4, 1e-4), periodic=True)
MILD = HeightMap(1e-5 * np.random.default_rng(2).normal(size=(4, 5)), (1e-4, 1e-4), periodic=True)
LINE = Profile(1e-5 * np.random.default_rng(2).normal(size=5), 1e-4)
ENDLESS = Fourier([5e-5, 4e-5], [[6000.0, 0.0], [6000.0 * 2**0.5, 0.0]])
WAVE = Sinusoid(0.2e-3, 1e-3)


def test_closed_form_and_searched_laws_are_told_apart() -> None:
    assert is_searched(Surface(ROUGH, "H"))
    assert not is_searched(Surface(WAVE, "H"))
    assert not is_searched(Surface(ROUGH, "D"))
    assert not is_searched(bake(Surface(ROUGH, "H"), 2e-5))


@pytest.mark.parametrize("texture", [ROUGH, ENDLESS, WAVE, "field"])
def test_flag_of_a_kind_agrees_with_its_sampler(texture: object) -> None:
    one = bake(Surface(ROUGH, "H"), 3e-5).texture if texture == "field" else texture
    units = [unit_from_module(module) for module in one.sampler]
    assert one.finds_contacts == any("split_contact" in unit.sources for unit in units)


def test_rendered_surface_is_baked_unless_a_search_is_asked_for() -> None:
    surface = Surface(MILD, "H", 700.0, max_depth=3e-5)
    rendered = rendered_surface(surface)
    assert rendered.texture.baked_numbers
    assert (rendered.stiffness, rendered.max_depth) == (700.0, 3e-5)
    assert rendered_surface(surface, "search") is surface
    for other in (Surface(ROUGH, "C"), Surface(WAVE, "H"), Surface(ENDLESS, "H")):
        assert rendered_surface(other) is other
    with pytest.raises(ParameterError, match="rendering"):
        rendered_surface(surface, "exact")


def test_field_is_as_deep_as_people_press() -> None:
    surface = Surface(LINE, "H", 1000.0, max_depth=3e-5)
    assert rendered_surface(surface).texture.max_depth == default_reach(1000.0) == 5e-3
    assert rendered_surface(surface.to_stiffness(50.0)).texture.max_depth == 25e-3
    assert rendered_surface(surface, reach=2e-3).texture.max_depth == 2e-3
    assert rendered_surface(surface, reach=1e-5).texture.max_depth == 3e-5
    assert bake(surface, press=2.0).texture.max_depth == 2e-3


@pytest.mark.parametrize(("device", "force"), [("omega.3", 5.0), ("touch", 3.3)])
def test_another_stiffness_has_the_same_field_and_its_own_forces(device: str, force: float) -> None:
    soft = Surface(LINE, "H", 100.0, max_depth=3e-5)
    one, other = (
        render_on_device(surface, load_device(device), "field")
        for surface in (soft, soft.to_stiffness(700.0))
    )
    assert one.texture.digest == other.texture.digest
    (row,) = compare(LINE, device, laws="H", max_depth=3e-5).rows
    assert row.surface.texture.digest == one.texture.digest
    # The recommended start reaches the force, and no more than is due to its rounding.
    assert force <= row.recommended_stiffness * one.texture.max_depth < 1.2 * force
    forces = []
    for surface in (one, other):
        words = rendering_sentences(surface)[1].split()
        forces.append(parse_quantity("press", " ".join(words[-2:]), "N"))
    assert forces[1] == pytest.approx(7.0 * forces[0], rel=0.02)


def test_part_of_an_endless_texture_is_baked_and_mirrored_at_its_border() -> None:
    surface = Surface(ENDLESS, "H", 1.0, max_depth=5e-5)
    baked = rendered_surface(surface, extent=(2e-3, 1.5e-3))
    probes = np.array([[0.9e-3, 0.7e-3, -2e-5], [1.3e-3, 0.4e-3, -6e-5]])
    share = np.linalg.norm(baked.force(probes) - surface.force(probes), axis=1)
    assert (share < 0.25 * np.linalg.norm(surface.force(probes), axis=1)).all()
    mirrored = probes * [-1.0, 1.0, 1.0]
    expected = baked.force(probes) * [-1.0, 1.0, 1.0]
    np.testing.assert_allclose(baked.force(mirrored), expected, atol=1e-18)
    for extent in [(1e-3,), (0.0, 1e-3)]:
        with pytest.raises(ParameterError, match="extent"):
            bake(surface, extent=extent)


def test_numbers_of_a_comparison_are_those_of_the_field() -> None:
    (row,) = compare(MILD, laws="H", max_depth=3e-5).rows
    field = row.surface.texture
    assert row.q.upper == field.gain.upper > 1.0
    assert row.rendering.method == "field"
    assert row.to_dict()["rendering"]["method"] == "field"
    (searched,) = compare(MILD, laws="H", max_depth=3e-5, rendering="search").rows
    assert (searched.q.upper, searched.rendering.method) == (1.0, "search")
    result = analyze(MILD, law="H", max_depth=3e-5, stiffness=500.0)
    assert result.q.upper == field.gain.upper
    assert "baked as a potential field" in " ".join(result.assumptions)
    assert "At 500 N/m its error is known for presses of" in " ".join(result.assumptions)


def test_comparison_of_a_field_has_one_row() -> None:
    field = bake(Surface(ROUGH, "H", max_depth=1e-4), 2e-5).texture
    assert [row.law.letter for row in compare(field).rows] == ["H"]
    with pytest.raises(ParameterError, match="must be H"):
        compare(field, laws="HA")


def test_search_is_tried_on_a_stroke(monkeypatch: pytest.MonkeyPatch) -> None:
    surface = Surface(ROUGH, "H", max_depth=1e-4)
    complete = assess_rendering(surface, 0.05, 4000.0)
    assert (complete.method, complete.samples > 1000, complete.truncated) == ("search", True, 0)
    assert "complete in all" in complete.sentence(LAWS["H"])
    # With a small budget the same search is truncated, and the rows say so.
    monkeypatch.setattr(SplitContact, "max_evaluations", 40.0)
    monkeypatch.setattr("asperity.rendering.get_or_compute", lambda _name, _key, compute: compute())
    truncated = assess_rendering(surface, 0.05, 4000.0)
    assert truncated.truncated > 10
    assert truncated.error_bound > 0.0
    assert "was truncated in" in truncated.sentence(LAWS["H"])
    (row,) = compare(ROUGH, laws="H", max_depth=1e-4, rendering="search").rows
    assert "search truncated in" in row.verdict
    assert "search" not in dataclasses.replace(row, rendering=complete).verdict


@pytest.mark.parametrize("law", ["W", "A", "C", "F", "G"])
def test_formulas_are_not_searched(law: str) -> None:
    assert assess_rendering(Surface(ROUGH, law)).method == "formula"
    assert assess_rendering(Surface(ROUGH, law)).sentence(LAWS[law]) == ""


def test_field_of_a_body_is_not_baked_again_as_a_wall(tmp_path: Path) -> None:
    """It has no mesh, and the heights of its source are those of another surface."""
    body = bake_mesh(friction_stress.cube(tmp_path), "m", 3e-4, 2e-4)
    assert coarsened_surface(body, 0.5) is None
