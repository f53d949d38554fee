"""What a surface is, as a hash: the same wherever the same numbers go into the same formula."""

from __future__ import annotations

import hashlib
from collections.abc import Iterable
from typing import Any

import numpy as np

from asperity.files import digest
from asperity.kernels.fuse import kernel_source
from asperity.laws import Law
from asperity.surface import Surface


def numbers_content(arguments: Iterable[Any]) -> str:
    """Return a hash of numbers and arrays: of their types, shapes and bits.

    Example:
        >>> numbers_content((1.0, 2)) == numbers_content((1.0, 2.0))
        False
    """
    found = hashlib.sha256()
    for argument in arguments:
        values = np.ascontiguousarray(argument)
        found.update(f"{values.dtype}{np.shape(argument)}".encode())
        found.update(values.tobytes())
    return found.hexdigest()[:16]


def formula_content(law: Law) -> str:
    """Return a hash of the formula of a law, as it is compiled."""
    return digest(kernel_source(law))


def surface_content(surface: Surface) -> str:
    """Return a hash of all that the force depends on: texture, law, parameters and clamp.

    Example:
        >>> import asperity as asp
        >>> wave = asp.Sinusoid(amplitude=0.2e-3, period=2e-3)
        >>> one, other = (asp.Surface(wave, "B", stiffness=k) for k in (500.0, 501.0))
        >>> surface_content(one) == surface_content(other)
        False
    """
    texture = type(surface.texture.arguments).__name__, numbers_content(surface.texture.arguments)
    law = surface.law.letter, formula_content(surface.law), surface.acting_clamp
    return digest(repr((texture, law, numbers_content(surface.law_arguments))))
