"""Study files: what is read, and what is refused with the nearest name."""

from __future__ import annotations

from pathlib import Path

import pytest
from tests.studies.study_texts import COMPARISON, HEAD, ONSET, SCENE, make_study

from asperity.core.errors import ParameterError


def test_values_are_read_in_si_units(tmp_path: Path) -> None:
    study = make_study(tmp_path)
    assert dict(study.design.factors) == {"surface.stiffness": (61.5, 83.5, 97.5)}
    assert study.settings["interval"] == 0.2
    assert study.settings["break_every"] == 20
    assert (study.design.seed, study.design.participants) == (1, 12)
    assert study.sections["texture"]["period"] == "2 mm"


def test_a_level_has_the_unit_of_its_key(tmp_path: Path) -> None:
    design = make_study(tmp_path, ONSET).design
    assert design.options["level"] == "surface.stiffness"
    assert list(design.options["range"]) == [20.0, 80.0]
    assert design.factors["texture.amplitude"][0] == pytest.approx(61.5e-6)


def test_a_scene_beside_the_study_becomes_part_of_it(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(SCENE)
    own = COMPARISON.replace(SCENE, "").replace("interval", 'scene = "scene.toml"\ninterval')
    assert make_study(tmp_path, own).content == make_study(tmp_path).content
    with pytest.raises(
        ParameterError, match=r"study.scene is given beside the section \[texture\]"
    ):
        make_study(tmp_path, own + SCENE)


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("[vary]", "[varies]", r"study.toml has an unknown section \[varies\]; .*vary"),
        ("question", "qestion", "study.qestion is unknown; .*question"),
        ('question = "Which one is rougher?"', "", "study.question is missing"),
        ('"comparison"', '"comparisons"', "kind is unknown: 'comparisons'; .*comparison"),
        ("surface.stiffness", "surface.stifness", "no key of the scene: surface.stifness"),
        ("surface.stiffness", "device.update_rate", "device.update_rate cannot change while"),
        ('"61.5 N/m", ', '"83.5 N/m", ', "surface.stiffness names a value twice"),
        ('"61.5 N/m", ', '"61.5 mm", ', "stiffness"),
        ('"61.5 N/m", ', '"-5 N/m", ', "stiffness"),
        ("repeats", "repeat", "method.repeat is unknown; .*repeats"),
        ('"0.2 s"', '"0 s"', "interval must be"),
        (HEAD, "", "study.kind is missing"),
        ("[method]", "[exclusion]\nshortest = 1\n[method]", "exclusion.shortest is unknown"),
    ],
)
def test_mistakes_are_named(tmp_path: Path, old: str, new: str, message: str) -> None:
    assert old in COMPARISON
    with pytest.raises(ParameterError, match=message):
        make_study(tmp_path, COMPARISON.replace(old, new))
