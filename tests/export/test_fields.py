"""Exported C of baked fields: bit-identical to the kernel, as arrays or from a file."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.helpers.c_programs import (
    COMPILERS,
    header,
    kernel_ticks,
    library,
    probes,
    same_bits,
    ticks,
)

import asperity as asp
from asperity.surface import Surface
from asperity.textures import Texture

KINDS = ("fourier", "map", "periodic profile")


def bake(texture: Texture, resolution: float | None = None) -> Surface:
    """Return a surface with law H of a texture, baked coarsely unless a resolution is given."""
    low, high = texture.extremes
    depth = max(high - low, 1e-5)
    return asp.bake(Surface(texture, "H", 800.0, max_depth=depth), resolution or 0.5 * depth)


@pytest.mark.parametrize("flags", [("-O1",), ("-O3", "-march=native"), ("-O2", "-std=gnu99")])
def test_field_in_the_source_gives_the_force_of_the_kernel(
    make_texture: Callable[[str], Texture], flags: tuple[str, ...], tmp_path: Path
) -> None:
    surfaces = {f"t{i}": bake(make_texture(kind)) for i, kind in enumerate(KINDS)}
    headers = {name: header(s, name, folder=tmp_path) for name, s in surfaces.items()}
    for compiler in COMPILERS:
        program = library(tmp_path, compiler, headers, *flags)
        for name, surface in surfaces.items():
            points = probes(surface.texture, surface.max_depth, 20_000, 3)
            forces = ticks(program, name, points)
            assert same_bits(forces, kernel_ticks(surface, points)).all(), (compiler, name)
            assert np.any(forces[:, :3] != 0.0)
