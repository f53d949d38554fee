"""Files of instruments through SurfaceTopography, and what happens without it."""

from __future__ import annotations

import struct
import subprocess
import sys
import zipfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.reading import RawSurface, read_surface
from asperity.measured.reading import readers as registry
from asperity.measured.reading.metrology import surface_topography as instruments

sys.path.insert(0, str(Path(__file__).parents[1] / "writers"))
from image_writer import write_tiff

DATA = Path(__file__).parents[3].parent / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="real surfaces (../shared/data) missing")
needs_library = pytest.mark.skipif(
    not instruments.has_library(), reason="the extra asperity[formats] is not installed"
)


@dataclass
class Kind:
    """What SurfaceTopography says a channel's data are."""

    value: str


@dataclass
class Topography:
    stored: Any
    is_uniform: bool = True

    def heights(self) -> Any:
        return self.stored


@dataclass
class Channel:
    """A channel as SurfaceTopography describes it: x is the first index."""

    index: int
    name: str
    data_kind: Kind = field(default_factory=lambda: Kind("height"))
    dim: int = 2
    nb_grid_pts: tuple[int, ...] = (3, 2)
    physical_sizes: tuple[float, ...] | None = (6.0, 8.0)
    unit: str | None = "µm"
    is_uniform: bool | None = True
    stored: Any = field(default_factory=lambda: np.arange(6.0).reshape(3, 2))

    def topography(self, **options: object) -> Topography:
        assert ("physical_sizes" in options) == (self.physical_sizes is None)
        assert ("unit" in options) == (self.unit is None)
        return Topography(self.stored)


class Library:
    """Stands for SurfaceTopography.IO with one reader, which takes every file."""

    def __init__(self, *channels: Channel, fault: Exception | None = None) -> None:
        self.readers = [self]
        self.channels = list(channels)
        self.fault = fault

    def format(self) -> str:
        return "made-up"

    def name(self) -> str:
        return "Made-up scanner"

    def can_read(self, head: bytes) -> Kind:
        return Kind("yes" if head.startswith(b"MADE UP") else "no")

    def __call__(self, _: object) -> Library:
        if self.fault is not None:
            raise self.fault
        return self

    def close(self) -> None:
        pass


def install(monkeypatch: pytest.MonkeyPatch, library: Library) -> None:
    """Put a library in place, which is known to this process only: files are read here."""
    monkeypatch.setattr(instruments, "_import_library", lambda: library)
    monkeypatch.setattr(instruments, "has_library", lambda: True)
    monkeypatch.setattr(registry, "read_isolated", lambda read, file, options: read(file, options))


def file(tmp_path: Path) -> Path:
    path = tmp_path / "scan.bin"
    path.write_bytes(b"MADE UP\0" + bytes(200))
    return path


def read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *channels: Channel, **options: Any
) -> RawSurface:
    install(monkeypatch, Library(*channels))
    return read_surface(file(tmp_path), **options)


@needs_data
@needs_library
def test_a_real_file_of_an_frt_instrument() -> None:
    raw = read_surface(DATA / "frt-2.frt")
    # 30 x 60 mm at 0.2 mm, says the folder's README.
    assert raw.heights.shape == (300, 150)
    assert raw.pitch == pytest.approx((2e-4, 2e-4), rel=1e-12)
    assert int(np.isnan(raw.heights).sum()) == 12314
    assert raw.has_units
    assert "FRT" in raw.notes[0]
    # Independently: somewhere in the file lie 16-bit counts, x fastest, 1 where missing, the
    # bottom row first (SurfaceTopography puts the top row first, as in a picture).
    upright = raw.heights[::-1]
    counts = _block(DATA / "frt-2.frt", ~np.isnan(upright))
    ratio = (upright / counts)[~np.isnan(upright)]
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-12)


