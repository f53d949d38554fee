"""User-defined laws and textures in C."""

from __future__ import annotations

import re
import shutil
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
from tests.helpers.user_modules import imported

import asperity as asp
from asperity.export.program import LinkedSource

EXAMPLES = Path(__file__).parents[2] / "examples"


def test_user_defined_law_and_texture_give_the_force_of_the_kernel(tmp_path: Path) -> None:
    for name in ("own_law.py", "own_texture.py"):
        shutil.copy(EXAMPLES / name, tmp_path / f"my_{name}")
    with imported(tmp_path, "my_own_law") as laws, imported(tmp_path, "my_own_texture") as textures:
        texture = textures.EggBox(amplitude=0.1e-3, period=2e-3)
        surfaces = {
            name: asp.Surface(texture, law, max_depth=0.3e-3)
            for name, law in (("own", laws.STIFFENING), ("c", "C"), ("d", "D"), ("h", "H"))
        }
        surfaces["h"] = asp.bake(surfaces["h"], 40e-6, press=1e-6)
        headers = {name: header(surface, name) for name, surface in surfaces.items()}
        for compiler in COMPILERS:
            program = library(tmp_path, compiler, headers, "-O1")
            for name, surface in surfaces.items():
                points = probes(texture, 0.3e-3, 400 if name == "h" else 4000, 9)
                forces = ticks(program, name, points)
                assert same_bits(forces, kernel_ticks(surface, points)).all(), (compiler, name)
    assert re.search(r"reference_depth = |double reference_depth", headers["own"])


def test_exported_code_is_generated_from_the_compiled_source(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A change of the linked source must change the C code."""
    surface = asp.Surface(asp.Sinusoid(2e-4, 2e-3), "C")
    before = header(surface)
    original = LinkedSource.__init__
    monkeypatch.setattr(
        LinkedSource,
        "__init__",
        lambda self, text: original(self, text.replace("depth*k", "2.0*depth*k")),
    )
    assert "2.0 * depth * k" not in before
    assert "2.0 * depth * k" in header(surface)


def test_probes_are_in_contact() -> None:
    surface = asp.Surface(asp.Sinusoid(2e-4, 2e-3), "C")
    points = probes(surface.texture, 3e-4, 4000, 9)
    assert np.count_nonzero(surface.force(points)[:, 2]) > 2000
