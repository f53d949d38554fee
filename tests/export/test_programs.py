"""The programs of the page "Export to C" are built and run."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from tests.exported import COMPILERS, STRICT, run, tool

import asperity as asp
from asperity.export.order import Order
from asperity.export.targets import find_target
from asperity.export.writing import write_files

EXAMPLES = Path(__file__).parents[2] / "examples" / "export"


def exported(folder: Path, law: str = "C", name: str = "texture.h", **options: Any) -> Path:
    """Write an exported program into a folder and return the folder."""
    surface = asp.Surface(asp.Sinusoid(0.1e-3, 2e-3), law, 800.0, clamp="backed")
    q = asp.characteristic_number(surface).upper
    order = Order(surface, q_upper=q, **options)
    write_files(folder / name, find_target("c99"), order, force=False)
    return folder


@pytest.mark.parametrize("compiler", COMPILERS)
def test_a_servo_loop(compiler: str, tmp_path: Path) -> None:
    folder = exported(tmp_path)
    flags = (*STRICT, "-O2", f"-I{folder}", EXAMPLES / "loop.c", "-o", folder / "loop", "-lm")
    run(tool(compiler), *flags)
    head, *lines = run(folder / "loop").splitlines()
    assert head.startswith("k = 800 N/m, q <= 1.09")
    assert len(lines) == 8
    # The handle lies on the waves, pressed down by 0.15 N, and is pulled over them.
    heights = [float(line.split("z =")[1].split()[0]) for line in lines]
    forces = [float(line.split(",")[1].split(")")[0]) for line in lines]
    assert all(-0.4 < z < 0.1 for z in heights)
    assert all(0.1 < f < 0.2 for f in forces[1:])
