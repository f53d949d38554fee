"""What a grid of pixels may be before it counts as heights: grey, opaque, one picture."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.errors import ParameterError, SurfaceFileError
from asperity.measured.reading.normals import integrate, is_normal_map
from asperity.measured.reading.raw import MAX_POINTS, RawSurface
from asperity.measured.reading.tiff_scale import NO_SCALE, Scale
from asperity.memory import reserve

_INTEGRATE = "integrate_normals"


@dataclass(frozen=True, eq=False)
class Pixels:
    """Pixels as stored.

    Attributes:
        values: shape (rows, columns, channels), unsigned, signed or float.
        alpha: True where the last channel is opacity.
        notes: what was odd about the file.
        scale: what the file says of lengths.
    """

    values: NDArray[Any]
    alpha: bool
    notes: tuple[str, ...] = ()
    scale: Scale = NO_SCALE


def check_size(rows: int, columns: int) -> None:
    """Refuse a picture without pixels or with too many, before memory is asked for.

    Raises:
        SurfaceFileError: the size cannot be read.
    """
    if rows < 1 or columns < 1:
        raise SurfaceFileError(f"{columns} x {rows} pixels")
    if rows * columns > MAX_POINTS:
        raise SurfaceFileError(f"{columns} x {rows} pixels; at most {MAX_POINTS} are read")
    reserve(columns, rows)


def surface_of_pixels(
    pixels: Pixels, name: str, *, integrate_normals: bool, metres: float | None = None
) -> RawSurface:
    """Turn pixels into heights: values as they are, or integrated slopes of a normal map.

    Row i is the picture's row i from the top, so y runs down the picture.

    Args:
        pixels: the picture.
        name: name of the file.
        integrate_normals: whether a normal map is integrated; refused otherwise.
        metres: per value, as the user says; None for not said.

    Returns:
        Heights without a unit unless the file or the user names one, the pitch where the file
        has one.

    Raises:
        SurfaceFileError: colours, transparency, or a normal map that nobody asked to integrate.
        ParameterError: integrate_normals for a picture that is no normal map; a unit for slopes,
            or for a file that names its own.
    """
    values, notes = _opaque(pixels)
    pitch = pixels.scale.pitch
    if is_normal_map(values):
        if not integrate_normals:
            raise SurfaceFileError(
                "looks like a normal map (slopes as colours), not like heights;"
                " have it integrated to heights with integrate_normals=True (--integrate-normals)"
            )
        if metres is not None:
            raise ParameterError("unit", f"must not be given: {name} holds slopes, without unit")
        heights, found = integrate(values)
        return RawSurface(
            heights, pitch, name, (*notes, *found), has_units=False, relative=True, per_pitch=True
        )
    if integrate_normals:
        raise ParameterError(
            _INTEGRATE, f"must be False: {name} is not a normal map", integrate_normals
        )
    grey, notes = _grey(values, notes)
    with np.errstate(invalid="ignore"):  # a signalling NaN is a missing point too
        heights = grey.astype(np.float64)
    heights = pixels.scale.factor * heights + pixels.scale.offset
    unit = pixels.scale.unit
    if unit is not None and metres is not None:
        raise ParameterError("unit", f"must not be given: {name} names its unit")
    if unit is None:
        unit = metres
    if unit is None:
        note = "an image has no unit: heights are pixel values, y runs down the image"
        return RawSurface(heights, pitch, name, (*notes, note), has_units=False, relative=True)
    given = () if metres is None else (f"no unit in the file: {metres:g} m a value as given",)
    return RawSurface(unit * heights, pitch, name, (*notes, *given, "y runs down the image"))


def _opaque(pixels: Pixels) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Drop an opacity that is full everywhere, refuse any other."""
    values = pixels.values
    if not pixels.alpha:
        return values, pixels.notes
    alpha = values[..., -1]
    full = np.iinfo(alpha.dtype).max if alpha.dtype.kind in "iu" else 1.0
    clear = int(np.count_nonzero(alpha != full))
    if clear:
        raise SurfaceFileError(
            f"{clear} of {alpha.size} pixels are transparent; transparency has no height:"
            " save the image without an alpha channel"
        )
    return values[..., :-1], (*pixels.notes, "alpha channel dropped: opaque everywhere")


def _grey(values: NDArray[Any], notes: tuple[str, ...]) -> tuple[NDArray[Any], tuple[str, ...]]:
    """Return the one channel there is, or that all channels repeat."""
    channels = values.shape[-1]
    first = values[..., 0]
    if channels == 1:
        return first, notes
    if channels == 3 and all(
        np.array_equal(first, values[..., k], equal_nan=first.dtype.kind == "f") for k in (1, 2)
    ):
        return first, (*notes, "three equal channels: read as one grey image")
    if channels == 3:
        raise SurfaceFileError(
            "is a colour image: its three channels differ, and a colour is no height;"
            " save the heights as a grey image (16 bit if possible)"
        )
    raise SurfaceFileError(f"has {channels} channels; one channel of heights is expected")