def _block(path: Path, known: np.ndarray[Any, np.dtype[np.bool_]]) -> np.ndarray[Any, Any]:
    content = path.read_bytes()
    for start in range(len(content) - 2 * known.size + 1):
        block = np.frombuffer(content, "<u2", known.size, start).reshape(known.shape)
        if np.array_equal(block != 1, known):
            return block
    pytest.fail("the pattern of missing points is nowhere in the file")


def test_x_runs_along_the_last_axis(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stored = np.ma.masked_array(np.arange(6.0).reshape(3, 2), mask=False)
    stored[2, 0] = np.ma.masked
    raw = read(tmp_path, monkeypatch, Channel(0, "Height", stored=stored))
    np.testing.assert_allclose(raw.heights, [[0.0, 2e-6, np.nan], [1e-6, 3e-6, 5e-6]], rtol=1e-15)
    assert raw.pitch == pytest.approx((2e-6, 4e-6), rel=1e-15)


def test_profiles(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    channel = Channel(
        0, "P", dim=1, nb_grid_pts=(4,), physical_sizes=(8.0,), unit="nm", stored=np.arange(4.0)
    )
    raw = read(tmp_path, monkeypatch, channel)
    assert raw.is_profile
    assert raw.pitch == pytest.approx((2e-9,), rel=1e-15)
    np.testing.assert_allclose(raw.heights, np.arange(4) * 1e-9, rtol=1e-15)


def test_channels_are_chosen_by_name_or_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    phase = Channel(0, "Phase", data_kind=Kind("phase"))
    one = Channel(1, "Height")
    two = Channel(2, "ZSensor", stored=10 + np.arange(6.0).reshape(3, 2))
    raw = read(tmp_path, monkeypatch, phase, one)
    assert raw.heights[0, 0] == 0.0
    assert "channel 'Height' of 2" in raw.notes
    with pytest.raises(ParameterError, match="2 height channels: 1: 'Height', 2: 'ZSensor'") as got:
        read(tmp_path, monkeypatch, phase, one, two)
    assert got.value.argument == "channel"
    for channel in ("ZSensor", "2", 2):
        raw = read(tmp_path, monkeypatch, phase, one, two, channel=channel)
        assert raw.heights[0, 0] == pytest.approx(10e-6, rel=1e-15)
    for channel in ("Phase", 0, 7, "zsensor", ""):
        with pytest.raises(ParameterError, match="must be one of the height channels 1: 'Height'"):
            read(tmp_path, monkeypatch, phase, one, two, channel=channel)
    with pytest.raises(SurfaceFileError, match="no height channel; the file has: 'Phase'"):
        read(tmp_path, monkeypatch, phase)


def test_a_file_without_a_height_channel_is_left_to_the_next_reader(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    phase = Channel(0, "Phase", data_kind=Kind("phase"))
    library = Library(phase)
    library.readers = [library, Library(Channel(0, "Height"))]
    install(monkeypatch, library)
    assert read_surface(file(tmp_path)).heights.shape == (2, 3)
    library.readers = [library, Library(fault=ValueError("not mine"))]
    with pytest.raises(SurfaceFileError, match="damaged"):
        read_surface(file(tmp_path))


def test_units_and_sizes_that_the_file_lacks(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bare = Channel(0, "Height", unit=None)
    with pytest.raises(ParameterError, match=r"unit is required: scan\.bin has no unit"):
        read(tmp_path, monkeypatch, bare)
    raw = read(tmp_path, monkeypatch, bare, unit="mm")
    assert raw.pitch == pytest.approx((2e-3, 4e-3), rel=1e-15)
    assert raw.heights[1, 2] == pytest.approx(5e-3, rel=1e-15)
    with pytest.raises(ParameterError, match=r"unit must not be given: scan\.bin names its unit"):
        read(tmp_path, monkeypatch, Channel(0, "Height"), unit="mm")
    assert read(tmp_path, monkeypatch, Channel(0, "H", physical_sizes=None)).pitch is None
    with pytest.raises(ParameterError, match="integrate_normals must not be given"):
        read(tmp_path, monkeypatch, Channel(0, "Height"), integrate_normals=True)


def test_what_cannot_be_a_surface(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(SurfaceFileError, match="sampling is not uniform"):
        read(tmp_path, monkeypatch, Channel(0, "H", is_uniform=False))
    with pytest.raises(SurfaceFileError, match="more than are read or the file can hold"):
        read(tmp_path, monkeypatch, Channel(0, "H", nb_grid_pts=(5000, 5000)))
    with pytest.raises(SurfaceFileError, match="is not positive"):
        read(tmp_path, monkeypatch, Channel(0, "H", physical_sizes=(0.0, 1.0)))
    with pytest.raises(ParameterError, match="unit must be a unit of length"):
        read(tmp_path, monkeypatch, Channel(0, "H", unit="V"))
    with pytest.raises(SurfaceFileError, match="Made-up scanner file, damaged"):
        read(tmp_path, monkeypatch, Channel(0, "H", stored="no numbers"))


@pytest.mark.parametrize("fault", [ValueError("a\nb"), KeyError(), RecursionError("deep")])
def test_a_reader_that_fails_is_reported_in_one_line(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: Exception
) -> None:
    install(monkeypatch, Library(fault=fault))
    with pytest.raises(SurfaceFileError, match=r"scan\.bin: Made-up scanner file, damaged") as got:
        read_surface(file(tmp_path))
    assert "\n" not in str(got.value)


def test_without_the_extra_one_sentence_says_what_to_install(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "SurfaceTopography", None)
    monkeypatch.setitem(sys.modules, "SurfaceTopography.IO", None)
    with pytest.raises(SurfaceFileError, match=r"pip install 'asperity\[formats\]'"):
        read_surface(file(tmp_path))
    park = write_tiff(tmp_path / "park.tiff", np.eye(4), tags={50432: (4, struct.pack("<I", 1))})
    with pytest.raises(SurfaceFileError, match=r"instrument's TIFF.*asperity\[formats\]"):
        read_surface(park)
    plux = tmp_path / "scan.plux"
    with zipfile.ZipFile(plux, "w") as archive:
        archive.writestr("index.xml", "<xml/>")
    with pytest.raises(SurfaceFileError, match=r"asperity\[formats\]"):
        read_surface(plux)
    # Not where the content is ours: text with a fault is a text with a fault.
    text = tmp_path / "a.txt"
    text.write_text("1 2 3 4\n5 6\n")
    with pytest.raises(SurfaceFileError, match="every row must have the same number") as got:
        read_surface(text)
    assert "formats" not in str(got.value)


@needs_library
@pytest.mark.parametrize("size", [300, 2 * 60 * 60, 2 * 1201 * 1201])
def test_garbage_is_not_claimed(tmp_path: Path, size: int) -> None:
    """A square number of 16-bit values is not a tile of terrain, as one reader would have it."""
    path = tmp_path / "garbage.bin"
    path.write_bytes(np.random.default_rng(size).bytes(size))
    with pytest.raises(SurfaceFileError, match="looks like a binary file"):
        read_surface(path)


@needs_library
def test_text_stays_ours(tmp_path: Path) -> None:
    path = tmp_path / "points.txt"
    path.write_text("".join(f"{x + y / 100} {y} {x * y}\n" for x in range(5) for y in range(5)))
    with pytest.raises(SurfaceFileError, match="three columns"):
        read_surface(path)


@needs_library
def test_an_instruments_tiff_is_recognised(tmp_path: Path) -> None:
    path = write_tiff(tmp_path / "park.tiff", np.eye(4), tags={50432: (4, struct.pack("<I", 1))})
    with pytest.raises(SurfaceFileError, match="no height channel"):
        read_surface(path)


def test_the_library_is_imported_only_where_it_is_needed() -> None:
    code = (
        "import sys, asperity.measured.reading;"
        "heavy = {'SurfaceTopography', 'trimesh', 'PIL', 'tifffile', 'scipy'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"
