"""Convert the pixels of an image to heights."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.reading.images.image_scale import NO_SCALE, ImageScale
from asperity.measured.reading.images.normal_maps import integrate_normal_map, is_normal_map
from asperity.measured.reading.raw_surface import RawSurface, check_point_count
from asperity.measured.reading.reader import ReadingOptions


@dataclass(frozen=True, eq=False)
class Pixels:
    """Pixels as stored in a file.

    Attributes:
        values: shape (rows, columns, channels), unsigned, signed or float.
        has_alpha: whether the last channel is opacity.
        notes: peculiarities of the file.
        scale: lengths that the file names.
    """

    values: NDArray[Any]
    has_alpha: bool
    notes: tuple[str, ...] = ()
    scale: ImageScale = NO_SCALE


def check_image_size(rows: int, columns: int) -> None:
    """Refuse an image without pixels or with too many, before any memory is allocated.

    Raises:
        SurfaceFileError: the size cannot be read.
    """
    if rows < 1 or columns < 1:
        raise SurfaceFileError(f"{columns} x {rows} pixels")
    check_point_count(columns, rows)


def pixels_to_surface(pixels: Pixels, name: str, options: ReadingOptions) -> RawSurface:
    """Convert pixels to heights: their values, or the integrated slopes of a normal map.

    Row i is row i of the image from the top, so that y runs down the image.

    Args:
        pixels: the image.
        name: name of the file.
        options: ``integrate_normals``, without which a normal map is refused, and ``unit``.

    Returns:
        Heights, without a unit unless the file or the options name one; the pitch if the file
        has one.

    Raises:
        SurfaceFileError: colours, transparency, or a normal map without ``integrate_normals``.
        ParameterError: ``integrate_normals`` for an image that is no normal map; a unit for slopes,
            or for a file that names its own.
    """
    values, notes = _drop_alpha(pixels)
    pitch, integrate = pixels.scale.pitch, options.integrate_normals
    if is_normal_map(values):
        if not integrate:
            raise SurfaceFileError(
                "looks like a normal map (slopes as colours), not like heights;"
                " have it integrated to heights with integrate_normals=True (--integrate-normals)"
            )
        if options.unit is not None:
            raise ParameterError("unit", f"must not be given: {name} holds slopes, without unit")
        heights, found = integrate_normal_map(values)
        notes = (*notes, *found)
        return RawSurface(
            heights, pitch, name, notes, has_units=False, relative=True, per_pitch=True
        )
    if integrate:
        requirement = f"must be False: {name} is not a normal map"
        raise ParameterError("integrate_normals", requirement, integrate)
    grey, notes = _to_grey(values, notes)
    with np.errstate(invalid="ignore"):  # a signalling NaN is a missing point too
        heights = grey.astype(np.float64)
    heights = pixels.scale.factor * heights + pixels.scale.offset
    unit, assumed = options.resolve_unit(name, pixels.scale.metres_per_value)
    if unit is None:
        note = "an image has no unit: heights are pixel values, y runs down the image"
        return RawSurface(heights, pitch, name, (*notes, note), has_units=False, relative=True)
    return RawSurface(unit * heights, pitch, name, (*notes, *assumed, "y runs down the image"))


def _drop_alpha(pixels: Pixels) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Return the pixels without an alpha channel, which must be opaque everywhere."""
    values = pixels.values
    if not pixels.has_alpha:
        return values, pixels.notes
    alpha = values[..., -1]
    opaque = np.iinfo(alpha.dtype).max if alpha.dtype.kind in "iu" else 1.0
    transparent = int(np.count_nonzero(alpha != opaque))
    if transparent:
        raise SurfaceFileError(
            f"{transparent} of {alpha.size} pixels are transparent; transparency has no height:"
            " save the image without an alpha channel"
        )
    return values[..., :-1], (*pixels.notes, "alpha channel dropped: opaque everywhere")


def _to_grey(values: NDArray[Any], notes: tuple[str, ...]) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Return the only channel, or the first of three equal ones."""
    channels, first = values.shape[-1], values[..., 0]
    if channels == 1:
        return first, notes
    if channels != 3:
        raise SurfaceFileError(f"has {channels} channels; one channel of heights is expected")
    is_float = first.dtype.kind == "f"
    if all(np.array_equal(first, values[..., k], equal_nan=is_float) for k in (1, 2)):
        return first, (*notes, "three equal channels: read as one grey image")
    raise SurfaceFileError(
        "is a colour image: its three channels differ, and a colour is no height;"
        " save the heights as a grey image (16 bit if possible)"
    )
