"""``asperity export --lang unity``: the folder that it writes, and its errors."""

from __future__ import annotations

import json
import shutil
from collections.abc import Callable
from pathlib import Path

import pytest

from asperity.export import targets

Call = Callable[..., tuple[int, str, str]]
WAVE = "sinusoid:amplitude=0.1mm,period=2mm"


def test_command_writes_what_is_dropped_into_assets(call: Call, tmp_path: Path) -> None:
    folder = tmp_path / "Übung 1" / "Wand"
    code, out, err = call("export", WAVE, "--law", "C", "--lang", "unity", "-o", str(folder))
    assert (code, err) == (0, "")
    files = {str(file.relative_to(folder)) for file in folder.rglob("*") if file.is_file()}
    library = {"Plugins/x86_64/texture.dll"} & files
    assert files - library == {
        "HapticTexture.cs",
        "Asperity.texture.asmdef",
        "README.txt",
        "Source~/texture.h",
        "Source~/texture.c",
        "Source~/CMakeLists.txt",
        "Examples~/HaplyExample.cs",
        "Examples~/TouchExample.cs",
    }
    assert json.loads((folder / "Asperity.texture.asmdef").read_text())["name"] == (
        "Asperity.texture"
    )
    has_compiler = shutil.which(targets.COMPILER) is not None
    assert bool(library) == has_compiler
    assert ("Library not built" in out) != has_compiler
    code, _out, err = call("export", WAVE, "--law", "C", "--lang", "unity", "-o", str(folder))
    assert code == 2
    assert "exists" in err


def test_without_a_compiler_the_command_is_given(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setenv("PATH", str(tmp_path))
    target = tmp_path / "Wall"
    code, out, _err = call("export", WAVE, "--law", "C", "--lang", "unity", "-o", str(target))
    assert code == 0
    assert f"Library not built, no {targets.COMPILER} here: README.txt says how" in out
    text = (target / "README.txt").read_text()
    assert f"{targets.COMPILER} -std=c99" in text
    assert "cmake -S Source~" in text
    assert not list(target.rglob("*.dll"))


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--precision", "float"), "precision must be double"),
        (("--law", "H", "--load"), "load is for programs in C"),
    ],
)
def test_what_unity_cannot_have_is_refused(
    options: tuple[str, ...], words: str, call: Call, tmp_path: Path
) -> None:
    target = str(tmp_path / "Wall")
    code, _out, err = call("export", "cloth", "--lang", "unity", *options, "-o", target)
    assert code == 2
    assert words in err


def test_name_of_a_file_is_refused(call: Call, tmp_path: Path) -> None:
    target = str(tmp_path / "texture.h")
    code, _out, err = call("export", WAVE, "--lang", "unity", "-o", target)
    assert (code, err.splitlines()[0][:46]) == (2, "asperity: output must be the name of a folder,")
