"""Threads and processes that share an empty cache: equal results, and no leftover files."""

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


def compute_concurrently(how: str, count: int, folder: Path) -> list[list[str]]:
    """Return the results of several concurrent threads or processes."""
    script = folder / "script.py"
    script.write_text(_SCRIPT)
    process = subprocess.run(
        [sys.executable, str(script), how, str(count)],
        capture_output=True,
        text=True,
        check=True,
        timeout=300,
        env=os.environ | {"ASPERITY_CACHE_DIR": str(folder / f"cache-{how}")},
    )
    assert not process.stderr
    results: list[list[str]] = json.loads(process.stdout)
    return results


@pytest.fixture(scope="module")
def expected(tmp_path_factory: pytest.TempPathFactory) -> list[list[str]]:
    """Return the result of one thread, with a cache of its own."""
    return compute_concurrently("threads", 1, tmp_path_factory.mktemp("alone"))


@pytest.mark.parametrize(("how", "count"), [("threads", 8), ("fork", 3), ("spawn", 3)])
def test_concurrent_workers_get_bitwise_equal_results(
    how: str, count: int, expected: list[list[str]], tmp_path: Path
) -> None:
    results = compute_concurrently(how, count, tmp_path)
    assert results == expected * count
    entries = {path.name for path in (tmp_path / f"cache-{how}").rglob("*") if path.is_file()}
    entries.discard(".turns")
    assert entries
    assert all(len(name) == 40 for name in entries)  # complete entries only


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


def test_concurrent_processes_compile_everything_once(tmp_path: Path) -> None:
    def start_process(cache: str) -> subprocess.Popen[str]:
        return subprocess.Popen(
            [sys.executable, "-c", _COMPILING],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            text=True,
            env=os.environ | {"ASPERITY_CACHE_DIR": str(tmp_path / cache)},
        )

    def compiled_names(cache: str, count: int) -> list[str]:
        processes = [start_process(cache) for _ in range(count)]
        for process in processes:
            assert process.stdout is not None
            while process.stdout.readline() != "ready\n":
                pass
        for process in processes:  # simultaneously
            assert process.stdin is not None
            process.stdin.write("\n")
            process.stdin.flush()
        return [
            name for process in processes for name in process.communicate(timeout=200)[0].split()
        ]

    assert sorted(compiled_names("two", 2)) == sorted(compiled_names("one", 1)) != []


def test_concurrent_threads_get_the_same_unit(monkeypatch: pytest.MonkeyPatch) -> None:
    """The linker identifies units by identity: two units of one module would lose loops."""
    module = ModuleType("at_once")
    vars(module)["KERNELS"] = Kernels(provides=("total",))
    barrier = threading.Barrier(8, timeout=30)

    def source(_module: ModuleType) -> str:
        barrier.wait()  # all threads have missed the cache
        return "def total(x, y):\n    return x + y\n"

    monkeypatch.setattr(link.inspect, "getsource", source)
    with ThreadPoolExecutor(8) as pool:
        units = list(pool.map(link.unit_from_module, [module] * 8))
    assert {id(unit) for unit in units} == {id(link.unit_from_module(module))}
    assert list(units[0].sources) == ["total"]


def test_concurrent_threads_load_the_same_module() -> None:
    """With two modules of one name, cached code would belong to the later one only."""
    source = "import time\n\ntime.sleep(0.05)  # the others come meanwhile\n"
    with ThreadPoolExecutor(8) as pool:
        modules = list(pool.map(load_fused, [source] * 8))
    assert {id(module) for module in modules} == {id(sys.modules[modules[0].__name__])}
