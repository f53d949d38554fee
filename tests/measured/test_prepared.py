"""Prepared surfaces: saving, loading, and refusal of damaged files."""

from __future__ import annotations

import errno
import hashlib
import zipfile
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.prepared import PreparedSurface, is_prepared, load_prepared, save_prepared
from asperity.measured.reading.measured_file import prepare_file
from asperity.textures import HeightMap, Profile, load_texture
from asperity.textures.catalogue import texture_from_prepared

PITCH = (2e-6, 3e-6)


def bumpy() -> Any:
    heights = 1e-6 * np.random.default_rng(3).standard_normal((30, 40))
    heights[4:7, 10:15] = np.nan
    return heights


@pytest.fixture
def source(tmp_path: Path) -> Path:
    np.save(tmp_path / "map.npy", bumpy())
    return tmp_path / "map.npy"


@pytest.fixture
def saved(source: Path) -> Path:
    path = source.with_name("surface.npz")
    save_prepared(path, prepare_file(source, pitch=PITCH, form=2), source)
    return path


def assert_same(a: PreparedSurface, b: PreparedSurface) -> None:
    np.testing.assert_array_equal(a.heights, b.heights)
    assert (a.pitch, a.steps, a.periodic) == (b.pitch, b.steps, b.periodic)
    assert (a.filled_mask is None) == (b.filled_mask is None)
    if a.filled_mask is not None:
        np.testing.assert_array_equal(a.filled_mask, b.filled_mask)


@pytest.mark.parametrize(
    "arguments", [{}, {"periodic": True, "magnify": 20.0}, {"form": 3, "l_cutoff": 3e-5}]
)
def test_round_trip(source: Path, arguments: dict[str, Any]) -> None:
    prepared = prepare_file(source, pitch=PITCH, **arguments)
    path = source.with_name("surface.npz")
    save_prepared(path, prepared, source)
    assert is_prepared(path)
    assert_same(load_prepared(path), prepared)
    assert prepared.filled_mask is not None
    assert prepared.filled_mask.sum() == (
        15 if "periodic" not in arguments else prepared.filled_mask.sum()
    )


def test_round_trip_of_a_profile_without_holes(tmp_path: Path) -> None:
    np.save(tmp_path / "line.npy", 1e-6 * np.sin(np.arange(50.0)))
    prepared = prepare_file(tmp_path / "line.npy", pitch=1e-6)
    assert prepared.filled_mask is None
    save_prepared(tmp_path / "line.npz", prepared, tmp_path / "line.npy")
    assert_same(load_prepared(tmp_path / "line.npz"), prepared)
    assert isinstance(load_texture(tmp_path / "line.npz"), Profile)


def test_file_states_its_source(saved: Path, source: Path) -> None:
    with np.load(saved, allow_pickle=False) as members:
        assert int(members["asperity_schema"]) == 1
        assert str(members["source"]) == "map.npy"
        assert str(members["sha256"]) == hashlib.sha256(source.read_bytes()).hexdigest()
        assert [str(s) for s in members["steps"]] == list(load_prepared(saved).steps)


def test_textures_of_source_and_prepared_file_are_equal(saved: Path, source: Path) -> None:
    direct = load_texture(source, pitch=PITCH, form=2)
    loaded = load_texture(saved)
    assert isinstance(loaded, HeightMap)
    np.testing.assert_array_equal(loaded.coefficients, direct.coefficients)
    assert loaded.preparation == direct.preparation
    assert loaded.pitch == direct.pitch
    assert loaded.filled_mask is not None
    np.testing.assert_array_equal(loaded.filled_mask, np.isnan(bumpy()))


def test_prepared_file_is_recognised_by_content(saved: Path) -> None:
    renamed = saved.rename(saved.with_name("surface.x3p"))
    assert load_texture(renamed).preparation == load_prepared(renamed).steps


def test_prepared_surface_can_be_magnified(saved: Path) -> None:
    plain, large = load_prepared(saved), prepare_file(saved, magnify=5.0, magnify_height=2.0)
    np.testing.assert_allclose(large.heights, 2 * plain.heights, rtol=1e-15)
    assert large.pitch == pytest.approx((1e-5, 1.5e-5))
    step = "magnified 5 times laterally and 2 times in height"
    assert large.steps == (*plain.steps, step)


