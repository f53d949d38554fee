"""What a comparison states of laws with friction."""

from __future__ import annotations

from asperity import compare
from asperity.textures import Sinusoid

WAVE = Sinusoid(1e-4, 1e-3)


def test_wall_with_modulated_friction_is_recommended_as_a_texture() -> None:
    result = compare(WAVE, "touch", laws="W", friction=0.72, friction_modulation=0.889)
    row = result.recommended_row
    assert row is not None
    assert not row.is_textureless
    assert row.tier == "felt"
    assert row.conservative
    assert row.holds_at_any_press
    assert "law W (smooth wall) with modulated friction 0.72" in result.recommendation
    assert "no texture" not in row.verdict


def test_wall_with_constant_friction_renders_no_texture() -> None:
    result = compare(WAVE, "touch", laws="W", friction=0.72)
    assert result.recommended_row is None
    assert result.rows[0].is_textureless
    assert "None of the laws compared renders a texture" in result.recommendation


def test_mended_form_of_law_f_is_named() -> None:
    result = compare(WAVE, "touch", laws="WF")
    mended = "law W with friction 0.72 and friction modulation 0.889"
    assert [line for line in result.assumptions if mended in line]
    alone = compare(WAVE, "touch", laws="W")
    assert not [line for line in alone.assumptions if mended in line]


def test_presliding_stiffness_beyond_the_device_is_named() -> None:
    row = compare(WAVE, "touch", laws="W", friction=0.4, presliding_stiffness=1e9).rows[0]
    assert "no stable stiffness is known with a presliding stiffness of" in row.verdict
