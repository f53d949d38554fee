"""Instrument files read by SurfaceTopography, and the errors when it is not installed."""

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
from asperity.measured.reading import surface_topography as instruments

sys.path.insert(0, str(Path(__file__).parents[1] / "writers"))
from image_writer import write_tiff

DATA = Path(__file__).parents[3].parent / "shared" / "data"
needs_data = pytest.mark.skipif(not DATA.is_dir(), reason="real surfaces (../shared/data) missing")
needs_library = pytest.mark.skipif(
    not instruments.has_library(), reason="the extra asperity[formats] is not installed"
)


@dataclass
class DataKind:
    """The kind of a channel's data as SurfaceTopography reports it."""

    value: str


@dataclass
class Topography:
    stored: Any
    is_uniform: bool = True

    def heights(self) -> Any:
        return self.stored


@dataclass
class Channel:
    """A channel as SurfaceTopography describes it, with x as the first index."""

    index: int
    name: str
    data_kind: DataKind = field(default_factory=lambda: DataKind("height"))
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
    """Stand-in for SurfaceTopography.IO with one reader."""

    def __init__(self, *channels: Channel, fault: Exception | None = None) -> None:
        self.readers = [self]
        self.channels = list(channels)
        self.fault = fault

    def format(self) -> str:
        return "made-up"

    def name(self) -> str:
        return "Made-up scanner"

    def can_read(self, head: bytes) -> DataKind:
        return DataKind("yes" if head.startswith(b"MADE UP") else "no")

    def __call__(self, _: object) -> Library:
        if self.fault is not None:
            raise self.fault
        return self

    def close(self) -> None:
        pass


def install(monkeypatch: pytest.MonkeyPatch, library: Library) -> None:
    """Install a stand-in library and read files in this process, the only one that has it."""
    monkeypatch.setattr(instruments, "_import_library", lambda: library)
    monkeypatch.setattr(instruments, "has_library", lambda: True)
    monkeypatch.setattr(registry, "read_isolated", lambda read, file, options: read(file, options))


def write_scan(tmp_path: Path) -> Path:
    path = tmp_path / "scan.bin"
    path.write_bytes(b"MADE UP\0" + bytes(200))
    return path


def read(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, *channels: Channel, **options: Any
) -> RawSurface:
    install(monkeypatch, Library(*channels))
    return read_surface(write_scan(tmp_path), **options)


@needs_data
@needs_library
@pytest.mark.starts_readers
def test_real_file_of_an_frt_instrument() -> None:
    raw = read_surface(DATA / "frt-2.frt")
    # The README of the folder states 30 x 60 mm at 0.2 mm.
    assert raw.heights.shape == (300, 150)
    assert raw.pitch == pytest.approx((2e-4, 2e-4), rel=1e-12)
    assert int(np.isnan(raw.heights).sum()) == 12314
    assert raw.has_units
    assert "FRT" in raw.notes[0]
    # Independent check: the file contains 16-bit counts, x fastest, 1 where missing, bottom row
    # first (SurfaceTopography puts the top row first, as in an image).
    upright = raw.heights[::-1]
    counts = _block(DATA / "frt-2.frt", ~np.isnan(upright))
    ratio = (upright / counts)[~np.isnan(upright)]
    np.testing.assert_allclose(ratio, ratio[0], rtol=1e-12)


def _block(path: Path, measured: np.ndarray[Any, np.dtype[np.bool_]]) -> np.ndarray[Any, Any]:
    content = path.read_bytes()
    for start in range(len(content) - 2 * measured.size + 1):
        block = np.frombuffer(content, "<u2", measured.size, start).reshape(measured.shape)
        if np.array_equal(block != 1, measured):
            return block
    pytest.fail("the pattern of missing points is nowhere in the file")