@pytest.mark.parametrize(
    "argument",
    [
        {"pitch": 1e-6},
        {"height_range": 1e-6},
        {"outliers": 6.0},
        {"form": 1},
        {"form": 0},
        {"s_cutoff": 1e-5},
        {"l_cutoff": 1e-4},
        {"tip_radius": 1e-6},
        {"periodic": True},
        {"blend": 1e-5},
        {"unit": "m"},
        {"channel": 0},
    ],
)
def test_preparation_arguments_are_refused_for_a_prepared_surface(
    saved: Path, argument: dict[str, Any]
) -> None:
    with pytest.raises(ParameterError, match="was prepared already") as caught:
        load_texture(saved, **argument)
    assert caught.value.argument == next(iter(argument))


@pytest.mark.parametrize(
    "error", [OSError(errno.ENOSPC, "No space left on device"), KeyboardInterrupt(), MemoryError()]
)
@pytest.mark.parametrize("exists", [False, True])
def test_failed_saving_leaves_an_existing_file_unchanged(
    monkeypatch: pytest.MonkeyPatch, source: Path, error: BaseException, exists: bool
) -> None:
    target = source.with_name("surface.npz")
    if exists:
        target.write_text("the old one")
    prepared = prepare_file(source, pitch=PITCH)
    whole = np.savez

    def failing_savez(file: Any, **members: Any) -> None:
        whole(file, heights=members["heights"])
        raise error

    monkeypatch.setattr(np, "savez", failing_savez)
    expected = ParameterError if isinstance(error, OSError) else type(error)
    with pytest.raises(expected) as caught:
        save_prepared(target, prepared, source)
    if isinstance(error, OSError):
        assert "output cannot be written: No space left on device" in str(caught.value)
    names = {p.name for p in source.parent.iterdir()}
    assert names == {"map.npy", "surface.npz"} if exists else {"map.npy"}
    if exists:
        assert target.read_text() == "the old one"


def test_invalid_output_paths_are_refused(source: Path) -> None:
    prepared = prepare_file(source, pitch=PITCH)
    content = source.read_bytes()
    link = source.with_name("link.npz")
    link.symlink_to(source)
    for target, match in (
        (source, "must be another file than the surface"),
        (link, "must be another file than the surface"),
        (source.parent / "missing" / "a.npz", "cannot be written: No such file"),
        (source.parent, "must be a file that ends in .npz"),
        (source.parent / "surface.x3p", "must be a file that ends in .npz"),
    ):
        with pytest.raises(ParameterError, match=match) as caught:
            save_prepared(target, prepared, source)
        assert caught.value.argument == "output"
    assert source.read_bytes() == content


def rewrite_file(saved: Path, compression: int = zipfile.ZIP_STORED, **changes: Any) -> Path:
    """Rewrite a file with some members changed, or omitted where the change is None."""
    with np.load(saved) as file:
        members = {name: file[name] for name in file.files} | changes
    path = saved.with_name("changed.npz")
    with zipfile.ZipFile(path, "w", compression) as archive:
        for name, value in members.items():
            if isinstance(value, bytes):
                archive.writestr(f"{name}.npy", value)
            elif value is not None:
                with archive.open(f"{name}.npy", "w") as stream:
                    np.lib.format.write_array(stream, np.asanyarray(value))
    return path


FALSE_HEADER = b"\x93NUMPY\x01\x00v\x00" + (
    b"{'descr': '<f8', 'fortran_order': False, 'shape': (900000, 900000), }".ljust(117) + b"\n"
)


@pytest.mark.parametrize(
    ("changes", "match"),
    [
        ({"asperity_schema": 2}, "version 2; this asperity reads version 1"),
        ({"asperity_schema": "one"}, "asperity_schema is damaged"),
        ({"heights": None}, "damaged prepared surface"),
        ({"heights": np.zeros((30, 41))}, r"mask has shape \(30, 40\), the heights \(30, 41\)"),
        ({"heights": np.full((30, 40), np.nan)}, "heights that are not finite"),
        ({"heights": np.full((30, 40), np.inf)}, "heights that are not finite"),
        ({"heights": np.zeros((30, 40), np.float32)}, "must be float64"),
        ({"heights": np.zeros((3, 40)), "filled": np.zeros((3, 40), bool)}, "must be float64"),
        ({"heights": np.zeros(())}, "must be float64"),
        ({"heights": np.zeros((30, 40), complex)}, "heights is damaged"),
        ({"heights": FALSE_HEADER}, "damaged prepared surface"),
        ({"heights": b"no array"}, "damaged prepared surface"),
        ({"pitch": np.array([1e-6])}, "pitch must be 2 positive lengths"),
        ({"pitch": np.array([1e-6, -1e-6])}, "pitch must be 2 positive lengths"),
        ({"pitch": np.array([1e-6, np.nan])}, "pitch must be 2 positive lengths"),
        ({"filled": np.zeros((30, 40))}, "filled is damaged"),
        ({"periodic": np.array([True, False])}, "periodic is damaged"),
        ({"steps": np.array([1.0])}, "steps is damaged"),
        ({"steps": b""}, "damaged prepared surface"),
    ],
)
def test_damaged_files_are_refused(saved: Path, changes: dict[str, Any], match: str) -> None:
    with pytest.raises(SurfaceFileError, match=f"changed.npz: .*{match}"):
        load_texture(rewrite_file(saved, **changes))


