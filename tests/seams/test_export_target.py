"""A language of a user's own to export to, a law and a texture kind of a user's own in C."""

from __future__ import annotations

import re
import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from tests.exported import COMPILERS, header, kernel_ticks, library, probes, same_bits, ticks
from tests.own_modules import imported

import asperity as asp
from asperity.export import targets
from asperity.export.order import Order
from asperity.export.program import Linked

Call = Callable[..., tuple[int, str, str]]
EXAMPLES = Path(__file__).parents[2] / "examples"


def _notes(order: Order, stem: str) -> dict[str, str]:
    """A language in which a surface is two lines."""
    q = f"q = {order.q_upper!r}\n"
    return {f"{stem}.txt": f"{order.name}: law {order.surface.law.letter}\n", f"{stem}.more": q}


@pytest.fixture
def notes(monkeypatch: pytest.MonkeyPatch) -> targets.Target:
    monkeypatch.setattr(targets, "TARGETS", dict(targets.TARGETS))
    return targets.register(targets.Target("notes", "two lines", ".txt", _notes))


@pytest.mark.usefixtures("notes")
def test_a_language_of_one_s_own(call: Call, tmp_path: Path) -> None:
    target = tmp_path / "wall.txt"
    wave = ("sinusoid:amplitude=0.2mm,period=2mm", "--law", "C", "--lang", "notes")
    code, out, err = call("export", *wave, "-o", str(target), "--name", "wall")
    assert (code, err) == (0, "")
    assert target.read_text() == "wall: law C\n"
    assert (tmp_path / "wall.more").read_text().startswith("q = 1.43")
    assert "wall.more" in out
    code, _out, err = call("export", *wave, "-o", str(tmp_path / "wall.h"))
    assert (code, err) == (2, "asperity: output must be a file that ends in .txt, got 'wall.h'\n")


def test_a_name_is_taken_once() -> None:
    with pytest.raises(asp.ParameterError, match="lang is registered already"):
        targets.register(targets.Target("c99", "", ".h", _notes))


def test_a_law_and_a_texture_of_one_s_own(tmp_path: Path) -> None:
    for name in ("own_law.py", "own_texture.py"):
        shutil.copy(EXAMPLES / name, tmp_path / f"my_{name}")
    with imported(tmp_path, "my_own_law") as laws, imported(tmp_path, "my_own_texture") as kinds:
        texture = kinds.EggBox(amplitude=0.1e-3, period=2e-3)
        surfaces = {
            name: asp.Surface(texture, law, max_depth=0.3e-3)
            for name, law in (("own", laws.STIFFENING), ("c", "C"), ("d", "D"), ("h", "H"))
        }
        headers = {name: header(surface, name) for name, surface in surfaces.items()}
        for compiler in COMPILERS:
            made = library(tmp_path, compiler, headers, "-O1")
            for name, surface in surfaces.items():
                at = probes(texture, 0.3e-3, 400 if name == "h" else 4000, 9)
                forces = ticks(made, name, at)
                assert same_bits(forces, kernel_ticks(surface, at)).all(), (compiler, name)
    assert re.search(r"reference_depth = |double reference_depth", headers["own"])


def test_what_is_printed_is_what_numba_compiles(monkeypatch: pytest.MonkeyPatch) -> None:
    """Both take the linked text: a change in it changes the C."""
    surface = asp.Surface(asp.Sinusoid(2e-4, 2e-3), "C")
    before = header(surface)
    monkeypatch.setattr(
        Linked, "__init__", lambda self, text: object.__setattr__(
            self, "text", text.replace("depth*k", "2.0*depth*k")
        ),
    )  # fmt: skip
    assert "2.0 * depth * k" not in before
    assert "2.0 * depth * k" in header(surface)


def test_forces_are_no_zeros() -> None:
    surface = asp.Surface(asp.Sinusoid(2e-4, 2e-3), "C")
    at = probes(surface.texture, 3e-4, 4000, 9)
    assert np.count_nonzero(surface.force(at)[:, 2]) > 2000
