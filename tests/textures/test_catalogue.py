"""Texture specifications mean the same in Python as on the command line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import asperity as asp
from asperity.analysis.compare import compare_devices
from asperity.cli.analysis_commands import analyze_command, compare_command, limits_command
from asperity.scene import load_scene
from asperity.textures.catalogue import as_texture

WAVE = "sinusoid:amplitude=0.2mm,period=2mm"
SAME = asp.Sinusoid(2e-4, 2e-3)


@pytest.fixture
def measured(tmp_path: Path) -> Path:
    x = np.arange(64) * 1e-4
    path = tmp_path / "ridge.txt"
    np.savetxt(path, np.column_stack([x, 1e-5 * np.sin(1000.0 * x)]), header="x [m] z [m]")
    return path


def test_a_texture_is_returned_unchanged() -> None:
    assert as_texture(SAME) is SAME


def test_a_specification_with_or_without_arguments() -> None:
    assert as_texture(WAVE).describe() == SAME.describe()
    assert as_texture("Sandpaper:grit=P240").describe()["grit"] == "P240"
    plain = as_texture("sandpaper")
    assert plain.describe() == asp.named_surface("sandpaper").describe()


def test_a_file_from_a_text_or_a_path(measured: Path) -> None:
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
    ("source", "message"),
    [
        ("sandpapr", "surface is neither a file nor a named surface"),
        ("sandpapr:grit=P60", "surface kind is unknown: 'sandpapr'"),
        ("sandpaper:gritt=P60", "gritt is unknown"),
        ("sinusoid:amplitude=1mm", "period is missing"),
        ("sinusoid:amplitude=1,period=1mm", "1mm"),
        ("file", "surface is neither a file"),
    ],
)
def test_errors_are_those_of_the_command_line(source: str, message: str) -> None:
    with pytest.raises(asp.ParameterError, match=message) as caught:
        asp.compare(source)
    with pytest.raises(asp.ParameterError) as at_the_prompt:
        load_scene(source)
    assert str(caught.value) == str(at_the_prompt.value)


@pytest.mark.parametrize("scene", ["scene.toml", Path("other.TOML")])
def test_a_scene_is_not_a_texture(scene: Any) -> None:
    with pytest.raises(asp.ParameterError, match=r"is a scene, .*asperity\.scene\.load_scene"):
        asp.Surface(scene)


@pytest.mark.parametrize("wrong", [None, 3.0, b"sandpaper", ["cloth"], asp.Surface(SAME)])
@pytest.mark.parametrize("takes", [asp.Surface, asp.compare, asp.limits])
def test_another_type_is_refused(takes: Any, wrong: Any) -> None:
    with pytest.raises(asp.ParameterError, match="texture must be a texture, a text such as"):
        takes(wrong)


def test_a_surface_from_a_specification() -> None:
    point = (0.3e-3, 0.0, 0.0)
    wanted = asp.Surface(SAME, "A").force(point)
    assert np.array_equal(asp.Surface(WAVE, "A").force(point), wanted)
    other = asp.Surface("sinusoid:amplitude=1mm,period=1mm", "A")
    assert not np.array_equal(other.force(point), wanted)
    assert np.array_equal(other.to_texture(WAVE).force(point), wanted)


def test_results_of_a_specification_are_those_of_the_texture() -> None:
    for made in (
        lambda texture: asp.compare(texture, laws="WA"),
        lambda texture: compare_devices(texture, ["omega.3"], laws="W"),
        lambda texture: asp.limits(texture, law="C"),
        lambda texture: asp.analyze(texture, law="A", stiffness=300.0),
    ):
        assert made(WAVE).to_dict() == made(SAME).to_dict()


COMMANDS = {"compare": compare_command, "limits": limits_command, "analyze": analyze_command}


@pytest.mark.parametrize("name", COMMANDS)
def test_the_command_line_has_the_same_result(name: str) -> None:
    shown = CliRunner().invoke(COMMANDS[name], [WAVE, "--json", "-", "--device", "touch"])
    assert shown.exit_code == 0, shown.output
    wanted = json.loads(shown.stdout)
    own = json.loads(json.dumps(getattr(asp, name)(WAVE, "touch").to_dict()))
    assert own == wanted


def test_a_texture_is_analyzed_with_the_recommended_law_and_stiffness() -> None:
    found = asp.analyze(SAME, "omega.3")
    row = asp.compare(SAME, "omega.3").recommended_row
    assert row is not None
    assert (found.surface.law, found.surface.stiffness) == (row.law, row.recommended_stiffness)
    assert asp.analyze(SAME, law="A", stiffness=300.0).surface.stiffness == 300.0


def test_a_law_cannot_be_given_for_a_surface() -> None:
    with pytest.raises(asp.ParameterError, match="law belongs to the surface"):
        asp.analyze(asp.Surface(SAME, "A"), law="C")
    assert asp.analyze(asp.Surface(SAME, "A"), law=None).surface.law.letter == "A"
