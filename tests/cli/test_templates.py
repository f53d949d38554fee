"""Templates of device files and scenes are valid, and so is every commented line in them."""

from __future__ import annotations

import json
import re
import tomllib
from collections.abc import Callable
from pathlib import Path

import pytest

from asperity.core.arguments import parse_arguments
from asperity.devices import FIELD_UNITS, load_device
from asperity.devices.device_file import device_template
from asperity.scene import load_scene
from asperity.scene.loop_sections import RUN_ARGUMENTS
from asperity.scene.scene_keys import scene_template
from asperity.scene.setup import make_setup

Call = Callable[..., tuple[int, str, str]]
COMMENT = re.compile(r"# (?=[a-z_]+ = )")


def test_device_template_is_a_valid_device_file(call: Call, tmp_path: Path) -> None:
    code, out, err = call("devices", "--template")
    assert (code, err) == (0, "")
    path = tmp_path / "mine.toml"
    path.write_text(out, encoding="utf-8")
    assert load_device(path).data == {}
    assert call("devices", str(path))[0] == 0


def test_every_commented_line_of_the_device_template_is_valid(tmp_path: Path) -> None:
    fields, table = device_template().split("\n# A number may have")
    path = tmp_path / "mine.toml"
    path.write_text("".join(COMMENT.sub("", line) for line in fields.splitlines(keepends=True)))
    device = load_device(path)
    assert set(device.data) == set(FIELD_UNITS)
    assert (device.axes[:2], len(device.notes)) == ("x ", 1)
    lines = [line.removeprefix("# ") for line in table.splitlines()[1:]]
    path.write_text("\n".join(lines))
    test = load_device(path).wall_test
    assert test is not None
    assert (test.value, test.cycled, test.pedigree) == (1800.0, 2000.0, "measured")
    assert (test.directions, test.update_rate, test.positions) == (("x", "z"), 1000.0, "stepped")


def test_device_template_names_every_unit() -> None:
    for name, unit in FIELD_UNITS.items():
        line = next(line for line in device_template().splitlines() if f"# {name} = " in line)
        assert unit == "1" or line.endswith(f"[{unit}]")


def test_template_option_accepts_no_other_arguments(call: Call) -> None:
    for arguments in (["touch"], ["--json", "-"]):
        code, out, err = call("devices", "--template", *arguments)
        assert (code, out) == (2, "")
        assert "accepts no other arguments" in err


def test_scene_template_can_be_simulated(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    code, out, err = call("init", str(path))
    assert (code, err) == (0, "")
    assert f"asperity simulate {path}" in out
    code, out, err = call("simulate", str(path), "--json", "-")
    assert (code, err) == (0, "")
    run = json.loads(out)["run"]
    assert (run["stop_message"] or "", run["too_deep"]) == ("", 0)
    code, out, err = call("limits", str(path), "--json", "-")
    assert (code, json.loads(out)["device"]["id"]) == (0, "touch")


def test_existing_file_is_replaced_only_with_force(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "scene.toml"
    path.write_text("mine")
    code, _out, err = call("init", str(path))
    assert code == 2
    assert "exists" in err
    assert "--force replaces it" in err
    assert path.read_text() == "mine"
    assert call("init", str(path), "--force")[0] == 0
    assert path.read_text(encoding="utf-8") == scene_template("scene.toml")


@pytest.mark.parametrize("name", ["scene.txt", "none/scene.toml", "folder.toml"])
def test_invalid_scene_paths_give_a_one_line_error(call: Call, tmp_path: Path, name: str) -> None:
    (tmp_path / "folder.toml").mkdir()
    code, out, err = call("init", str(tmp_path / name), "--force")
    assert (code, out, err.count("\n")) == (2, "", 1)


LINES = [line for line in scene_template().splitlines() if COMMENT.match(line)]


@pytest.mark.parametrize("line", LINES, ids=lambda line: line[2:20])
def test_every_commented_line_of_the_scene_template_is_valid(tmp_path: Path, line: str) -> None:
    path = tmp_path / "scene.toml"
    path.write_text(scene_template().replace(line, COMMENT.sub("", line)), encoding="utf-8")
    scene = load_scene(str(path))
    assert parse_arguments("run", scene.loop["run"], RUN_ARGUMENTS) is not None
    # A mass has no plane of a five-bar, and no mode without a bandwidth.
    if not line.startswith(("# centre", "# resonance", "# brakes")):
        assert make_setup(scene).device.id == "touch"


def test_scene_template_has_every_section() -> None:
    sections = tomllib.loads(
        "".join(COMMENT.sub("", line + "\n") for line in scene_template().split("\n"))
    )
    assert list(sections) == ["texture", "surface", "device", "hand", "motion", "run", "servo"]
    assert {argument.name for argument in RUN_ARGUMENTS} == set(sections["run"])
    assert len(LINES) > 15
