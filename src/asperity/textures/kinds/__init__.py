"""Texture kinds with arguments of their own, declared in ``kinds.toml``.

A texture kind has a sampler: modules of scalar functions that are compiled together with a law. The
record of the texture is their last argument:

* ``sample_height(x, y, texture)`` -> h
* ``sample_gradient(x, y, texture)`` -> h, h_x, h_y
* ``sample_hessian(x, y, texture)`` -> h, h_x, h_y, h_xx, h_xy, h_yy
* ``closest_point(x, y, z, texture)`` -> X, Y of the globally closest surface point, h, h_x, h_y

They are plain Python: the tests call them directly, and the kernels are the same functions
compiled. In batches, the functions ``sine`` and ``cosine`` of :mod:`asperity.textures.kinds.sine`
are replaced by polynomials (:mod:`asperity.kernels.batch_sine`), and those of a height map by
functions without branches (``Kernels(for_blocks=True)``). Sampler functions never raise; positions
are finite because the public functions check them.
"""

from __future__ import annotations

import tomllib
from pathlib import Path
from typing import Any

from asperity.core.arguments import Argument, read_arguments

_PATH = Path(__file__).with_name("kinds.toml")

KIND_EXAMPLES: dict[str, dict[str, Any]] = tomllib.loads(_PATH.read_text("utf-8"))["examples"]
"""Summary and example arguments [SI] of each kind, by its name."""


def kind_arguments(*names: str) -> tuple[Argument, ...]:
    """Return the arguments in some tables; those of the later ones replace the others."""
    arguments: dict[str, Argument] = {}
    for name in names:
        arguments |= read_arguments(_PATH, name)
    return tuple(arguments.values())
