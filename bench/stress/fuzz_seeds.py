"""Sound files that the fuzz run mutates, written by the tests' own writers."""

from __future__ import annotations

import importlib.util
import io
import random
import struct
import zipfile
import zlib
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tests.measured.writers import mesh_writer, sdf_writer, x3p_writer
from tests.measured.writers.image_writer import write_png, write_tiff

from bench.stress.damage import mutate

ROOT = Path(__file__).parents[2]
_DATA = ROOT.parent / "shared" / "data"
_PNG_HEAD = 8

Seeds = list[bytes]


def _heights() -> NDArray[np.float64]:
    i, j = np.mgrid[0.0:9, 0.0:12]
    return np.asarray(np.round(40 * np.sin(0.7 * j + 0.3 * i) + 3 * i))


def _x3p(folder: Path) -> Seeds:
    specs = (
        x3p_writer.X3pSpec(_heights() * 1e-6),
        x3p_writer.X3pSpec(_heights(), code="I", z_type="I", z_increment="1e-9"),
        x3p_writer.X3pSpec(_heights(), valid=_heights() > -20),
        x3p_writer.X3pSpec(_heights()[:1] * 1e-6, feature="PRF"),
    )
    return [x3p_writer.write_x3p(folder / "seed.x3p", spec).read_bytes() for spec in specs]


def _npy(_: Path) -> Seeds:
    seeds = []
    for array in (
        _heights(),
        _heights()[0],
        _heights().astype("<i2"),
        np.asfortranarray(_heights()),
    ):
        stream = io.BytesIO()
        np.save(stream, array)
        seeds.append(stream.getvalue())
    return seeds


def _matrix(_: Path) -> Seeds:
    seeds = []
    for separator in ("\t", ",", ";", "  "):
        rows = (separator.join(f"{z:g}" for z in row) for row in _heights())
        seeds.append(
            ("# heights\n# Width: 9 mm\n# Height: 7 mm\nz [um]\n" + "\n".join(rows)).encode()
        )
    return seeds


def _profile(_: Path) -> Seeds:
    pairs = [(0.25 * k, z) for k, z in enumerate(_heights().ravel())]
    point = "Scan,7\nx [um],z [nm]\n" + "\n".join(f"{x:g},{z:g}" for x, z in pairs)
    comma = "x [mm];z [µm]\r\n" + "\r\n".join(f"{x:g};{z:g}" for x, z in pairs).replace(".", ",")
    return [point.encode(), comma.encode("latin-1")]


def _sdf_text(folder: Path) -> Seeds:
    stored = _heights()
    stored[2, 3] = np.nan
    specs = (sdf_writer.SdfSpec(stored), sdf_writer.SdfSpec(stored, version="BCR-1.0", kind=5))
    return [sdf_writer.write_ascii(folder / "seed.sdf", spec).read_bytes() for spec in specs]


def _sdf_binary(folder: Path) -> Seeds:
    specs = [sdf_writer.SdfSpec(_heights(), kind=kind) for kind in (5, 6, 7)]
    specs.append(sdf_writer.SdfSpec(_heights(), kind=3, version="ISO-2.0"))
    return [sdf_writer.write_binary(folder / "seed.sdf", spec).read_bytes() for spec in specs]


def _pictures() -> list[NDArray[Any]]:
    grey = (_heights() + 50).astype(np.uint8)
    deep = grey.astype(np.uint16) * 257
    normal = np.full((9, 12, 3), (130, 120, 254), dtype=np.uint8)
    return [grey, deep, np.stack([deep] * 3, axis=-1), np.stack([grey] * 3, axis=-1), normal]


def _png(folder: Path) -> Seeds:
    from asperity.export.surface_maps import height_png, normal_png, sample_map
    from asperity.textures import HeightMap

    path = folder / "seed.png"
    sampled = sample_map(HeightMap(1e-6 * _heights(), 1e-5))
    return [
        *(
            write_png(path, picture, filters=filters).read_bytes()
            for picture in _pictures()
            for filters in (False, True)
        ),
        height_png(sampled),
        normal_png(sampled),
    ]


