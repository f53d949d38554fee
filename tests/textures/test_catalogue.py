"""Texture specifications have the same meaning in Python and on the command line."""

from __future__ import annotations

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from click.testing import CliRunner

import asperity as asp
from asperity.analysis.results.device_comparisons import compare_devices
from asperity.cli.analysis_commands import analyze_command, compare_command, limits_command
from asperity.scene import load_scene
from asperity.textures.catalogue import as_texture

WAVE = "sinusoid:amplitude=0.2mm,period=2mm"
SINUSOID = asp.Sinusoid(2e-4, 2e-3)


@pytest.fixture
def measured(tmp_path: Path) -> Path:
    x = np.arange(64) * 1e-4
    path = tmp_path / "ridge.txt"
    np.savetxt(path, np.column_stack([x, 1e-5 * np.sin(1000.0 * x)]), header="x [m] z [m]")
    return path


def test_texture_is_returned_unchanged() -> None:
    assert as_texture(SINUSOID) is SINUSOID


def test_specification_with_and_without_arguments() -> None:
    assert as_texture(WAVE).describe() == SINUSOID.describe()
    assert as_texture("Sandpaper:grit=P240").describe()["grit"] == "P240"
    plain = as_texture("sandpaper")
    assert plain.describe() == asp.named_surface("sandpaper").describe()


def test_file_is_given_by_text_or_path(measured: Path) -> None:
    expected = asp.load_texture(measured).describe()
    assert as_texture(measured).describe() == expected
    assert as_texture(str(measured)).describe() == expected
    assert as_texture(measured, {"magnify": 2.0}).describe() != expected


def test_existing_file_precedes_a_kind_and_a_path_is_always_a_file(
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
def test_errors_are_the_same_as_on_the_command_line(source: str, message: str) -> None:
    with pytest.raises(asp.ParameterError, match=message) as caught:
        asp.compare(source)
    with pytest.raises(asp.ParameterError) as from_scene:
        load_scene(source)
    assert str(caught.value) == str(from_scene.value)


@pytest.mark.parametrize("scene", ["scene.toml", Path("other.TOML")])
def test_scene_file_is_refused_as_a_texture(scene: Any) -> None:
    with pytest.raises(asp.ParameterError, match=r"is a scene, .*asperity\.scene\.load_scene"):
        asp.Surface(scene)


@pytest.mark.parametrize("texture", [None, 3.0, "", b"sandpaper", ["cloth"], asp.Surface(SINUSOID)])
@pytest.mark.parametrize("function", [asp.Surface, asp.compare, asp.limits])
def test_other_types_are_refused(function: Any, texture: Any) -> None:
    with pytest.raises(asp.ParameterError, match="texture must be a texture, a text such as"):
        function(texture)


def test_surface_is_made_from_a_specification() -> None:
    point = (0.3e-3, 0.0, 0.0)
    expected = asp.Surface(SINUSOID, "A").force(point)
    assert np.array_equal(asp.Surface(WAVE, "A").force(point), expected)
    other = asp.Surface("sinusoid:amplitude=1mm,period=1mm", "A")
    assert not np.array_equal(other.force(point), expected)
    assert np.array_equal(other.to_texture(WAVE).force(point), expected)


def test_specification_and_texture_give_the_same_results() -> None:
    for compute in (
        lambda texture: asp.compare(texture, laws="WA"),
        lambda texture: compare_devices(texture, ["omega.3"], laws="W"),
        lambda texture: asp.limits(texture, law="C"),
        lambda texture: asp.analyze(texture, law="A", stiffness=300.0),
    ):
        assert compute(WAVE).to_dict() == compute(SINUSOID).to_dict()


COMMANDS = {"compare": compare_command, "limits": limits_command, "analyze": analyze_command}


@pytest.mark.parametrize("name", COMMANDS)
def test_command_line_gives_the_same_result(name: str) -> None:
    invocation = CliRunner().invoke(COMMANDS[name], [WAVE, "--json", "-", "--device", "touch"])
    assert invocation.exit_code == 0, invocation.output
    expected = json.loads(invocation.stdout)
    result = json.loads(json.dumps(getattr(asp, name)(WAVE, "touch").to_dict()))
    assert result == expected


def test_texture_is_analyzed_with_the_recommended_law_and_stiffness() -> None:
    analysis = asp.analyze(SINUSOID, "omega.3")
    row = asp.compare(SINUSOID, "omega.3").recommended_row
    assert row is not None
    assert (analysis.surface.law, analysis.surface.stiffness) == (
        row.law,
        row.recommended_stiffness,
    )
    assert asp.analyze(SINUSOID, law="A", stiffness=300.0).surface.stiffness == 300.0


def test_law_is_refused_for_a_surface() -> None:
    with pytest.raises(asp.ParameterError, match="law belongs to the surface"):
        asp.analyze(asp.Surface(SINUSOID, "A"), law="C")
    assert asp.analyze(asp.Surface(SINUSOID, "A"), law=None).surface.law.letter == "A"
