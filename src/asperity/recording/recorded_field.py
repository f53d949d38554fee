"""The force field inside a recording: the arguments of its kernels.

A recording replays by itself, without its surface file or scene.
"""

from __future__ import annotations

import importlib
import io
import sys
import zipfile
from collections.abc import Mapping
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.core.files import Serializable, content_digest, text_digest, to_plain_data
from asperity.kernels.fuse import fuse_on_texture, kernel_source
from asperity.kernels.tick import least_limited_square
from asperity.laws import Law, find_law
from asperity.laws.clamps import Clamp, find_clamp
from asperity.recording import replay_trace
from asperity.surface import Surface

TEXTURE_FILE = "texture.npz"
"""Name of the attachment with the arguments of the sampler."""
# Largest attachment of a recording: a map of 2400 x 2400 points.
MAX_BYTES = 2**26
_PACKAGE_PREFIX = "asperity."
_DAMAGE_ERRORS = (ValueError, KeyError, EOFError, OSError, TypeError, zipfile.BadZipFile)


@dataclass(frozen=True, eq=False)
class RecordedField:
    """The arguments of the kernels of a force.

    Attributes:
        law: the law.
        clamp: the depth clamp.
        sampler: modules whose functions evaluate the texture.
        texture: record of the texture.
        law_arguments: parameters of the law, and of friction.
        has_friction: whether the surface has friction.
    """

    law: Law
    clamp: Clamp
    sampler: tuple[ModuleType, ...]
    texture: tuple[Any, ...]
    law_arguments: tuple[float, ...]
    has_friction: bool = False

    def height(self, points: FloatArray) -> FloatArray:
        """Return the height of the texture [m], shape (n,), at points (n, 2) [m]."""
        from asperity.kernels.fuse import fuse_sampler

        out = np.empty((len(points), 1))
        places = np.ascontiguousarray(points, dtype=np.float64)
        fuse_sampler(self.sampler).height_batch(places, out, self.texture)
        return out[:, 0]

    def depths(self, points: FloatArray) -> FloatArray:
        """Return the depths [m], shape (n,), of probes (n, 3) [m]; 0 out of contact."""
        loops = fuse_on_texture(self.law, self.sampler, self.clamp, (replay_trace,))
        out = np.empty(len(points))
        loops.depth_batch(np.ascontiguousarray(points), out, self.texture)
        return out


@dataclass
class LimitCounts(Serializable):
    """Samples of a loop at the force limit of the device and below ``max_depth``.

    Attributes:
        max_force: the length to which forces are limited [N].
        force_resolution: step to which they are then rounded [N].
        max_depth: depth for which the surface was analysed [m].
        force_limited: number of samples whose force was limited, or that rounding leaves open.
        too_deep: number of samples below ``max_depth``.
        deepest: greatest depth of these [m]; 0 for none.

    Example:
        >>> counts = LimitCounts(max_force=2.0, force_resolution=0.0, max_depth=1e-3)
        >>> counts.count(np.array([[0.0, 0.0, 2.0], [0.0, 0.0, 1.9]]), np.array([3e-3, 0.5e-3]))
        >>> counts.force_limited, counts.too_deep, counts.deepest
        (1, 1, 0.003)
    """

    max_force: float
    force_resolution: float
    max_depth: float
    force_limited: int = 0
    too_deep: int = 0
    deepest: float = 0.0

    def count(self, forces: FloatArray, depths: FloatArray) -> None:
        """Count samples with forces (n, 3) [N], and the depths of some (m,) [m]."""
        squares = np.square(forces).sum(axis=1)
        least = least_limited_square(self.max_force, self.force_resolution)
        deep = depths[depths > self.max_depth]
        self.force_limited += int(np.count_nonzero(squares >= least))
        self.too_deep += len(deep)
        self.deepest = float(deep.max(initial=self.deepest))