def _tiff(folder: Path) -> Seeds:
    from PIL import Image

    path = folder / "seed.tif"
    pictures = [*_pictures(), _heights().astype(np.float32), _heights()]
    seeds = [
        write_tiff(path, p, photometric=2 if p.ndim == 3 else 1, big_endian=big).read_bytes()
        for p in pictures
        for big in (False, True)
    ]
    for compression in ("tiff_lzw", "tiff_adobe_deflate", "packbits"):
        Image.fromarray(_pictures()[1]).save(path, compression=compression)
        seeds.append(path.read_bytes())
    return seeds


def _tiff_lengths(folder: Path) -> Seeds:
    """TIFF with the metadata of ImageJ and of OME."""
    path, values = folder / "seed.tif", _heights().astype(np.float32)
    keys = "ImageJ=1.54f\nimages=1\nunit=micron\ncf=0\nc0=1.5\nc1=2.0\nvunit=nm\n"
    pixels = '<Pixels PhysicalSizeX="0.5" PhysicalSizeY="250" PhysicalSizeYUnit="nm" SizeX="12"/>'
    ome = f'<?xml version="1.0"?><OME xmlns="x"><Image>{pixels}</Image></OME>'
    tags = dict.fromkeys((282, 283), (5, struct.pack("<II", 4, 1)))
    return [
        write_tiff(path, values, tags={**tags, 270: (2, text.encode() + b"\0")}).read_bytes()
        for text in (keys, ome)
    ]


def _columns(_: Path) -> Seeds:
    """Profiles and points with names and units of columns on two lines and on one."""
    line = [f"{0.5 * k:g};{z:g}" for k, z in enumerate(_heights()[0])]
    points = [
        f"{x},{y},{z:g}" for (y, x), z in zip(np.ndindex(9, 12), _heights().ravel(), strict=True)
    ]
    tables = (["X;Y", "[mm];[mm]", *line], ["x in um,y in um,z in um", *points])
    return ["\n".join(table).encode() for table in tables]


def _stl(folder: Path) -> Seeds:
    vertices, faces = mesh_writer.grid_mesh(_heights() / 100, 0.5)
    return [mesh_writer.write_stl(folder / "seed.stl", vertices[faces]).read_bytes()]


def _stl_text(folder: Path) -> Seeds:
    vertices, faces = mesh_writer.grid_mesh(_heights()[:5, :6] / 100, 0.5)
    return [mesh_writer.write_ascii_stl(folder / "seed.stl", vertices[faces]).read_bytes()]


def _obj(folder: Path) -> Seeds:
    vertices, faces = mesh_writer.grid_mesh(_heights() / 100, 0.5)
    return [mesh_writer.write_obj(folder / "seed.obj", vertices, faces).read_bytes()]


def _frt(_: Path) -> Seeds:
    return [(_DATA / "frt-2.frt").read_bytes()]


def _hdf5(folder: Path) -> Seeds:
    import h5py  # type: ignore[import-untyped]  # it has no types

    with h5py.File(folder / "seed.h5", "w") as file:
        file["heights"] = _heights()
    return [(folder / "seed.h5").read_bytes()]


def _matlab(folder: Path) -> Seeds:
    from scipy.io import savemat

    seeds = []
    for packed in (False, True):
        savemat(str(folder / "seed.mat"), {"heights": _heights()}, do_compression=packed)
        seeds.append((folder / "seed.mat").read_bytes())
    return seeds


def _gwyddion(_: Path) -> Seeds:
    def field(name: str, kind: bytes, content: bytes) -> bytes:
        return name.encode() + b"\0" + kind + content

    def made(name: str, *fields: bytes) -> bytes:
        content = b"".join(fields)
        return name.encode() + b"\0" + struct.pack("<I", len(content)) + content

    heights = _heights()
    rows, columns = heights.shape
    data = made(
        "GwyDataField",
        field("xres", b"i", struct.pack("<i", columns)),
        field("yres", b"i", struct.pack("<i", rows)),
        field("xreal", b"d", struct.pack("<d", 1e-6 * columns)),
        field("yreal", b"d", struct.pack("<d", 1e-6 * rows)),
        field("si_unit_xy", b"o", made("GwySIUnit", field("unitstr", b"s", b"m\0"))),
        field("si_unit_z", b"o", made("GwySIUnit", field("unitstr", b"s", b"m\0"))),
        field("data", b"D", struct.pack("<I", heights.size) + (1e-9 * heights).tobytes()),
    )
    title = field("/0/data/title", b"s", b"Height\0")
    return [b"GWYP" + made("GwyContainer", field("/0/data", b"o", data), title)]


