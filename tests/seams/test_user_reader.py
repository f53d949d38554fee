"""A file reader by entry point, as another package brings it: nothing of asperity is touched."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.helpers.pages import page_example

from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.reading import RawSurface, Reader, read_surface, register
from asperity.measured.reading import readers as registry

READER = page_example("howto/readers.md", "Add a file format", "{run}")
POINTS = "[asperity.readers]\nwaffle = waffles:WAFFLE\n"
HEIGHTS = np.random.default_rng(7).normal(size=(6, 8)).round(3)


def waffle(folder: Path) -> Path:
    path = folder / "map.waffle"
    shape = np.array(HEIGHTS.shape, "<u4").tobytes() + np.array([2e-4], "<f8").tobytes()
    path.write_bytes(b"WAFFLE\x00\x01" + shape + HEIGHTS.astype("<f8").tobytes())
    return path


@pytest.fixture
def package(tmp_path: Path) -> Path:
    """An installed distribution: a module, and beside it what says that it brings a reader."""
    folder = tmp_path / "site"
    info = folder / "waffles-1.0.dist-info"
    info.mkdir(parents=True)
    (info / "METADATA").write_text("Metadata-Version: 2.1\nName: waffles\nVersion: 1.0\n")
    (info / "entry_points.txt").write_text(POINTS)
    (folder / "waffles.py").write_text(READER)
    return folder


def asperity(package: Path | None, *arguments: str) -> subprocess.CompletedProcess[str]:
    own = [] if package is None else [str(package)]
    given = os.environ.get("PYTHONPATH", "")
    path = os.pathsep.join([*own, *([given] if given else [])])
    return subprocess.run(
        [sys.executable, "-c", "from asperity.cli.main import main; main()", *arguments],
        env=os.environ | {"PYTHONPATH": path}, capture_output=True, text=True, check=False,
    )  # fmt: skip


def test_every_command_takes_the_file(package: Path, tmp_path: Path) -> None:
    path, page = waffle(tmp_path), tmp_path / "page.html"
    done = asperity(package, "compare", str(path), "--laws", "WA", "--json", "-")
    assert done.returncode == 0, done.stderr
    texture = json.loads(done.stdout)["texture"]
    assert texture["preparation"][0] == "a waffle"

    scene = tmp_path / "scene.toml"
    scene.write_text(f'[texture]\nkind = "file"\npath = "{path.name}"\n[surface]\nlaw = "A"\n')
    found = tmp_path / "found.json"
    done = asperity(package, "analyze", str(scene), "--json", str(found), "--html", str(page))
    assert done.returncode == 0, done.stderr
    assert "a waffle" in page.read_text()
    assert json.loads(found.read_text())["texture"] == texture

    kept = tmp_path / "kept.npz"
    done = asperity(package, "prepare", str(path), "--unit", "mm", "-o", str(kept))
    assert done.returncode == 0, done.stderr
    heights = np.load(kept)["heights"]
    assert heights.shape == HEIGHTS.shape
    assert np.std(heights) > 1e-4  # millimetres now


def test_without_the_package_the_file_is_refused(tmp_path: Path) -> None:
    done = asperity(None, "prepare", str(waffle(tmp_path)), "-o", str(tmp_path / "kept.npz"))
    assert (done.returncode, done.stdout) == (2, "")
    assert "map.waffle looks like a binary file" in done.stderr
    assert not (tmp_path / "kept.npz").exists()


@pytest.mark.parametrize(
    ("module", "reason"),
    [
        ("import nothing_of_this_name\n", "ModuleNotFoundError"),
        ("BROKEN = 3\n", "TypeError: broken:BROKEN is no Reader"),
        (
            "from asperity.measured.reading import Reader\n"
            "BROKEN = Reader('a broken file', lambda file: file.nothing, None)\n",
            "AttributeError",
        ),
    ],
)
def test_a_broken_package_is_named_and_stops_nobody(
    package: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, module: str, reason: str
) -> None:
    (package / "broken.py").write_text(module)
    points = package / "waffles-1.0.dist-info" / "entry_points.txt"
    points.write_text(POINTS + "a-broken-one = broken:BROKEN\n")
    monkeypatch.syspath_prepend(str(package))
    try:
        raw = read_surface(waffle(tmp_path))
        np.testing.assert_array_equal(raw.heights, 1e-6 * HEIGHTS)
        assert any("broken" in note and reason in note for note in raw.notes)
        unknown = tmp_path / "unknown"
        unknown.write_bytes(bytes(range(256)))
        with pytest.raises(SurfaceFileError, match=f"looks like a binary file.*broken.*{reason}"):
            read_surface(unknown)
        np.save(tmp_path / "a.npy", HEIGHTS)  # known by its mark: no package is asked
        assert len(read_surface(tmp_path / "a.npy").notes) == 1
    finally:
        for name in ("broken", "waffles"):
            sys.modules.pop(name, None)


@pytest.fixture
def empty(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(registry, "USER_READERS", {})


def groove(result: object) -> Reader:
    """Return a reader of text that begins with a word; any text is taken by a reader of ours."""

    def read(*_: object) -> Any:
        if isinstance(result, Exception):
            raise result
        return result

    return Reader("a groove", lambda file: file.head.startswith(b"groove"), read)


@pytest.fixture
def text(tmp_path: Path) -> Path:
    path = tmp_path / "a.txt"
    path.write_text("groove\n1 2 3\n4 5 6\n7 8 10\n")
    return path


@pytest.mark.usefixtures("empty")
def test_a_registered_reader_is_asked_before_text_is_guessed(text: Path) -> None:
    assert read_surface(text).heights[2, 2] == 10.0
    register(groove(RawSurface(np.ones(5), (1e-3,), "a.txt", ())))
    assert read_surface(text).pitch == (1e-3,)
    with pytest.raises(ParameterError, match=r"unit must not be given: a\.txt \(a groove\)"):
        read_surface(text, unit="mm")
    with pytest.raises(ParameterError, match="a name that no other reader has"):
        register(groove(None))


@pytest.mark.usefixtures("empty")
def test_a_unit_that_a_reader_leaves_open_is_said_to_be_the_metre(text: Path) -> None:
    said = "no unit in the file: taken as metres"
    register(groove(RawSurface(np.ones(5), None, "a.txt", ("odd",), has_units=False)))
    assert read_surface(text).notes == (said, "odd")
    registry.USER_READERS.clear()
    register(groove(RawSurface(np.ones(5), None, "a.txt", (), has_units=False, relative=True)))
    assert read_surface(text).notes == ()


@pytest.mark.usefixtures("empty")
def test_a_reader_that_finds_nothing_leaves_the_file_to_the_next(text: Path) -> None:
    register(groove(None))
    assert read_surface(text).heights[2, 2] == 10.0


@pytest.mark.usefixtures("empty")
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
def test_a_careless_reader_is_a_refusal_in_one_line(text: Path, result: object, match: str) -> None:
    """A file that a reader knows for its own is not guessed at by the others."""
    register(groove(result))
    with pytest.raises(SurfaceFileError, match=match) as caught:
        read_surface(text)
    assert "\n" not in str(caught.value)
