"""What names a surface on the command line names it in Python too."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import asperity as asp
from asperity.analysis.several import compare_several
from asperity.cli import analyze, compare, limits
from asperity.scene import load_scene
from asperity.textures.naming import as_texture

WAVE = "sinusoid:amplitude=0.2mm,period=2mm"
SAME = asp.Sinusoid(2e-4, 2e-3)


@pytest.fixture
def measured(tmp_path: Path) -> Path:
    x = np.arange(64) * 1e-4
    path = tmp_path / "ridge.txt"
    np.savetxt(path, np.column_stack([x, 1e-5 * np.sin(1000.0 * x)]), header="x [m] z [m]")
    return path


def test_a_texture_is_itself() -> None:
    assert as_texture(SAME) is SAME


def test_a_text_names_a_kind_with_or_without_arguments() -> None:
    assert as_texture(WAVE).describe() == SAME.describe()
    assert as_texture("Sandpaper:grit=P240").describe()["grit"] == "P240"
    plain = as_texture("sandpaper")
    assert plain.describe() == asp.named_surface("sandpaper").describe()


def test_a_text_and_a_path_name_a_file(measured: Path) -> None:
    wanted = asp.load_texture(measured).describe()
    assert as_texture(measured).describe() == wanted
    assert as_texture(str(measured)).describe() == wanted
    assert as_texture(measured, {"magnify": 2.0}).describe() != wanted


def test_a_file_comes_before_a_kind_of_its_name_and_a_path_is_always_a_file(
    measured: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(measured.parent)
    with pytest.raises(asp.SurfaceFileError):
        as_texture(Path("cloth"))
    assert as_texture("cloth").describe()["kind"] == "cloth"
    measured.rename("cloth")
    assert as_texture("cloth").describe() == as_texture(Path("cloth")).describe()
    assert as_texture("cloth").describe()["kind"] == "profile"


@pytest.mark.parametrize(
    ("source", "said"),
    [
        ("sandpapr", "surface is no file, and no surface that is known by name"),
        ("sandpapr:grit=P60", "surface kind is unknown: 'sandpapr'"),
        ("sandpaper:gritt=P60", "gritt is unknown"),
        ("sinusoid:amplitude=1mm", "period is missing"),
        ("sinusoid:amplitude=1,period=1mm", "1mm"),
        ("file", "surface is no file"),
    ],
)
def test_errors_are_those_of_the_command_line(source: str, said: str) -> None:
    with pytest.raises(asp.ParameterError, match=said) as caught:
        asp.compare(source)
    with pytest.raises(asp.ParameterError) as at_the_prompt:
        load_scene(source)
    assert str(caught.value) == str(at_the_prompt.value)


@pytest.mark.parametrize("scene", ["scene.toml", Path("other.TOML")])
def test_a_scene_says_more_than_a_texture(scene: Any) -> None:
    with pytest.raises(asp.ParameterError, match=r"is a scene, .*asperity\.scene\.load_scene"):
        asp.Surface(scene)


@pytest.mark.parametrize("wrong", [None, 3.0, b"sandpaper", ["cloth"], asp.Surface(SAME)])
@pytest.mark.parametrize("takes", [asp.Surface, asp.compare, asp.limits])
def test_another_type_is_refused(takes: Any, wrong: Any) -> None:
    with pytest.raises(asp.ParameterError, match="texture must be a texture, a text such as"):
        takes(wrong)


def test_surfaces_are_made_of_names() -> None:
    point = (0.3e-3, 0.0, 0.0)
    wanted = asp.Surface(SAME, "A").force(point)
    assert np.array_equal(asp.Surface(WAVE, "A").force(point), wanted)
    other = asp.Surface("sinusoid:amplitude=1mm,period=1mm", "A")
    assert not np.array_equal(other.force(point), wanted)
    assert np.array_equal(other.to_texture(WAVE).force(point), wanted)


def test_results_are_those_of_the_texture_that_is_named() -> None:
    for made in (
        lambda texture: asp.compare(texture, laws="WA"),
        lambda texture: compare_several(texture, ["omega.3"], laws="W"),
        lambda texture: asp.limits(texture, law="C"),
        lambda texture: asp.analyze(texture, law="A", stiffness=300.0),
    ):
        assert made(WAVE).to_dict() == made(SAME).to_dict()


@pytest.mark.parametrize("command", [compare, limits, analyze], ids=lambda one: one.__name__)
def test_the_command_line_has_the_same_result(command: Any) -> None:
    name = command.__name__.rpartition(".")[2]
    shown = CliRunner().invoke(command.command, [WAVE, "--json", "-", "--device", "touch"])
    assert shown.exit_code == 0, shown.output
    wanted = json.loads(shown.stdout)
    own = json.loads(json.dumps(getattr(asp, name)(WAVE, "touch").to_dict()))
    assert own == wanted


def test_a_texture_is_analysed_with_the_recommended_law_at_its_start() -> None:
    found = asp.analyze(SAME, "omega.3")
    row = asp.compare(SAME, "omega.3").recommended_row
    assert row is not None
    assert (found.surface.law, found.surface.stiffness) == (row.law, row.start)
    assert asp.analyze(SAME, law="A", stiffness=300.0).surface.stiffness == 300.0


def test_a_surface_has_its_law_already() -> None:
    with pytest.raises(asp.ParameterError, match="law belongs to the surface"):
        asp.analyze(asp.Surface(SAME, "A"), law="C")
    assert asp.analyze(asp.Surface(SAME, "A"), law=None).surface.law.letter == "A"