def surface_field(surface: Surface) -> RecordedField:
    """Return the field of a surface."""
    return RecordedField(
        surface.law,
        surface.effective_clamp,
        surface.texture.sampler,
        surface.texture.arguments,
        surface.loop_arguments,
        surface.contact_friction is not None,
    )


def field_metadata(surface: Surface) -> dict[str, Any]:
    """Return the metadata of a surface in a recording, as plain data."""
    texture = surface.texture
    return {
        "content": surface.digest,
        "texture": to_plain_data(texture.describe()),
        "texture_content": arguments_digest(texture.arguments),
        "sampler": [module.__name__ for module in texture.sampler],
        "record": type(texture.arguments).__name__,
        "law": surface.law.letter,
        "law_name": surface.law.name,
        "formula": formula_digest(surface.law),
        "clamp": surface.effective_clamp.name,
        "stiffness": surface.stiffness,
        "max_depth": surface.max_depth,
        "parameters": dict(surface.law_parameters),
        "law_arguments": [float(value).hex() for value in surface.loop_arguments],
        "friction": surface.friction_values,
    }


def arguments_digest(arguments: tuple[Any, ...]) -> str:
    """Return a digest of the record that a sampler receives."""
    return content_digest(*map(np.asarray, arguments))


def formula_digest(law: Law) -> str:
    """Return a digest of the compiled formula of a law."""
    return text_digest(kernel_source(law))


def field_attachments(surface: Surface) -> dict[str, bytes]:
    """Return the attachment with the arguments of the sampler; none if it would be large."""
    arguments = surface.texture.arguments
    if sum([np.asarray(value).nbytes for value in arguments]) > MAX_BYTES:
        return {}
    stream = io.BytesIO()
    np.savez(stream, *map(np.asarray, arguments))
    return {TEXTURE_FILE: stream.getvalue()}


def read_field(metadata: Mapping[str, Any], data: bytes) -> RecordedField:
    """Return the field inside a recording.

    Args:
        metadata: metadata by :func:`field_metadata`.
        data: attachment by :func:`field_attachments`.

    Raises:
        ParameterError: for an unknown law or texture kind, or a damaged attachment.
    """
    try:
        law = find_law(str(metadata["law"]))
        clamp = find_clamp(str(metadata["clamp"]))
        modules = [_sampler_module(str(name)) for name in metadata["sampler"]]
        parts = [part for module in modules for part in getattr(module, "PARTS", ())]
        sampler = tuple(dict.fromkeys([*modules, *parts]))
        kind = getattr(sampler[0], str(metadata["record"]))
        with np.load(io.BytesIO(data), allow_pickle=False) as archive:
            values = [_to_scalar(archive[name]) for name in archive.files]
        texture = kind(*values)
        parameters = tuple(map(float.fromhex, metadata["law_arguments"]))
    except ParameterError:
        raise
    except (*_DAMAGE_ERRORS, AttributeError, IndexError) as error:
        reason = f"its surface cannot be read ({type(error).__name__}: {error})"
        raise ParameterError("recording", reason) from None
    if metadata.get("texture_content") != arguments_digest(texture):
        raise ParameterError("recording", "holds another texture than its metadata: it is damaged")
    return RecordedField(law, clamp, sampler, texture, parameters, bool(metadata.get("friction")))


def _to_scalar(value: NDArray[Any]) -> Any:
    """Return the number in an array without axes; other arrays as they are."""
    return value if value.ndim else value.item()


def _sampler_module(name: str) -> ModuleType:
    """Return a module of asperity, or one that the user has imported, by its name.

    A recording never imports other code.
    """
    module = sys.modules.get(name)
    if module is None and name.startswith(_PACKAGE_PREFIX):
        module = importlib.import_module(name)
    if not hasattr(module, "KERNELS"):
        reason = f"has a texture of an unknown kind ({name})"
        raise ParameterError("recording", f"{reason}: name its file as {{plugin}}", plugin=None)
    return module  # type: ignore[return-value]  # None has no KERNELS
