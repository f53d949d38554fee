"""Height and normal maps in files that other tools read.

All of them are the same picture: x goes to the right, y down, row 0 is the first.
"""

from __future__ import annotations

import hashlib
import io
import struct
import zipfile
import zlib
from collections.abc import Callable
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.errors import ParameterError, nearest_names
from asperity.export.sampled import SampledMap
from asperity.version import __version__

_LAYOUT = "x goes to the right, y down the picture"


@dataclass(frozen=True)
class Convention:
    """How a normal becomes three bytes: zero + scale * (x right, y up the picture, z out).

    Attributes:
        words: of whom it is.
        zero: byte of a component 0.
        scale: bytes from 0 to 1.
    """

    words: str
    zero: float
    scale: float

    def encoded(self, normals: FloatArray) -> NDArray[np.uint8]:
        """Return the bytes of normals along x, y (down the picture) and z."""
        upward = normals * (1.0, -1.0, 1.0)
        return np.rint(self.zero + self.scale * upward).astype(np.uint8)

    def decoded(self, pixels: NDArray[np.uint8]) -> FloatArray:
        """Return the unit normals that a program reads."""
        upward = (pixels - self.zero) / self.scale * (1.0, -1.0, 1.0)
        return np.asarray(upward / np.sqrt((upward**2).sum(axis=-1))[..., None])


CONVENTIONS = {
    # Red and green [0, 255] are [-1, 1], green up the picture, as in OpenGL.
    "gltf": Convention("glTF 2.0, material.normalTexture", 127.5, 127.5),
    # As cAlgorithmFingerProxy reads it; a PNG's last row is the first of its cImage.
    "chai3d": Convention("CHAI3D, cNormalMap", 128.0, 127.0),
}
"""Of normal maps, by name."""


def height_png(sampled: SampledMap) -> bytes:
    """Return a grey PNG of 16 bits: 0 is the least height, 65535 the greatest.

    The size of a pixel stands in the chunk sCAL, heights in metres in pCAL; readers that know
    neither need both from the user.

    Reference:
        Extensions to the PNG 1.2 specification, 1.2.0: sCAL, pCAL.
    """
    low, span = _range(sampled.heights)
    grey = np.rint((sampled.heights - low) / (span / 65535.0)).astype(">u2")
    calibration = b"asperity\0" + struct.pack(">iiBB", 0, 65535, 0, 2)
    calibration += f"m\0{low!r}\0{span!r}".encode()
    return _png(sampled, grey[..., None], b"pCAL", calibration, f"Heights; {_LAYOUT}")


def height_tiff(sampled: SampledMap) -> bytes:
    """Return a TIFF of 32-bit floats with heights in micrometres, as ImageJ writes and reads it."""
    import tifffile

    stream = io.BytesIO()
    px, py = sampled.spacing
    metadata = {"unit": "um", "vunit": "um", "Info": f"Heights; {_LAYOUT}"}
    heights = (1e6 * sampled.heights).astype(np.float32)
    resolution = 1e-6 / px, 1e-6 / py
    tifffile.imwrite(stream, heights, imagej=True, metadata=metadata, resolution=resolution)
    return stream.getvalue()


def height_x3p(sampled: SampledMap) -> bytes:
    """Return an X3P with heights in metres, every bit of them.

    Reference:
        ISO 25178-72:2017.
    """
    points = np.ascontiguousarray(sampled.heights, dtype="<f8").tobytes()
    main = _main_xml(sampled, hashlib.md5(points, usedforsecurity=False).hexdigest())
    digest = hashlib.md5(main, usedforsecurity=False).hexdigest()
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo("main.xml"), main)
        archive.writestr(zipfile.ZipInfo("md5checksum.hex"), f"{digest} *main.xml\n")
        archive.writestr(zipfile.ZipInfo("bindata/data.bin"), points)
    return stream.getvalue()


def normal_png(sampled: SampledMap, convention: str = "gltf") -> bytes:
    """Return a PNG with normals in 8 bits: red x, green y up the picture, blue z.

    Args:
        sampled: the map.
        convention: ``"gltf"`` or ``"chai3d"``, which differ in the byte of zero.

    Raises:
        ParameterError: for an unknown convention.

    Reference:
        glTF 2.0, 3.9.3 and material.normalTexture; CHAI3D 3.2, cAlgorithmFingerProxy.
    """
    rule = find_convention(convention)
    pixels = rule.encoded(sampled.normals)
    words = f"Normals, {rule.words}; {_LAYOUT}, green up"
    return _png(sampled, pixels, b"", b"", words)


