"""Compiled modules, as a new process finds them."""

from __future__ import annotations

from asperity.kernels import fuse


def forget_fused_modules() -> None:
    """Forget all fused and loaded modules of this process, so that the next use loads them."""
    for function in vars(fuse).values():
        if hasattr(function, "cache_clear"):
            function.cache_clear()
