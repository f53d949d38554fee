"""Height maps and normal maps of a texture, and their files.

In all files x goes to the right and y down, starting with row 0.
"""

from __future__ import annotations

import hashlib
import io
import struct
import zipfile
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError, suggest_names
from asperity.core.units import format_quantity
from asperity.core.version import __version__
from asperity.export.c_language import fill_template, load_template
from asperity.textures.texture import Texture

# Number of equal rows in the map of a profile.
_PROFILE_ROWS = 16
_MIN_POINTS = 4
_MAX_POINTS = 8192
Pair = float | Sequence[float]


@dataclass(frozen=True, eq=False)
class SampledMap:
    """Heights and normals of a texture at the points of a grid.

    Attributes:
        heights: [m], shape (ny, nx); row i lies i spacings along y from the first.
        normals: unit normals (x, y, z) along the axes of the grid, shape (ny, nx, 3).
        spacing: distance of the points along x and y [m].
        is_periodic: whether the grid is whole periods, so that the map can be tiled.
        region: description of the region.
    """

    heights: FloatArray
    normals: FloatArray
    spacing: tuple[float, float]
    is_periodic: bool
    region: str

    def __repr__(self) -> str:
        return f"<SampledMap of {self.description}>"

    @property
    def size(self) -> tuple[float, float]:
        """Width and height of the map [m]; each point covers one spacing."""
        ny, nx = self.heights.shape
        return nx * self.spacing[0], ny * self.spacing[1]

    @property
    def description(self) -> str:
        """Description of the map."""
        ny, nx = self.heights.shape
        steps = dict.fromkeys([format_quantity(step, "m") for step in self.spacing])
        return f"{self.region}, {nx} x {ny} points, {' x '.join(steps)} apart"

    @property
    def file_text(self) -> str:
        """The text in a file; :func:`asperity.measured.reader.states_periodic` reads its end."""
        periodic = "; periodic" if self.is_periodic else ""
        return f"{_LAYOUT}; {self.description}; asperity {__version__}{periodic}"


def sample_map(
    texture: Texture, extent: Pair | None = None, spacing: Pair | None = None
) -> SampledMap:
    """Return heights and normals on a grid.

    Args:
        texture: the texture.
        extent: size of the map along x and y [m]; default: one period or the whole surface, along
            its own axes; for a sum without a period, 16 of its longest waves.
        spacing: distance of the points along x and y [m]; default: that of a measured map, else
            an eighth of the shortest wave.

    Raises:
        ParameterError: for a length that is not positive, or a grid of fewer than 4 or more than
            8192 points along a side.

    Example:
        >>> import asperity as asp
        >>> sample_map(asp.Sinusoid(amplitude=0.2e-3, period=2e-3))
        <SampledMap of one period, 16 x 16 points, 125 µm apart>
    """
    domain = texture.domain
    if extent is None and spacing is None:
        points, steps, repeats = domain.grid(texture.grid_counts())
        if len(points) == 1:  # all rows of a profile are equal
            points = np.repeat(points, _PROFILE_ROWS, axis=0)
            steps = (steps[0], steps[0])
        spans = domain.orthogonal_spans()[0]
        along = spans[0] / np.hypot(*spans[0])
        return _evaluate_map(texture, points, steps, along, repeats, domain.description)
    sides = np.hypot(*domain.orthogonal_spans()[0].T)
    own = domain.grid(texture.grid_counts())[1]
    if len(sides) == 1:
        own = (own[0], own[0])
    steps = _check_pair("spacing", spacing) or own
    size = _check_pair("extent", extent) or (float(sides[0]), float(sides[-1]))
    counts = [_point_count(side, step) for side, step in zip(size, steps, strict=True)]
    ticks = [step * np.arange(count) for step, count in zip(steps, counts, strict=True)]
    points = domain.origin + np.stack(np.meshgrid(*ticks), axis=-1)
    region = " x ".join([format_quantity(side, "m") for side in size])
    repeats = domain.repeats_after(counts[0] * steps[0], counts[1] * steps[1])
    return _evaluate_map(texture, points, steps, np.array([1.0, 0.0]), repeats, region)


def _point_count(side: float, step: float) -> int:
    count = _MAX_POINTS + 1
    if side / step < 1e9:
        count = round(side / step)
    if not _MIN_POINTS <= count <= _MAX_POINTS:
        points = f"gives {count} points on {format_quantity(side, 'm')}"
        requirement = f"{points}; {_MIN_POINTS} to {_MAX_POINTS} are allowed"
        raise ParameterError("spacing", requirement, step)
    return count


