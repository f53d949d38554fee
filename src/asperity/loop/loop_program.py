"""Loops of the package fused with a law, a texture and the parts of a loop."""

from __future__ import annotations

from functools import lru_cache
from types import ModuleType

from asperity.clamps import Clamp
from asperity.laws import Law


@lru_cache(maxsize=256)
def fuse_loop(
    law: Law, sampler: tuple[ModuleType, ...], clamp: Clamp, *modules: ModuleType
) -> ModuleType:
    """Return compiled loops of a law on a texture kind.

    Args:
        law: the law.
        sampler: modules whose functions evaluate the texture.
        clamp: depth clamp.
        modules: modules of the loops, and of clock, guards, device and trace.
    """
    from asperity.kernels import tick
    from asperity.kernels.fuse import fuse_on_texture

    return fuse_on_texture(law, sampler, clamp, (*modules, tick))
