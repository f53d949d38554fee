"""User-defined file readers: from a plugin, and registered."""

from __future__ import annotations

import json
import subprocess
import sys
from pathlib import Path
from subprocess import CompletedProcess
from typing import Any

import numpy as np
import pytest
from tests.helpers.pages import page_example

from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.reading import RawSurface, Reader, read_surface, register
from asperity.measured.reading import readers as registry

READER = page_example("howto/readers.md", "Add a file format", "{run}")
HEIGHTS = np.random.default_rng(7).normal(size=(6, 8)).round(3)


def write_waffle(folder: Path) -> Path:
    path = folder / "map.waffle"
    shape = np.array(HEIGHTS.shape, "<u4").tobytes() + np.array([2e-4], "<f8").tobytes()
    path.write_bytes(b"WAFFLE\x00\x01" + shape + HEIGHTS.astype("<f8").tobytes())
    return path


@pytest.fixture
def plugin(tmp_path: Path) -> Path:
    """Return the file of the page's example."""
    path = tmp_path / "waffles.py"
    path.write_text(READER)
    return path


def run_asperity(plugin: Path | None, command: str, *arguments: str) -> CompletedProcess[str]:
    loaded = [] if plugin is None else ["--plugin", str(plugin)]
    main = "from asperity.cli.main import main; main()"
    return subprocess.run(
        [sys.executable, "-c", main, command, *loaded, *arguments],
        capture_output=True,
        text=True,
        check=False,
    )


def test_every_command_reads_the_file(plugin: Path, tmp_path: Path) -> None:
    path, page = write_waffle(tmp_path), tmp_path / "page.html"
    process = run_asperity(plugin, "compare", str(path), "--laws", "WA", "--json", "-")
    assert process.returncode == 0, process.stderr
    texture = json.loads(process.stdout)["texture"]
    assert texture["preparation"][0] == "a waffle"

    scene = tmp_path / "scene.toml"
    scene.write_text(f'[texture]\nkind = "file"\npath = "{path.name}"\n[surface]\nlaw = "A"\n')
    json_path = tmp_path / "found.json"
    process = run_asperity(
        plugin, "analyze", str(scene), "--json", str(json_path), "--html", str(page)
    )
    assert process.returncode == 0, process.stderr
    assert "a waffle" in page.read_text()
    assert json.loads(json_path.read_text())["texture"] == texture

    prepared_path = tmp_path / "kept.npz"
    process = run_asperity(plugin, "prepare", str(path), "--unit", "mm", "-o", str(prepared_path))
    assert process.returncode == 0, process.stderr
    heights = np.load(prepared_path)["heights"]
    assert heights.shape == HEIGHTS.shape
    assert np.std(heights) > 1e-4  # millimetres now


def test_file_is_refused_without_the_plugin(tmp_path: Path) -> None:
    process = run_asperity(
        None, "prepare", str(write_waffle(tmp_path)), "-o", str(tmp_path / "kept.npz")
    )
    assert (process.returncode, process.stdout) == (2, "")
    assert "map.waffle looks like a binary file" in process.stderr
    assert not (tmp_path / "kept.npz").exists()


@pytest.fixture
def no_user_readers(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "USER_READERS", {})


def make_reader(result: object) -> Reader:
    """Return a reader of text that begins with "groove"; the built-in text reader accepts any."""

    def read(*_: object) -> Any:
        if isinstance(result, Exception):
            raise result
        return result

    return Reader("a groove", lambda file: file.head.startswith(b"groove"), read)


@pytest.fixture
def text_file(tmp_path: Path) -> Path:
    path = tmp_path / "a.txt"
    path.write_text("groove\n1 2 3\n4 5 6\n7 8 10\n")
    return path


@pytest.mark.usefixtures("no_user_readers")
def test_registered_reader_precedes_the_text_reader(text_file: Path) -> None:
    assert read_surface(text_file).heights[2, 2] == 10.0
    register(make_reader(RawSurface(np.ones(5), (1e-3,), "a.txt", ())))
    assert read_surface(text_file).pitch == (1e-3,)
    with pytest.raises(ParameterError, match=r"unit must not be given: a\.txt \(a groove\)"):
        read_surface(text_file, unit="mm")
    with pytest.raises(ParameterError, match="a name that no other reader has"):
        register(make_reader(None))


@pytest.mark.usefixtures("no_user_readers")
def test_heights_without_a_unit_are_noted_as_metres(text_file: Path) -> None:
    note = "no unit in the file: taken as metres"
    register(make_reader(RawSurface(np.ones(5), None, "a.txt", ("odd",), has_units=False)))
    assert read_surface(text_file).notes == (note, "odd")
    registry.USER_READERS.clear()
    register(make_reader(RawSurface(np.ones(5), None, "a.txt", (), has_units=False, relative=True)))
    assert read_surface(text_file).notes == ()


@pytest.mark.usefixtures("no_user_readers")
def test_error_in_recognising_names_the_reader(text_file: Path) -> None:
    def recognises(file: Any) -> bool:
        return bool(file.nothing)

    register(Reader("a groove", recognises, lambda *_: None))
    with pytest.raises(SurfaceFileError, match=r"reader of a groove failed \(AttributeError"):
        read_surface(text_file)


@pytest.mark.usefixtures("no_user_readers")
def test_reader_that_returns_none_leaves_the_file_to_the_next(text_file: Path) -> None:
    register(make_reader(None))
    assert read_surface(text_file).heights[2, 2] == 10.0


@pytest.mark.usefixtures("no_user_readers")
@pytest.mark.parametrize(
    ("result", "match"),
    [
        (ZeroDivisionError("by\nzero"), r"a\.txt: the reader of a groove failed \(ZeroDivision"),
        ([1.0], "list instead of a RawSurface"),
        (RawSurface(np.ones((2, 2, 2)), None, "", ()), r"heights of shape \(2, 2, 2\)"),
        (RawSurface(np.ones(4), (1.0, 1.0), "", ()), r"pitch \(1\.0, 1\.0\)"),
        (RawSurface(np.ones(4), (np.nan,), "", ()), "pitch"),
        (RawSurface(np.full(4, np.inf), None, "", ()), "infinite height"),
        (SurfaceFileError("a groove of a later version"), r"^a\.txt: a groove of a later version$"),
    ],
)
def test_invalid_result_of_a_reader_gives_a_one_line_error(
    text_file: Path, result: object, match: str
) -> None:
    """A file that a reader recognises is not tried with the other readers."""
    register(make_reader(result))
    with pytest.raises(SurfaceFileError, match=match) as error:
        read_surface(text_file)
    assert "\n" not in str(error.value)