def _check_pair(name: str, value: Pair | None) -> tuple[float, float] | None:
    if value is None:
        return None
    if isinstance(value, (int, float)):
        value = (value, value)
    if len(value) != 2:
        raise ParameterError(name, "must be one length, or two for x and y [m]", value)
    return check_positive(name, value[0], "m"), check_positive(name, value[1], "m")


def _evaluate_map(
    texture: Texture,
    points: FloatArray,
    steps: tuple[float, float],
    along: FloatArray,
    is_periodic: bool,
    region: str,
) -> SampledMap:
    shape = points.shape[:2]
    flat = np.ascontiguousarray(points.reshape(-1, 2))
    heights = texture.height(flat)
    slopes = texture.gradient(flat)
    across = np.array([-along[1], along[0]])
    normals = np.column_stack([-slopes @ along, -slopes @ across, np.ones(len(flat))])
    normals /= np.sqrt((normals**2).sum(axis=1))[:, None]
    return SampledMap(
        heights.reshape(shape),
        normals.reshape(*shape, 3),
        (float(steps[0]), float(steps[1])),
        is_periodic,
        region,
    )


_LAYOUT = "x to the right, y down"


@dataclass(frozen=True)
class NormalConvention:
    """Encoding of normals: zero + scale * (x to the right, y up, z out of the surface).

    Attributes:
        description: name of the convention.
        zero: byte of a component 0.
        scale: difference of the bytes of 1 and 0.
    """

    description: str
    zero: float
    scale: float

    def encode(self, normals: FloatArray) -> NDArray[np.uint8]:
        """Return the bytes of normals along x, y (down) and z."""
        upward = normals * (1.0, -1.0, 1.0)
        return np.rint(self.zero + self.scale * upward).astype(np.uint8)

    def decode(self, pixels: NDArray[np.uint8]) -> FloatArray:
        """Return the unit normals that a program reads."""
        upward = (pixels - self.zero) / self.scale * (1.0, -1.0, 1.0)
        return np.asarray(upward / np.sqrt((upward**2).sum(axis=-1))[..., None])


CONVENTIONS = {
    # Red and green [0, 255] are [-1, 1], green up, as in OpenGL.
    "gltf": NormalConvention("glTF 2.0, material.normalTexture", 127.5, 127.5),
    # As cAlgorithmFingerProxy reads it; a PNG's last row is the first of its cImage.
    "chai3d": NormalConvention("CHAI3D, cNormalMap", 128.0, 127.0),
}


def height_png(surface_map: SampledMap) -> bytes:
    """Return a 16-bit grey PNG: 0 is the minimum height, 65535 the maximum.

    The chunk sCAL holds the size of a pixel, pCAL the heights in metres.

    Reference:
        Extensions to the PNG 1.2 specification, 1.2.0: sCAL, pCAL.
    """
    low, span = _height_range(surface_map.heights)
    grey = np.rint((surface_map.heights - low) / (span / 65535.0)).astype(np.uint16)
    calibration = b"asperity\0" + struct.pack(">iiBB", 0, 65535, 0, 2)
    calibration += f"m\0{low!r}\0{span!r}".encode()
    return _encode_png(surface_map, grey, b"pCAL", calibration, "Heights")


def height_tiff(surface_map: SampledMap) -> bytes:
    """Return a TIFF of 32-bit floats with heights in micrometres, as ImageJ writes and reads it."""
    import tifffile

    stream = io.BytesIO()
    px, py = surface_map.spacing
    metadata = {"unit": "um", "vunit": "um", "Info": f"Heights; {surface_map.file_text}"}
    heights = (1e6 * surface_map.heights).astype(np.float32)
    resolution = 1e-6 / px, 1e-6 / py
    tifffile.imwrite(stream, heights, imagej=True, metadata=metadata, resolution=resolution)
    return stream.getvalue()


def height_x3p(surface_map: SampledMap) -> bytes:
    """Return an X3P with heights in metres as 64-bit floats.

    Reference:
        ISO 25178-72:2017.
    """
    points = np.ascontiguousarray(surface_map.heights, dtype="<f8").tobytes()
    main = _x3p_main_xml(surface_map, hashlib.md5(points, usedforsecurity=False).hexdigest())
    digest = hashlib.md5(main, usedforsecurity=False).hexdigest()
    stream = io.BytesIO()
    with zipfile.ZipFile(stream, "w", zipfile.ZIP_DEFLATED) as archive:
        archive.writestr(zipfile.ZipInfo("main.xml"), main)
        archive.writestr(zipfile.ZipInfo("md5checksum.hex"), f"{digest} *main.xml\n")
        archive.writestr(zipfile.ZipInfo("bindata/data.bin"), points)
    return stream.getvalue()