def test_x_runs_along_the_last_axis(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    stored = np.ma.masked_array(np.arange(6.0).reshape(3, 2), mask=False)
    stored[2, 0] = np.ma.masked
    raw = read(tmp_path, monkeypatch, Channel(0, "Height", stored=stored))
    np.testing.assert_allclose(raw.heights, [[0.0, 2e-6, np.nan], [1e-6, 3e-6, 5e-6]], rtol=1e-15)
    assert raw.pitch == pytest.approx((2e-6, 4e-6), rel=1e-15)


def test_profile_channel(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    channel = Channel(
        0, "P", dim=1, nb_grid_pts=(4,), physical_sizes=(8.0,), unit="nm", stored=np.arange(4.0)
    )
    raw = read(tmp_path, monkeypatch, channel)
    assert raw.is_profile
    assert raw.pitch == pytest.approx((2e-9,), rel=1e-15)
    np.testing.assert_allclose(raw.heights, np.arange(4) * 1e-9, rtol=1e-15)


def test_channel_is_selected_by_name_or_number(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    phase = Channel(0, "Phase", data_kind=DataKind("phase"))
    height = Channel(1, "Height")
    sensor = Channel(2, "ZSensor", stored=10 + np.arange(6.0).reshape(3, 2))
    raw = read(tmp_path, monkeypatch, phase, height)
    assert raw.heights[0, 0] == 0.0
    assert "channel 'Height' of 2" in raw.notes
    with pytest.raises(
        ParameterError, match="2 height channels: 1: 'Height', 2: 'ZSensor'"
    ) as caught:
        read(tmp_path, monkeypatch, phase, height, sensor)
    assert caught.value.argument == "channel"
    for channel in ("ZSensor", "2", 2):
        raw = read(tmp_path, monkeypatch, phase, height, sensor, channel=channel)
        assert raw.heights[0, 0] == pytest.approx(10e-6, rel=1e-15)
    for channel in ("Phase", 0, 7, "zsensor", ""):
        with pytest.raises(ParameterError, match="must be one of the height channels 1: 'Height'"):
            read(tmp_path, monkeypatch, phase, height, sensor, channel=channel)
    with pytest.raises(SurfaceFileError, match="no height channel; the file has: 'Phase'"):
        read(tmp_path, monkeypatch, phase)


def test_file_without_a_height_channel_is_tried_by_the_next_reader(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    phase = Channel(0, "Phase", data_kind=DataKind("phase"))
    library = Library(phase)
    library.readers = [library, Library(Channel(0, "Height"))]
    install(monkeypatch, library)
    assert read_surface(write_scan(tmp_path)).heights.shape == (2, 3)
    library.readers = [library, Library(fault=ValueError("not mine"))]
    with pytest.raises(SurfaceFileError, match="damaged"):
        read_surface(write_scan(tmp_path))


def test_missing_unit_is_required_and_missing_size_gives_no_pitch(
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


def test_unusable_channels_are_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(SurfaceFileError, match="not evenly spaced"):
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
def test_failing_reader_gives_a_one_line_error(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, fault: Exception
) -> None:
    install(monkeypatch, Library(fault=fault))
    with pytest.raises(
        SurfaceFileError, match=r"scan\.bin: Made-up scanner file, damaged"
    ) as caught:
        read_surface(write_scan(tmp_path))
    assert "\n" not in str(caught.value)


def test_without_the_extra_the_error_names_the_install_command(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "SurfaceTopography", None)
    monkeypatch.setitem(sys.modules, "SurfaceTopography.IO", None)
    with pytest.raises(SurfaceFileError, match=r"pip install 'asperity\[formats\]'"):
        read_surface(write_scan(tmp_path))
    park = write_tiff(tmp_path / "park.tiff", np.eye(4), tags={50432: (4, struct.pack("<I", 1))})
    with pytest.raises(SurfaceFileError, match=r"instrument's TIFF.*asperity\[formats\]"):
        read_surface(park)
    plux = tmp_path / "scan.plux"
    with zipfile.ZipFile(plux, "w") as archive:
        archive.writestr("index.xml", "<xml/>")
    with pytest.raises(SurfaceFileError, match=r"asperity\[formats\]"):
        read_surface(plux)
    # Faulty text is reported as text, without the hint.
    text = tmp_path / "a.txt"
    text.write_text("1 2 3 4\n5 6\n")
    with pytest.raises(SurfaceFileError, match="every row must have the same number") as caught:
        read_surface(text)
    assert "formats" not in str(caught.value)


@needs_library
@pytest.mark.parametrize("size", [300, 2 * 60 * 60, 2 * 1201 * 1201])
def test_random_bytes_are_not_read_as_a_surface(tmp_path: Path, size: int) -> None:
    """One reader of the library takes any square number of 16-bit values for a terrain tile."""
    path = tmp_path / "garbage.bin"
    path.write_bytes(np.random.default_rng(size).bytes(size))
    with pytest.raises(SurfaceFileError, match="looks like a binary file"):
        read_surface(path)


@needs_library
def test_text_is_not_passed_to_the_library(tmp_path: Path) -> None:
    path = tmp_path / "points.txt"
    rows = "".join(f"{x + y / 100} {y} {x * y}\n" for x in range(5) for y in range(5))
    path.write_text(f"x [m] y [m] z [m]\n{rows}")
    with pytest.raises(SurfaceFileError, match="three columns"):
        read_surface(path)


@needs_library
@pytest.mark.starts_readers
def test_instrument_tiff_is_recognised(tmp_path: Path) -> None:
    path = write_tiff(tmp_path / "park.tiff", np.eye(4), tags={50432: (4, struct.pack("<I", 1))})
    with pytest.raises(SurfaceFileError, match="no height channel"):
        read_surface(path)


def test_optional_libraries_are_imported_lazily() -> None:
    code = (
        "import sys, asperity.measured.reading;"
        "heavy = {'SurfaceTopography', 'trimesh', 'PIL', 'tifffile', 'scipy'};"
        "print(sorted(heavy & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


# --- second witnesses ----------------------------------------------------------------------------

FILES_PAGE = Path(__file__).parents[3] / "docs" / "howto" / "files.md"


@pytest.mark.parametrize("format_name", ["opd", "made-up"])
def test_a_format_without_a_witness_has_a_note(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, format_name: str
) -> None:
    monkeypatch.setattr(Library, "format", lambda _: format_name)
    notes = read(tmp_path, monkeypatch, Channel(0, "Z")).notes
    assert (instruments.NO_WITNESS in notes) == (format_name == "made-up")
    assert instruments.NO_WITNESS.startswith("no second witness for this format: check the lateral")


@pytest.mark.parametrize("format_name", ["nms", "tmd", "metropro", "plu"])
def test_formats_of_which_two_readers_differ_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, format_name: str
) -> None:
    monkeypatch.setattr(Library, "format", lambda _: format_name)
    with pytest.raises(SurfaceFileError, match=r"may misread: .*; export it as X3P or SDF"):
        read(tmp_path, monkeypatch, Channel(0, "Z"))


@needs_library
@pytest.mark.filterwarnings("ignore::ImportWarning")
def test_page_on_files_lists_the_witness_of_each_format() -> None:
    from SurfaceTopography.IO import readers

    rows = [line for line in FILES_PAGE.read_text("utf-8").splitlines() if line.startswith("|")]
    own = {*instruments._OWN_FORMATS}
    for format_name in {reader.format() for reader in readers} - own:
        (row,) = [line for line in rows if f"`{format_name}`" in line]
        assert ("| refused |" in row) == (format_name in instruments._WRONG_FORMATS)
        is_read = format_name not in instruments._WRONG_FORMATS
        has_witness = format_name in instruments.WITNESSED_FORMATS
        assert ("no second witness" in row) == (is_read and not has_witness)


@pytest.mark.parametrize("name", ["Deflection", "AmplitudeError", "PeakForceError", "Phase"])
def test_channels_of_other_quantities_are_no_heights(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, name: str
) -> None:
    """SurfaceTopography lists them among the heights."""
    other = Channel(1, name, stored=np.zeros((3, 2)))
    raw = read(tmp_path, monkeypatch, Channel(0, "ZSensor"), other)
    assert raw.heights.max() > 0.0
    with pytest.raises(ParameterError, match="must be one of the height channels 0: 'ZSensor'"):
        read(tmp_path, monkeypatch, Channel(0, "ZSensor"), other, channel=1)
    with pytest.raises(SurfaceFileError, match="no height channel"):
        read(tmp_path, monkeypatch, other)