_MARKS = (
    *(b"AliconaImaging\0\r\n", b"fileformat = bcrstm\r\n", b"[DataSet]\r\n", b"FRTM_GLIDERV1.00"),
    *(b"GWYP", b"MATLAB 5.0 MAT-file", b"VCA DATA\x01\0\0\x55", b"OmniSurf3D", b"[p3dlin]"),
    *(b"CDF\x01", b"Binary TrueMap Data File v2.0", b"WSxM file copyright", b"DIGITAL SURF"),
    *(b"\x89HDF\r\n\x1a\n", b"KPK0", b"VK4_", b"VK6\0", b"\x01\xb2\xff\xff", b"\x00\x05"),
    *(b"DSCOMPRESSED", b"\x88\x1b\x03\x6f"),
)


def _special_columns(_: Path) -> Seeds:
    """No files at all: the first bytes of instruments' formats, then whatever comes."""
    rng = random.Random("marks")
    return [mark + rng.randbytes(800 - len(mark)) for mark in _MARKS] + [
        mark + bytes(rng.choice((0, 0, 0, 1, 8, 255)) for _ in range(800)) for mark in _MARKS
    ]


def _archive(_: Path) -> Seeds:
    """Zip archives that are no X3P."""
    seeds = []
    stream = io.BytesIO()
    np.savez(stream, heights=_heights())
    seeds.append(stream.getvalue())
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w") as archive:
        archive.writestr("index.xml", "<xml><GENERAL><Type>1</Type></GENERAL></xml>")
        archive.writestr("LAYER_0.raw", _heights().tobytes())
    seeds.append(stream.getvalue())
    return seeds


SEEDS: dict[str, Callable[[Path], Seeds]] = {
    "x3p": _x3p,
    "npy": _npy,
    "matrix": _matrix,
    "profile": _profile,
    "sdf-text": _sdf_text,
    "sdf-binary": _sdf_binary,
    "png": _png,
    "tiff": _tiff,
    "tiff-lengths": _tiff_lengths,
    "columns": _columns,
    "stl-binary": _stl,
    "stl-text": _stl_text,
    "obj": _obj,
    "frt": _frt,
    "hdf5": _hdf5,
    "matlab": _matlab,
    "gwyddion": _gwyddion,
    "marks": _special_columns,
    "archive": _archive,
}
OPTIONS: dict[str, dict[str, Any]] = {
    name: {"unit": "mm"} for name in ("stl-binary", "stl-text", "obj", "hdf5", "matlab")
}


def available_readers() -> list[str]:
    """Return the readers that can be fuzzed here: the FRT file is not part of the project."""
    extra = ("frt", "hdf5", "matlab", "gwyddion", "marks")
    there = importlib.util.find_spec("SurfaceTopography") is not None
    return [
        name
        for name in SEEDS
        if (there or name not in extra) and (name != "frt" or (_DATA / "frt-2.frt").exists())
    ]


def repair_checksums(reader: str, whole: bytes, content: bytes, rng: random.Random) -> bytes:
    """Repair, for half of the files, the checksums that would stop the damage at the door.

    Args:
        reader: its name.
        whole: the sound file.
        content: the damaged one.
        rng: what decides.
    """
    if reader == "png" and rng.random() < 0.5:
        return _repair_png(content)
    if reader == "x3p" and rng.random() < 0.5:
        return _rezip(whole, rng)
    return content


def _repair_png(content: bytes) -> bytes:
    out, at = content[:_PNG_HEAD], _PNG_HEAD
    while at + 8 <= len(content):
        (length,) = struct.unpack_from(">I", content, at)
        body = content[at + 4 : at + 8 + length]
        out += struct.pack(">I", len(body) - 4) + body + struct.pack(">I", zlib.crc32(body))
        at += 12 + length
    return out


def _rezip(content: bytes, rng: random.Random) -> bytes:
    """Damage a member inside a sound archive."""
    stream = io.BytesIO()
    with zipfile.ZipFile(io.BytesIO(content)) as old, zipfile.ZipFile(stream, "w") as new:
        victim = "main.xml" if rng.random() < 0.8 else rng.choice(old.namelist())
        for name in old.namelist():
            member = old.read(name)
            new.writestr(name, mutate(member, rng) if name == victim else member)
    return stream.getvalue()
