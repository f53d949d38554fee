"""Read an image of normals: heights by least squares from the slopes that its channels encode."""

from __future__ import annotations

import re
from dataclasses import dataclass, replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.memory import require_memory
from asperity.core.units import count_text
from asperity.measured.reader import RawSurface

_MAX_LENGTH_ERROR = 0.1  # of the normals, mean; an image of anything else has more
_MIN_Z = 0.05  # least height of a normal over the plane: flanks of 87°
# How libraries of assets name the direction of green in a file's name.
_NAMED = {"up": r"(gl|ogl|opengl|gltf)", "down": r"(dx|directx|d3d)"}
_WORD = r"(?:nor|nrm|norm|normals?)[-_ .]?{}(?![a-z])"


def decode_normals(values: NDArray[Any]) -> FloatArray | None:
    """Return the normals of an image, x to the right, green, z; ``None`` for any other image.

    Args:
        values: pixels, shape (rows, columns, 3).
    """
    if values.shape[-1] != 3 or values.dtype.kind != "u":
        return None
    normals = 2.0 * values.astype(np.float64) / np.iinfo(values.dtype).max - 1.0
    lengths = np.sqrt((normals**2).sum(axis=-1))
    is_unit = float(np.abs(lengths - 1.0).mean()) < _MAX_LENGTH_ERROR
    return normals if is_unit and float(normals[..., 2].mean()) > 0.3 else None


def normals_to_surface(normals: FloatArray, name: str, green: str | None) -> RawSurface:
    """Return the heights whose slopes are nearest to those of normals.

    Args:
        normals: as of :func:`decode_normals`.
        name: of the file, which may name the direction of green.
        green: "up" or "down", the direction in the picture that green encodes.

    Returns:
        Heights in units of the pitch, which is to be given.

    Raises:
        ParameterError: for a direction that is neither given nor in the name.
    """
    notes = ["a normal map: heights by least squares from its slopes, y runs down the image"]
    if green is None:
        green = _find_named_direction(name)
        notes.append(f"green is {green} according to the file's name")
    rows, columns = normals.shape[:2]
    require_memory(2 * columns, 2 * rows)  # mirrored
    upward = np.maximum(normals[..., 2], _MIN_Z)
    candidates = {
        direction: integrate_slopes(-normals[..., 0] / upward, sign * normals[..., 1] / upward)
        for direction, sign in (("up", 1.0), ("down", -1.0))
    }
    if green is None:
        raise _direction_error(name, candidates)
    surface = candidates.pop(green)
    (other,) = candidates.values()
    notes.append(f"no heights have {100.0 * surface.residue:.2g} % of the slopes (RMS residue)")
    if other.residue < 0.5 * surface.residue:
        (opposite,) = candidates
        notes.append(f"with green {opposite} only {100.0 * other.residue:.2g} %: is it {green}?")
    border = "its borders fit: one period" if surface.is_periodic else "mirrored at its borders"
    notes.append(border)
    flat = int(np.count_nonzero(normals[..., 2] < _MIN_Z))
    if flat:
        notes.append(
            f"flanks of 87° in place of {count_text(flat, 'normal')} that point sideways or down"
        )
    return replace(RawSurface(surface.heights, None, name, tuple(notes)), in_pitches=True)


def _find_named_direction(name: str) -> str | None:
    stem = name.rpartition(".")[0].lower()
    return next((up for up, words in _NAMED.items() if re.search(_WORD.format(words), stem)), None)


def _direction_error(name: str, candidates: dict[str, IntegratedSlopes]) -> ParameterError:
    residues = " and ".join(
        [f"{100.0 * slopes.residue:.2g} % with green {way}" for way, slopes in candidates.items()]
    )
    likely = min(candidates, key=lambda way: candidates[way].residue)
    return ParameterError(
        "green",
        f"is required: {name} is a normal map, whose green channel points up (glTF, OpenGL) or down"
        f" (DirectX) in the picture; no heights have {residues} of its slopes; give {{pitch}}"
        " {green}",
        pitch=5e-5,
        green=likely,
    )


_MAX_SEAM = 1.5  # greatest change of the slopes over a border that fits, relative to the others


@dataclass(frozen=True, eq=False)
class IntegratedSlopes:
    """Heights whose slopes are nearest to given ones.

    Attributes:
        heights: in units of the pitch, shape (ny, nx), with a mean of zero.
        residue: RMS of the slopes that no heights have, over the RMS of all slopes [1]; 0 for the
            slopes of a surface.
        is_periodic: whether the heights repeat; else they were mirrored at their borders.
    """

    heights: FloatArray
    residue: float
    is_periodic: bool


