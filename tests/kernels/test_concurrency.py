"""Many threads and processes begin with one empty cache: the same bits, and nothing left over."""

from __future__ import annotations

import json
import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path
from types import ModuleType

import pytest

from asperity.core.compiled import Kernels
from asperity.kernels import link
from asperity.kernels.fuse import load_fused

_SCRIPT = """
import json, multiprocessing, sys
from concurrent.futures import ThreadPoolExecutor
import numpy as np
from asperity import HeightMap, Surface

def answer(_number):
    texture = HeightMap(1e-4 * np.random.default_rng(1).normal(size=(8, 9)), 3e-4)
    points = np.random.default_rng(2).uniform((0, 0, -1e-4), (2e-3, 2e-3, 1e-4), (50, 3))
    return [part.tobytes().hex() for part in Surface(texture, "B").force_and_jacobian(points)]

if __name__ == "__main__":
    how, count = sys.argv[1], int(sys.argv[2])
    if how == "threads":
        with ThreadPoolExecutor(count) as pool:
            answers = list(pool.map(answer, range(count)))
    else:
        with multiprocessing.get_context(how).Pool(count) as pool:
            answers = pool.map(answer, range(count), chunksize=1)
    print(json.dumps(answers))
"""


def answers(how: str, count: int, folder: Path) -> list[list[str]]:
    """Return what so many threads or processes compute."""
    script = folder / "script.py"
    script.write_text(_SCRIPT)
    done = subprocess.run(
        [sys.executable, str(script), how, str(count)],
        capture_output=True, text=True, check=True, timeout=300,
        env=os.environ | {"ASPERITY_CACHE_DIR": str(folder / f"cache-{how}")},
    )  # fmt: skip
    assert not done.stderr
    found: list[list[str]] = json.loads(done.stdout)
    return found


@pytest.mark.parametrize(("how", "count"), [("threads", 8), ("fork", 3), ("spawn", 3)])
def test_all_who_begin_at_once_have_the_same_bits(how: str, count: int, tmp_path: Path) -> None:
    alone = answers("threads", 1, tmp_path)
    together = answers(how, count, tmp_path)
    assert together == alone * count
    kept = {path.name for path in (tmp_path / f"cache-{how}").rglob("*") if path.is_file()}
    kept.discard(".turns")
    assert kept
    assert all(len(name) == 40 for name in kept)  # entries only: nothing damaged, nothing half


_COMPILING = """
import sys
from asperity import Sinusoid, Surface
from asperity.core.compiled import COMPILE_CALLBACKS

COMPILE_CALLBACKS.append(print)
surface = Surface(Sinusoid(0.1e-3, 2e-3), "C")
surface.force([[0.0, 0.0, 0.0]])  # NumPy, Numba and what they need
print("ready", flush=True)
sys.stdin.readline()
surface.to_law("D").jacobian([[0.0, 0.0, 0.0]])
"""


def test_two_processes_compile_nothing_twice(tmp_path: Path) -> None:
    def begun(cache: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-c", _COMPILING], stdin=subprocess.PIPE, stdout=subprocess.PIPE,
            text=True, env=os.environ | {"ASPERITY_CACHE_DIR": str(tmp_path / cache)},
        )  # fmt: skip

    def compiled(cache: str, count: int) -> list[str]:
        processes = [begun(cache) for _ in range(count)]
        for process in processes:
            assert process.stdout is not None
            while process.stdout.readline() != "ready\n":
                pass
        for process in processes:  # at once
            assert process.stdin is not None
            process.stdin.write("\n")
            process.stdin.flush()
        return [name for one in processes for name in one.communicate(timeout=200)[0].split()]

    assert sorted(compiled("two", 2)) == sorted(compiled("one", 1)) != []


def test_threads_that_ask_at_once_get_one_unit(monkeypatch: pytest.MonkeyPatch) -> None:
    """The linker tells units by identity: two of one module would leave loops out."""
    module = ModuleType("at_once")
    vars(module)["KERNELS"] = Kernels(provides=("total",))
    meeting = threading.Barrier(8, timeout=30)

    def source(_module: ModuleType) -> str:
        meeting.wait()  # all have found that there is none yet
        return "def total(x, y):\n    return x + y\n"

    monkeypatch.setattr(link.inspect, "getsource", source)
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(link.unit_from_module, [module] * 8))
    assert {id(unit) for unit in found} == {id(link.unit_from_module(module))}
    assert list(found[0].sources) == ["total"]


def test_threads_that_load_at_once_get_one_module() -> None:
    """Of two with one name, kept code would belong to the one that was made last."""
    source = "import time\n\ntime.sleep(0.05)  # the others come meanwhile\n"
    with ThreadPoolExecutor(8) as pool:
        found = list(pool.map(load_fused, [source] * 8))
    assert {id(module) for module in found} == {id(sys.modules[found[0].__name__])}