def normal_png(surface_map: SampledMap, convention: str = "gltf") -> bytes:
    """Return an 8-bit PNG of normals: red x, green y (up), blue z.

    Args:
        surface_map: the map.
        convention: ``"gltf"`` or ``"chai3d"``.

    Raises:
        ParameterError: for an unknown convention.

    Reference:
        glTF 2.0, 3.9.3 and material.normalTexture; CHAI3D 3.2, cAlgorithmFingerProxy.
    """
    rule = find_convention(convention)
    pixels = rule.encode(surface_map.normals)
    description = f"Normals, {rule.description}; green up"
    return _encode_png(surface_map, pixels, b"", b"", description)


def find_convention(name: str) -> NormalConvention:
    """Return a convention by its name.

    Raises:
        ParameterError: for an unknown name.
    """
    if name.lower() not in CONVENTIONS:
        hint = suggest_names(name, CONVENTIONS)
        raise ParameterError("normals", f"is an unknown convention: {name!r}; {hint}")
    return CONVENTIONS[name.lower()]


HEIGHT_MAPS: dict[str, Callable[[SampledMap], bytes]] = {
    ".png": height_png,
    ".tif": height_tiff,
    ".tiff": height_tiff,
    ".x3p": height_x3p,
}


def height_resolution(surface_map: SampledMap, suffix: str) -> float:
    """Return the largest error of a height in a file [m]."""
    if suffix == ".x3p":
        return 0.0
    if suffix == ".png":
        return 0.5 * _height_range(surface_map.heights)[1] / 65535.0
    largest = np.float32(1e6 * np.abs(surface_map.heights).max(initial=0.0))
    return 0.5e-6 * float(np.spacing(largest))


def normal_error(surface_map: SampledMap, convention: str) -> float:
    """Return the largest angle between a normal and its decoded value [rad]."""
    rule = find_convention(convention)
    read = rule.decode(rule.encode(surface_map.normals))
    # The chord is accurate for small angles, in contrast to the cosine.
    chord = np.sqrt(((read - surface_map.normals) ** 2).sum(axis=-1))
    return float(2.0 * np.arcsin(np.minimum(0.5 * chord, 1.0)).max())


def _height_range(heights: FloatArray) -> tuple[float, float]:
    """Return the minimum height and the range [m]; the range of a flat map is 1 nm."""
    low = float(heights.min())
    return low, float(heights.max()) - low or 1e-9


def _encode_png(
    surface_map: SampledMap, pixels: NDArray[Any], kind: bytes, data: bytes, description: str
) -> bytes:
    """Return a PNG; Pillow does not write the chunks sCAL and pCAL, which are inserted."""
    from PIL import Image, PngImagePlugin

    text = PngImagePlugin.PngInfo()
    description = f"{description}; {surface_map.file_text}"
    text.add_text("Description", description.encode("latin-1", "replace").decode("latin-1"))
    stream = io.BytesIO()
    Image.fromarray(pixels).save(stream, "png", pnginfo=text)
    size = "\0".join(map(repr, surface_map.spacing))
    chunks = io.BytesIO()
    PngImagePlugin.putchunk(chunks, b"sCAL", b"\x01" + size.encode())
    if kind:
        PngImagePlugin.putchunk(chunks, kind, data)
    png = stream.getvalue()
    return png[:_PNG_HEADER_SIZE] + chunks.getvalue() + png[_PNG_HEADER_SIZE:]


_PNG_HEADER_SIZE = 8 + 25  # signature and chunk IHDR


def _x3p_main_xml(surface_map: SampledMap, digest: str) -> bytes:
    (ny, nx) = surface_map.heights.shape
    (dx, dy) = surface_map.spacing
    values = {"nx": str(nx), "ny": str(ny), "dx": repr(dx), "dy": repr(dy)}
    values |= {"version": __version__, "comment": surface_map.file_text}
    declaration, *lines = load_template("x3p_main.xml").splitlines()
    text = f"{declaration}\n{''.join(map(str.strip, lines))}\n"
    return fill_template(text, values | {"checksum": digest.upper()}).encode()
