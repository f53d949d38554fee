"""A package that declares an entry point is a plugin of every command, without ``--plugin``."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

Call = Callable[..., tuple[int, str, str]]
ROOT = Path(__file__).parents[2]
SURFACE = "sinusoid:amplitude=0.1mm,period=2mm"


def install(folder: Path, package: str, value: str) -> None:
    """Write what an installer writes of a package with an entry point."""
    information = folder / f"{package}-1.0.dist-info"
    information.mkdir()
    (information / "METADATA").write_text(f"Metadata-Version: 2.1\nName: {package}\nVersion: 1.0\n")
    (information / "entry_points.txt").write_text(f"[asperity.plugins]\n{package} = {value}\n")


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Return a folder from which Python imports, with the example of a law in it."""
    shutil.copy(ROOT / "examples" / "own_law.py", tmp_path / "stiffening_law.py")
    monkeypatch.syspath_prepend(str(tmp_path))
    monkeypatch.setattr("asperity.cli.plugins._LOADED_FILES", [])  # those of other tests
    return tmp_path


def test_law_of_an_installed_package_is_known(
    folder: Path, call: Call, read_json: Callable[..., Any]
) -> None:
    code, _out, err = call("analyze", SURFACE, "--law", "S")
    assert code == 2
    assert "'S'" in err
    install(folder, "stiffening", "stiffening_law")
    data = read_json("analyze", SURFACE, "--law", "S", "--set", "reference_depth=0.2mm")
    assert data["law"] == "S"
    assert "reference_depth" in json.dumps(data)


def test_sweep_finds_it_in_its_processes(folder: Path, call: Call) -> None:
    install(folder, "stiffening", "stiffening_law")
    result = folder / "run"
    words = (
        "--laws",
        "S",
        "--vary",
        "surface.stiffness=100N/m,200N/m",
        "--jobs",
        "2",
        "-o",
        str(result),
    )
    code, out, err = call("sweep", SURFACE, *words)
    assert code == 0, (out, err)


def test_plugin_that_fails_is_named_and_the_command_goes_on(folder: Path, call: Call) -> None:
    install(folder, "missing", "no_such_module_here")
    code, out, err = call("analyze", SURFACE, "--law", "C")
    assert code == 0
    assert out
    assert err == (
        "asperity: the installed plugin no_such_module_here fails: ModuleNotFoundError:"
        " No module named 'no_such_module_here'\n"
    )
