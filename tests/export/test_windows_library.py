"""The exported library for Windows, built by a cross compiler and run under wine."""

from __future__ import annotations

import os
import subprocess
from pathlib import Path

import numpy as np
import pytest
from tests.helpers.c_programs import STRICT, header, kernel_ticks, probes, run_command, tool

from asperity.surface import Surface
from asperity.textures import HeightMap

_PROGRAM = r"""
#include <stdio.h>
#include "texture.h"

int main(int count, char **arguments)
{
    FILE *points = fopen(arguments[1], "rb");
    FILE *forces = fopen(arguments[2], "wb");
    double at[3];
    double f[3];
    texture_state state;
    (void)count;
    texture_reset(&state);
    while (fread(at, sizeof at, 1, points) == 1) {
        texture_force(&state, at, f);
        fwrite(f, sizeof f, 1, forces);
    }
    return fclose(forces);
}
"""


@pytest.fixture(scope="module")
def wine(tmp_path_factory: pytest.TempPathFactory) -> dict[str, str]:
    """Return the variables of wine, with a disk of its own."""
    tool("wine")
    disk = tmp_path_factory.mktemp("wine")
    variables = os.environ | {"WINEPREFIX": str(disk), "WINEDEBUG": "-all", "DISPLAY": ""}
    subprocess.run(["wine", "cmd", "/c", "exit"], env=variables, capture_output=True, check=False)
    return variables


@pytest.mark.parametrize("law", ["B", "F"])
def test_forces_under_wine_are_those_of_the_kernel(
    law: str, wine: dict[str, str], tmp_path: Path
) -> None:
    compiler = tool("x86_64-w64-mingw32-gcc")
    heights = 1e-4 * np.random.default_rng(5).normal(size=(6, 5))
    surface = Surface(HeightMap(heights, 1e-3), law, stiffness=900.0, max_depth=5e-4)
    (tmp_path / "texture.h").write_text(header(surface, folder=tmp_path), encoding="utf-8")
    (tmp_path / "main.c").write_text(_PROGRAM, encoding="utf-8")
    sources = [tmp_path / "main.c", *tmp_path.glob("*_data.c")]
    # mingw computes in the registers of SSE, without contractions, as the kernel does.
    run_command(compiler, *STRICT, "-O2", *sources, "-o", tmp_path / "own.exe", "-static")
    points = probes(surface.texture, surface.max_depth, 2000, 7)
    folder = tmp_path / "Jörg Müller"
    folder.mkdir()
    points.tofile(folder / "points.bin")
    command = ["wine", str(tmp_path / "own.exe"), "points.bin", "forces.bin"]
    subprocess.run(command, cwd=folder, env=wine, capture_output=True, check=True, timeout=120)
    forces = np.fromfile(folder / "forces.bin").reshape(-1, 3)
    expected = kernel_ticks(surface, points)[:, :3]
    assert np.any(expected != 0.0)
    if law == "F":  # its roots of sums are computed by the C library of Windows
        np.testing.assert_array_max_ulp(forces, expected, maxulp=1)
    else:
        np.testing.assert_array_equal(forces, expected)
