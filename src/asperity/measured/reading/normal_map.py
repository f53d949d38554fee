"""Read an image of normals: heights from the slopes that its three channels encode."""

from __future__ import annotations

import re
from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.memory import require_memory
from asperity.core.units import count_text
from asperity.measured.reader import RawSurface
from asperity.measured.slopes import IntegratedSlopes, integrate_slopes

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
    found = {
        direction: integrate_slopes(-normals[..., 0] / upward, sign * normals[..., 1] / upward)
        for direction, sign in (("up", 1.0), ("down", -1.0))
    }
    if green is None:
        raise _direction_error(name, found)
    surface = found.pop(green)
    (other,) = found.values()
    notes.append(f"no heights have {100.0 * surface.residue:.2g} % of the slopes (RMS residue)")
    if other.residue < 0.5 * surface.residue:
        (opposite,) = found
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


def _direction_error(name: str, found: dict[str, IntegratedSlopes]) -> ParameterError:
    residues = " and ".join(
        [f"{100.0 * one.residue:.2g} % with green {way}" for way, one in found.items()]
    )
    likely = min(found, key=lambda way: found[way].residue)
    return ParameterError(
        "green",
        f"is required: {name} is a normal map, whose green channel points up (glTF, OpenGL) or down"
        f" (DirectX) in the picture; no heights have {residues} of its slopes; give {{pitch}}"
        " {green}",
        pitch=5e-5,
        green=likely,
    )
