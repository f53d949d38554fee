"""Stimuli: each is within its limit before it is felt, over the whole range of the level."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.studies.study_texts import COMPARISON, FACTORS, ONSET, SCENE, make_study

import asperity as asp
from asperity.analysis.energy.straight_scan import merit
from asperity.core.errors import ParameterError
from asperity.servo.safety import excess_stiffness_reason
from asperity.studies.live.player import Stimuli, smooth_wall


def test_stimuli_within_their_limits_are_accepted(tmp_path: Path) -> None:
    stimuli = Stimuli(make_study(tmp_path))
    assert stimuli.check_all().surface.stiffness == 61.5
    surface = stimuli.setup({"surface.stiffness": 97.5}).rendered
    assert (surface.stiffness, surface.law.letter) == (97.5, "C")
    setup = stimuli.setup({})
    wall = smooth_wall(setup)
    assert excess_stiffness_reason(wall.rendered, setup.device, keeps_margin=True) == ""
    assert wall.surface.max_depth >= 0.1  # no press on the wall between stimuli is a fault


def test_levels_that_differ_in_the_fifth_digit_are_different_stimuli(tmp_path: Path) -> None:
    stimuli = Stimuli(make_study(tmp_path))
    for stiffness in (61.50001, 61.50002):
        setup = stimuli.setup({"surface.stiffness": stiffness})
        assert setup.surface.stiffness == stiffness


def test_a_stimulus_above_its_limit_is_named_with_the_limit(tmp_path: Path) -> None:
    stimuli = Stimuli(make_study(tmp_path, COMPARISON.replace("97.5 N/m", "900 N/m")))
    message = r"surface\.stiffness = 900 N/m is refused: .* above the recommended .* for law C"
    with pytest.raises(ParameterError, match=message):
        stimuli.check_all()
    with pytest.raises(ParameterError, match="is refused"):
        stimuli.setup({"surface.stiffness": 900.0})


def test_a_law_is_refused_where_another_is_accepted(tmp_path: Path) -> None:
    text = COMPARISON.replace(FACTORS, '\n[vary]\n"surface.law" = ["C", "A"]\n')
    with pytest.raises(ParameterError, match=r"surface\.law = A is refused"):
        Stimuli(make_study(tmp_path, text)).check_all()


def test_the_limit_is_what_compare_recommends(tmp_path: Path) -> None:
    setup = Stimuli(make_study(tmp_path)).setup({})
    device, surface = setup.device, setup.surface
    for row in asp.compare(surface.texture, device, "CDA", stiffness=100.0).rows:
        recommended = row.recommended_stiffness
        same = surface.to_law(row.law).to_stiffness(recommended)
        assert excess_stiffness_reason(same, device, keeps_margin=True) == ""
        above = same.to_stiffness(1.001 * recommended)
        words = f"is above the recommended limit of {recommended:.3g} N/m for law"
        assert words in excess_stiffness_reason(above, device, keeps_margin=True)


def test_the_worst_level_of_a_range_decides(tmp_path: Path) -> None:
    amplitude = ONSET.replace('level = "surface.stiffness"', 'level = "texture.amplitude"')
    amplitude = amplitude.replace('"texture.amplitude" = ["61.5 um", "83.5 um", "97.5 um"]', "")
    narrow = amplitude.replace('["20 N/m", "80 N/m"]', '["1 um", "50 um"]')
    Stimuli(make_study(tmp_path, narrow)).check_all()
    wide = narrow.replace("50 um", "900 um")
    stimuli = Stimuli(make_study(tmp_path, wide))
    stimuli.setup({"texture.amplitude": 1e-6})
    with pytest.raises(ParameterError, match=r"texture\.amplitude = .* is refused"):
        stimuli.check_all()


def test_what_cannot_be_built_is_named(tmp_path: Path) -> None:
    text = COMPARISON.replace('law = "C"\n', "")
    with pytest.raises(
        ParameterError, match=r"stiffness = 61.5 N/m cannot be rendered: law is miss"
    ):
        Stimuli(make_study(tmp_path, text)).check_all()
    hand = COMPARISON + '[hand]\nkind = "moved"\n'
    with pytest.raises(ParameterError, match=r"cannot be rendered: scene needs a section \[motion"):
        Stimuli(make_study(tmp_path, hand)).check_all()
    assert SCENE in COMPARISON


def test_a_real_device_has_its_own_delay_and_resolution(tmp_path: Path) -> None:
    study = make_study(tmp_path)
    setup = Stimuli(study, is_real=True).setup({})
    servo = setup.servo
    assert (servo.delay, servo.position_resolution, servo.force_resolution) == (0, 0.0, 0.0)
    assert setup.safety.lateness is None
    assert Stimuli(study).setup({}).safety.lateness == 60.0


def test_the_stiffness_gives_each_stimulus_the_texture_force(tmp_path: Path) -> None:
    factors = '\n[vary]\n"surface.law" = ["A", "C"]\n"texture.amplitude" = ["20 um", "40 um"]\n'
    text = COMPARISON.replace(FACTORS, factors)
    text = text.replace("[study]\n", '[study]\ntexture_force = "0.4 mN"\n')
    stimuli = Stimuli(make_study(tmp_path, text))
    stimuli.check_all()
    found = [
        stimuli.setup({"surface.law": law, "texture.amplitude": amplitude}).rendered
        for law in "AC"
        for amplitude in (20e-6, 40e-6)
    ]
    assert [merit(one).ripple * one.stiffness for one in found] == pytest.approx([4e-4] * 4)
    assert len({one.stiffness for one in found}) == 4
    strong = text.replace("0.4 mN", "4 N")
    with pytest.raises(ParameterError, match=r"is refused: .* above the recommended"):
        Stimuli(make_study(tmp_path, strong)).check_all()
    smooth = text.replace('["A", "C"]', '["A", "W"]')
    with pytest.raises(ParameterError, match="needs surfaces with a texture force"):
        Stimuli(make_study(tmp_path, smooth)).check_all()
    both = COMPARISON.replace("[study]\n", '[study]\ntexture_force = "0.4 mN"\n')
    with pytest.raises(ParameterError, match="which is varied, too"):
        make_study(tmp_path, both)
