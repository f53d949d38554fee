"""The force field inside a recording: the very numbers that its kernels were given.

So a recording replays by itself: no surface file is read again, no scene made anew.
"""

from __future__ import annotations

import importlib
import io
import sys
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any, cast

import numpy as np

from asperity.checks import FloatArray
from asperity.content import formula_content, numbers_content, surface_content
from asperity.errors import ParameterError
from asperity.files import plain
from asperity.kernels.probe import CLAMPS, ClampName
from asperity.laws import Law, find_law
from asperity.surface import Surface

FILE = "texture.npz"
"""What the sampler is given, inside the recording."""
# More is not put into each recording: a map of 2400 x 2400 points.
MOST_BYTES = 2**26
_SHIPPED = "asperity."
_DAMAGE = (ValueError, KeyError, EOFError, OSError, TypeError, zipfile.BadZipFile)


@dataclass(frozen=True, eq=False)
class Field:
    """What kernels need for a force.

    Attributes:
        law: the law.
        clamp: that acts.
        sampler: modules whose functions evaluate the texture.
        texture: record that they are given.
        law_arguments: parameters of the law.
    """

    law: Law
    clamp: ClampName
    sampler: tuple[ModuleType, ...]
    texture: tuple[Any, ...]
    law_arguments: tuple[float, ...]

    def height(self, points: FloatArray) -> FloatArray:
        """Return the height of the texture [m], shape (n,), at points (n, 2) [m]."""
        from asperity.kernels.fuse import fuse_sampler

        out = np.empty((len(points), 1))
        places = np.ascontiguousarray(points, dtype=np.float64)
        fuse_sampler(self.sampler).height_batch(places, out, self.texture)
        return out[:, 0]


def field_of(surface: Surface) -> Field:
    """Return the field of a surface."""
    return Field(
        surface.law, surface.acting_clamp, surface.texture.sampler, surface.texture.arguments,
        surface.law_arguments,
    )  # fmt: skip


def describe_field(surface: Surface) -> dict[str, Any]:
    """Return what a recording says of its surface, as plain data."""
    texture = surface.texture
    return {
        "content": surface_content(surface),
        "texture": plain(texture.describe()),
        "texture_content": numbers_content(texture.arguments),
        "sampler": [module.__name__ for module in texture.sampler],
        "record": type(texture.arguments).__name__,
        "law": surface.law.letter,
        "law_name": surface.law.name,
        "formula": formula_content(surface.law),
        "clamp": surface.acting_clamp,
        "stiffness": surface.stiffness,
        "max_depth": surface.max_depth,
        "parameters": dict(surface.law_parameters),
        "law_arguments": [float(value).hex() for value in surface.law_arguments],
    }


def field_files(surface: Surface) -> dict[str, bytes]:
    """Return the file with what the sampler is given; none if it would be large."""
    arguments = surface.texture.arguments
    if sum(np.asarray(value).nbytes for value in arguments) > MOST_BYTES:
        return {}
    stream = io.BytesIO()
    np.savez(stream, *map(np.asarray, arguments))
    return {FILE: stream.getvalue()}


def read_field(said: Mapping[str, Any], data: bytes) -> Field:
    """Return the field that a recording holds.

    Args:
        said: what :func:`describe_field` said.
        data: the file of :func:`field_files`.

    Raises:
        ParameterError: for a law or a kind of texture that is not known here, or a damaged one.
    """
    try:
        law = find_law(str(said["law"]))
        clamp = cast(ClampName, CLAMPS[CLAMPS.index(said["clamp"])])
        sampler = tuple(_sampler_module(str(name)) for name in said["sampler"])
        kind = getattr(sampler[0], str(said["record"]))
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            values = [archive[f"arr_{i}"] for i in range(len(archive.files))]
        texture = kind(*(value if value.ndim else value.item() for value in values))
        parameters = tuple(float.fromhex(text) for text in said["law_arguments"])
    except ParameterError:
        raise
    except (*_DAMAGE, AttributeError, IndexError) as error:
        reason = f"its surface cannot be read ({type(error).__name__}: {error})"
        raise ParameterError("recording", reason) from None
    if numbers_content(texture) != said.get("texture_content"):
        raise ParameterError("recording", "holds another texture than it says: it is damaged")
    return Field(law, clamp, sampler, texture, parameters)


def _sampler_module(name: str) -> ModuleType:
    """Return a module by its name: of asperity's own, or one that the user has imported.

    A recording never imports code of others.
    """
    module = sys.modules.get(name)
    if module is None and name.startswith(_SHIPPED):
        module = importlib.import_module(name)
    if not hasattr(module, "KERNELS"):
        words = f"has a texture of a kind that is not known here ({name})"
        raise ParameterError("recording", f"{words}: name its file, --law-module FILE")
    return module  # type: ignore[return-value]  # None has no KERNELS