def test_python_objects_are_never_loaded(saved: Path) -> None:
    path = saved.with_name("objects.npz")
    with np.load(saved) as file:
        members = {name: file[name] for name in file.files}
    np.savez(path, **(members | {"steps": np.array([{"a": 1}], dtype=object)}))
    with pytest.raises(SurfaceFileError, match="damaged prepared surface"):
        load_texture(path)


def test_compressed_files_are_read(saved: Path) -> None:
    assert_same(load_prepared(rewrite_file(saved, zipfile.ZIP_DEFLATED)), load_prepared(saved))


def test_oversized_archives_are_refused(saved: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("asperity.measured.prepared._MAX_BYTES", 1000)
    with pytest.raises(SurfaceFileError, match=r"unpacks to .* bytes; at most 1000 are read"):
        load_prepared(saved)


def test_archive_of_the_greatest_surface_is_not_oversized(
    saved: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Heights of 8 bytes and a mask of one byte for each point, and 64 MiB for everything else."""
    size = 2**27 * 8 + 2**27 + 64 * 1024**2
    for excess in (0, 1):
        whole = zipfile.ZipInfo("heights.npy")
        whole.file_size = size + excess
        monkeypatch.setattr(zipfile.ZipFile, "infolist", lambda _archive, whole=whole: [whole])
        if not excess:
            assert load_prepared(saved).heights.shape == (30, 40)
    with pytest.raises(SurfaceFileError, match=f"unpacks to {size + 1} bytes; at most {size}"):
        load_prepared(saved)


def test_rewritten_copy_is_accepted(saved: Path) -> None:
    assert_same(load_prepared(rewrite_file(saved)), load_prepared(saved))


@pytest.mark.parametrize("seed", range(4))
def test_mutated_files_are_equal_or_refused(saved: Path, seed: int) -> None:
    """The archive's checksums protect the heights: mutated files are read unchanged or refused."""
    rng = np.random.default_rng(seed)
    good, content = load_prepared(saved), saved.read_bytes()
    path = saved.with_name("mutated.npz")
    read_count = 0
    for _ in range(120):
        damaged = bytearray(content)
        if rng.random() < 0.3:
            del damaged[int(rng.integers(len(damaged))) :]
        else:
            for place in rng.integers(len(damaged), size=int(rng.integers(1, 4))):
                damaged[place] = int(rng.integers(256))
        path.write_bytes(damaged)
        try:
            loaded = load_prepared(path)
        except SurfaceFileError:
            continue
        assert_same(loaded, good)
        read_count += 1
    assert read_count < 60


def test_other_files_are_not_prepared_surfaces(tmp_path: Path, source: Path) -> None:
    np.savez(tmp_path / "other.npz", heights=np.zeros((5, 5)))
    (tmp_path / "short.npz").write_bytes(b"PK\x03\x04")
    for path in (tmp_path / "other.npz", tmp_path / "short.npz", source, tmp_path / "missing"):
        assert not is_prepared(path)
        if path is not source:
            with pytest.raises(SurfaceFileError):
                load_texture(path)
    with pytest.raises(SurfaceFileError, match="missing: cannot be read"):
        load_prepared(tmp_path / "missing")


def test_filled_mask_of_textures() -> None:
    mask = np.zeros((5, 6), bool)
    mask[1, 2] = True
    texture = HeightMap(np.zeros((5, 6)), 1e-3, filled_mask=mask)
    assert texture.filled_mask is not None
    assert np.argwhere(texture.filled_mask).tolist() == [[1, 2]]
    assert HeightMap(np.zeros((5, 6)), 1e-3).filled_mask is None
    assert Profile(np.zeros(5), 1e-3, filled_mask=mask[0, :5]).filled_mask is not None
    for wrong in (mask.T, np.zeros((5, 6)), [True]):
        with pytest.raises(ParameterError, match="filled_mask must be true or false"):
            HeightMap(np.zeros((5, 6)), 1e-3, filled_mask=wrong)
    assert (
        texture_from_prepared(PreparedSurface(np.zeros((4, 4)), (1.0, 1.0), ())).filled_mask is None
    )
