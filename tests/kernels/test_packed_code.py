"""Machine code that one process packs for a level of processors is loaded by another."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

_SCRIPT = """
import json, sys
from pathlib import Path

from asperity.core import cache, packed_code

folder, action = Path(sys.argv[1]), sys.argv[2]
packed_code.FOLDER = folder
if action == "pack":
    packed_code.compile_for_level()

import numpy as np
from asperity import Sinusoid, Surface
from asperity.core.compiled import COMPILE_CALLBACKS

compiled = []
COMPILE_CALLBACKS.append(lambda name: name and compiled.append(name))
points = np.random.default_rng(2).uniform((0, 0, -1e-4), (2e-3, 2e-3, 1e-4), (500, 3))
forces = Surface(Sinusoid(0.1e-3, 1e-3), "C").force(points)
if action == "pack":
    from asperity.kernels.numba_internals import code_target

    packed_code.store_packed_code(folder, code_target())
stored = len(cache.list_entries())
print(json.dumps([forces.tobytes().hex(), compiled, stored]))
"""


def force_on_sinusoid(folder: Path, action: str) -> tuple[list[Any], str]:
    """Return forces, compiled functions and entries of an empty user cache, and the messages."""
    process = subprocess.run(
        [sys.executable, "-c", _SCRIPT, str(folder), action],
        capture_output=True,
        text=True,
        check=True,
        env=os.environ | {"ASPERITY_CACHE_DIR": str(folder / f"cache-{action}")},
    )
    return json.loads(process.stdout), process.stderr


@pytest.fixture(scope="module")
def packed(tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, list[Any]]:
    """Return a folder with the code of one law, and what the process that packed it computed."""
    folder: Path = tmp_path_factory.mktemp("package")
    answer, messages = force_on_sinusoid(folder, "pack")
    assert answer[1] == ["force_batch"]
    assert not messages
    return folder, answer


def test_another_process_compiles_nothing(packed: tuple[Path, list[Any]]) -> None:
    folder, answer = packed
    assert force_on_sinusoid(folder, "load") == ([answer[0], [], 0], "")


@pytest.mark.parametrize("fault", ["foreign", "damaged"])
def test_what_does_not_suit_is_compiled(packed: tuple[Path, list[Any]], fault: str) -> None:
    """The forces are the same to the last bit as those of the code for the level."""
    folder, answer = packed
    (place,) = folder.glob("cpython*")
    (path,) = place.glob("[!d]*")
    if fault == "foreign":
        path = place / "description.json"
    content = path.read_bytes()
    changed = content[:-1] + b"?"
    if fault == "foreign":
        changed = content.replace(b"+avx2", b"+avx9")
    path.write_bytes(changed)
    try:
        loaded, messages = force_on_sinusoid(folder, fault)
    finally:
        path.write_bytes(content)
    assert loaded == [answer[0], ["force_batch"], 1]
    assert messages.count("CacheWarning: the machine code in this package is ") == 1
    assert {"foreign": "this one lacks avx9", "damaged": "is damaged"}[fault] in messages