def find_convention(name: str) -> Convention:
    """Return a convention by its name.

    Raises:
        ParameterError: for an unknown one.
    """
    if name.lower() not in CONVENTIONS:
        hint = nearest_names(name, CONVENTIONS)
        raise ParameterError("normals", f"is no convention: {name!r}; {hint}")
    return CONVENTIONS[name.lower()]


HEIGHT_MAPS: dict[str, Callable[[SampledMap], bytes]] = {
    ".png": height_png,
    ".tif": height_tiff,
    ".tiff": height_tiff,
    ".x3p": height_x3p,
}
"""What writes a height map, by the suffix of the file."""


def height_step(sampled: SampledMap, suffix: str) -> float:
    """Return by how much a height in the file may differ from that of the surface [m]."""
    if suffix == ".x3p":
        return 0.0
    if suffix == ".png":
        return 0.5 * _range(sampled.heights)[1] / 65535.0
    largest = np.float32(1e6 * np.abs(sampled.heights).max(initial=0.0))
    return 0.5e-6 * float(np.spacing(largest))


def normal_error(sampled: SampledMap, convention: str) -> float:
    """Return the largest angle between a normal and what a program reads of it [rad]."""
    rule = find_convention(convention)
    read = rule.decoded(rule.encoded(sampled.normals))
    # The chord, not the cosine: it keeps the digits of small angles.
    chord = np.sqrt(((read - sampled.normals) ** 2).sum(axis=-1))
    return float(2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0)).max())


def _range(heights: FloatArray) -> tuple[float, float]:
    """Return the least height and the span of all [m]; a flat map gets some span."""
    low, high = float(heights.min()), float(heights.max())
    return low, high - low if high > low else 1e-9


def _png(
    sampled: SampledMap, pixels: NDArray[np.generic], kind: bytes, data: bytes, words: str
) -> bytes:
    rows, columns, channels = pixels.shape
    depth, colour = 8 * pixels.dtype.itemsize, 2 if channels == 3 else 0
    size = "\0".join(repr(step) for step in sampled.spacing)
    lines = pixels.reshape(rows, -1).view(np.uint8)
    plain = np.zeros((rows, lines.shape[1] + 1), np.uint8)  # each row begins with its filter: none
    plain[:, 1:] = lines
    text = f"{words}; {sampled.words}; asperity {__version__}"
    chunks = [
        (b"IHDR", struct.pack(">IIBBBBB", columns, rows, depth, colour, 0, 0, 0)),
        (b"sCAL", b"\x01" + size.encode()),
        (kind, data),
        (b"tEXt", b"Description\0" + text.encode("latin-1", "replace")),
        (b"IDAT", zlib.compress(plain.tobytes(), 6)),
        (b"IEND", b""),
    ]
    return b"\x89PNG\r\n\x1a\n" + b"".join(_chunk(kind, data) for kind, data in chunks if kind)


def _chunk(kind: bytes, data: bytes) -> bytes:
    checksum = zlib.crc32(data, zlib.crc32(kind))
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", checksum)


def _main_xml(sampled: SampledMap, digest: str) -> bytes:
    ny, nx = sampled.heights.shape
    axes = "".join(
        f"<C{name}><AxisType>I</AxisType><DataType>D</DataType>"
        f"<Increment>{step!r}</Increment><Offset>0</Offset></C{name}>"
        for name, step in zip("XY", sampled.spacing, strict=True)
    )
    axes += "<CZ><AxisType>A</AxisType><DataType>D</DataType></CZ>"
    return (
        '<?xml version="1.0" encoding="UTF-8"?>\n'
        '<p:ISO5436_2 xmlns:p="http://www.opengps.eu/2008/ISO5436_2">'
        "<Record1><Revision>ISO5436 - 2000</Revision><FeatureType>SUR</FeatureType>"
        f"<Axes>{axes}</Axes></Record1>"
        "<Record2><Date>1970-01-01T00:00:00</Date><Creator>asperity</Creator>"
        "<Instrument><Manufacturer>asperity</Manufacturer><Model>computed</Model>"
        f"<Serial>none</Serial><Version>{__version__}</Version></Instrument>"
        "<CalibrationDate>1970-01-01T00:00:00</CalibrationDate>"
        "<ProbingSystem><Type>Software</Type><Identification>asperity</Identification>"
        f"</ProbingSystem><Comment>{sampled.words}</Comment></Record2>"
        f"<Record3><MatrixDimension><SizeX>{nx}</SizeX><SizeY>{ny}</SizeY><SizeZ>1</SizeZ>"
        "</MatrixDimension><DataLink><PointDataLink>bindata/data.bin</PointDataLink>"
        f"<MD5ChecksumPointData>{digest.upper()}</MD5ChecksumPointData></DataLink></Record3>"
        "<Record4><ChecksumFile>md5checksum.hex</ChecksumFile></Record4></p:ISO5436_2>\n"
    ).encode()
