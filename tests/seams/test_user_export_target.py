"""A user-defined export target, and user-defined laws and textures in C."""

from __future__ import annotations

import re
import shutil
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
from tests.helpers.user_modules import imported

import asperity as asp
from asperity.export import c99
from asperity.export.program import LinkedSource

Call = Callable[..., tuple[int, str, str]]
EXAMPLES = Path(__file__).parents[2] / "examples"


def page_example() -> tuple[str, list[str]]:
    """Return the code and the command of the documented example."""
    page = (Path(__file__).parents[2] / "docs/howto/export.md").read_text("utf-8")
    section = page[page.index("## Another language") :]
    code = re.search(r"```python\n(.*?)```", section, re.DOTALL)
    command = re.search(r"`asperity (export .*?)`", section)
    assert code is not None
    assert command is not None
    return code[1], command[1].split()


def test_documented_example_writes_its_file(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    code, command = page_example()
    monkeypatch.chdir(tmp_path)
    Path(command[command.index("--plugin") + 1]).write_text(code)
    status, out, err = call(*command)
    assert (status, err) == (0, "")
    assert "Written: texture.txt" in out
    assert Path("texture.txt").read_text() == "texture"
    assert set(c99.TARGETS) == {"c99"}  # registered until the command ends


def test_target_of_a_plugin_writes_several_files(call: Call, tmp_path: Path) -> None:
    (tmp_path / "notes.py").write_text(
        "from asperity.export.c99 import ExportTarget\n"
        "def files(request, stem):\n"
        "    law = request.surface.law.letter\n"
        "    return {f'{stem}.txt': f'{request.name}: law {law}\\n',\n"
        "            f'{stem}.more': f'q = {request.q_upper!r}\\n'}\n"
        "NOTES = ExportTarget('notes', 'two lines', '.txt', files)\n"
    )
    target, plugin = tmp_path / "wall.txt", ("--plugin", str(tmp_path / "notes.py"))
    wave = ("sinusoid:amplitude=0.2mm,period=2mm", "--law", "C", "--lang", "notes", *plugin)
    code, out, err = call("export", *wave, "-o", str(target), "--name", "wall")
    assert (code, err) == (0, "")
    assert target.read_text() == "wall: law C\n"
    assert (tmp_path / "wall.more").read_text().startswith("q = 1.43")
    assert "wall.more" in out
    code, _out, err = call("export", *wave, "-o", str(tmp_path / "wall.h"))
    assert (code, err) == (2, "asperity: output must be a file that ends in .txt, got 'wall.h'\n")


def test_registering_an_existing_name_is_refused() -> None:
    target = c99.ExportTarget("c99", "", ".h", lambda _request, _stem: {})
    with pytest.raises(asp.ParameterError, match="lang is registered already"):
        c99.register(target)


def test_user_defined_law_and_texture_give_the_force_of_the_kernel(tmp_path: Path) -> None:
    for name in ("own_law.py", "own_texture.py"):
        shutil.copy(EXAMPLES / name, tmp_path / f"my_{name}")
    with imported(tmp_path, "my_own_law") as laws, imported(tmp_path, "my_own_texture") as textures:
        texture = textures.EggBox(amplitude=0.1e-3, period=2e-3)
        surfaces = {
            name: asp.Surface(texture, law, max_depth=0.3e-3)
            for name, law in (("own", laws.STIFFENING), ("c", "C"), ("d", "D"), ("h", "H"))
        }
        surfaces["h"] = asp.bake(surfaces["h"], 40e-6)
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