def integrate_slopes(along_x: FloatArray, along_y: FloatArray) -> IntegratedSlopes:
    r"""Return the heights whose slopes are nearest to given ones.

    The heights h minimize :math:`\sum |\nabla h - (p, q)|^2`. In Fourier space, with wave numbers
    k, :math:`\hat h = -i (k_x \hat p + k_y \hat q) / |k|^2`. Slopes that fit across opposite
    borders are taken as periodic; others are mirrored: heights are continuous at the borders.

    Args:
        along_x: slopes p along the rows [1], shape (ny, nx).
        along_y: slopes q along the columns [1], likewise.

    Reference:
        R. T. Frankot and R. Chellappa, A method for enforcing integrability in shape from shading
        algorithms, IEEE Transactions on Pattern Analysis and Machine Intelligence 10(4), 1988.

    Example:
        >>> x = 2.0 * np.pi * np.arange(32) / 32
        >>> slopes = np.tile(np.cos(x), (16, 1))
        >>> found = integrate_slopes(slopes, np.zeros_like(slopes))
        >>> bool(np.allclose(found.heights[0], 32.0 / (2.0 * np.pi) * np.sin(x))), found.is_periodic
        (True, True)
    """
    is_periodic = all(
        _fits_across(slopes, axis) for slopes in (along_x, along_y) for axis in (0, 1)
    )
    if is_periodic:
        return _solve(along_x, along_y, is_periodic=True)
    solved = _solve(_mirror(along_x, odd_axis=1), _mirror(along_y, odd_axis=0), is_periodic=False)
    rows, columns = along_x.shape
    heights = solved.heights[:rows, :columns]
    return IntegratedSlopes(heights - heights.mean(), solved.residue, is_periodic=False)


def _fits_across(slopes: FloatArray, axis: int) -> bool:
    """Return whether the slopes change over the border no more than elsewhere along an axis."""
    changes = np.square(np.diff(slopes, axis=axis, append=np.take(slopes, [0], axis=axis)))
    lines = changes.mean(axis=1 - axis)
    return bool(lines[-1] <= _MAX_SEAM**2 * max(lines[:-1].mean(), 1e-12))


def _mirror(slopes: FloatArray, odd_axis: int) -> FloatArray:
    """Return slopes of heights that are mirrored at their borders: odd along one axis."""
    for axis in (0, 1):
        sign = -1.0 if axis == odd_axis else 1.0
        slopes = np.concatenate([slopes, sign * np.flip(slopes, axis)], axis)
    return slopes


def _solve(along_x: FloatArray, along_y: FloatArray, *, is_periodic: bool) -> IntegratedSlopes:
    """Return the heights with these slopes, which repeat."""
    rows, columns = along_x.shape
    wave_x = _wave_numbers(columns)[: columns // 2 + 1][None, :]
    wave_y = _wave_numbers(rows)[:, None]
    square = wave_x**2 + wave_y**2
    is_constant = square == 0.0
    transform_x = np.fft.rfft2(along_x)
    transform_y = np.fft.rfft2(along_y)
    heights = -1j * (wave_x * transform_x + wave_y * transform_y)
    heights /= np.where(is_constant, 1.0, square)
    size = (rows, columns)
    fitted_x = np.fft.irfft2(1j * wave_x * heights, size)
    fitted_y = np.fft.irfft2(1j * wave_y * heights, size)
    # A mean slope is a tilt, which levelling removes: it counts neither as residue nor as slope.
    total = np.square(along_x - along_x.mean()) + np.square(along_y - along_y.mean())
    missed = np.square(along_x - along_x.mean() - fitted_x)
    missed += np.square(along_y - along_y.mean() - fitted_y)
    residue = float(np.sqrt(missed.sum() / max(total.sum(), 1e-300)))
    return IntegratedSlopes(np.fft.irfft2(heights, size), residue, is_periodic)


def _wave_numbers(count: int) -> NDArray[np.float64]:
    """Return the wave numbers [rad per point]; zero for the wave of two points, without slope."""
    waves = np.asarray(2.0 * np.pi * np.fft.fftfreq(count), dtype=np.float64)
    if count % 2 == 0:
        waves[count // 2] = 0.0
    return waves
