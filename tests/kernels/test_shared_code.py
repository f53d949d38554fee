"""Programs in parts: code shared by loops is compiled once, and nothing is optimised twice."""

from __future__ import annotations

import subprocess
import sys
from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from numba.core import codegen

from asperity.core.compiled import Kernels
from asperity.core.errors import ParameterError
from asperity.kernels import fuse
from asperity.kernels.link import SourceUnit, link, link_modules, loops_of, unit_from_source
from asperity.kernels.numba_internals import LinkOnlyLibrary

SEARCH = """
def search(x): return 2.0 * step(x) + FAR
def step(x): return x + 1.0
"""


def unit(
    name: str, text: str, space: dict[str, object] | None = None, **kernels: Any
) -> SourceUnit:
    return unit_from_source(name, text, Kernels(**kernels), space or {})


PROVIDER = unit("finds", SEARCH, {"FAR": 100.0}, provides=("search", "step"), shared=("search",))
TIMES = unit("times", "def times(x): return search(x) * step(3.0 * x)", loops=("times",))
CHAIN = unit(
    "chain",
    "def outer(x): return middle(x) + 1.0\ndef middle(x): return inner(x)\n"
    "def inner(x): return 3.0 * x",
    provides=("outer", "inner"),
    shared=("outer", "inner"),
)
DEEP = unit("deep", "def deep(x): return outer(x)", loops=("deep",))
FAR = "1.000000e+02"  # as LLVM writes it
MINUS = unit("minus", "def minus(x): return -search(x)", loops=("minus",))


def test_shared_function_is_a_separate_part() -> None:
    first, second = (
        link_modules(loops_of(loop), (PROVIDER, CHAIN, loop)) for loop in (TIMES, MINUS)
    )
    assert first[0] == second[0]  # for any importing loop
    assert (first[0].name, first[0].imports) == ("search", ())
    assert first[0].title == "Function search of finds."
    assert ["def search" in part.source for part in first] == [True, False]
    assert ["def step" in part.source for part in first] == [
        True,
        True,
    ]  # copied, because it is small
    assert (first[1].name, first[1].imports, first[1].title) == ("", ("search",), "")
    assert "FAR = 100.0" in first[0].source
    assert "FAR" not in first[1].source
    assert "@shared\ndef search" in first[0].source
    assert "def search" in link(
        loops_of(TIMES), (PROVIDER, TIMES)
    )  # in one piece, where that is asked


def test_parts_are_sorted_after_their_imports() -> None:
    provider = unit(
        "deep",
        "def a(x): return b(x)\ndef b(x): return c(x)\ndef c(x): return x",
        provides=("a", "b", "c"),
        shared=("a", "b", "c"),
    )
    loop = unit("loop", "def run(x): return a(x) + c(x)", loops=("run",))
    parts = link_modules(loops_of(loop), (provider, loop))
    assert sorted(part.name for part in parts) == ["", "a", "b", "c"]
    for index, part in enumerate(parts):
        assert set(part.imports) <= {earlier.name for earlier in parts[:index]}
    assert parts[-1].imports == ("a", "c")


def test_recursive_shared_function_is_an_error() -> None:
    ring = unit(
        "ring",
        "def a(x): return b(x)\ndef b(x): return a(x)",
        provides=("a", "b"),
        shared=("a", "b"),
    )
    loop = unit("loop", "def run(x): return a(x)", loops=("run",))
    with pytest.raises(ParameterError, match="ring: the shared function 'a' calls itself"):
        link_modules(loops_of(loop), (ring, loop))


def test_shared_functions_of_one_name_are_an_error() -> None:
    one = unit("one", "def a(x): return x", shared=("a",))
    two = unit("two", "def b(x): return a(x)\ndef a(x): return x", provides=("b",), shared=("a",))
    loop = unit("loop", "def run(x): return a(x) + b(x)", loops=("run",))
    public = unit("one", one.sources["a"], provides=("a",), shared=("a",))
    with pytest.raises(ParameterError, match="function 'a' is defined by both one and two"):
        link_modules(loops_of(loop), (public, two, loop))


def load(loop: SourceUnit) -> Any:
    return fuse.load_fused(
        fuse._assemble(f"Of {loop.name}.", loops_of(loop), (PROVIDER, CHAIN, loop))
    )


@pytest.fixture
def empty_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path))
    fuse._load_module.cache_clear()
    yield
    fuse._load_module.cache_clear()


@pytest.mark.usefixtures("empty_cache")
def test_shared_function_is_compiled_once(monkeypatch: pytest.MonkeyPatch) -> None:
    finished: list[str] = []
    add_module = codegen.JITCPUCodegen._add_module

    def record(self: Any, module: Any) -> Any:
        if "asperity_fused" in str(module):
            finished.append(str(module))
        return add_module(self, module)

    monkeypatch.setattr(codegen.JITCPUCodegen, "_add_module", record)
    assert load(TIMES).times(2.0) == (2.0 * 3.0 + 100.0) * 7.0
    # Machine code of the loop and of the shared function, not of the step that both contain.
    assert len(finished) == 2
    assert load(MINUS).minus(2.0) == -106.0
    assert len(finished) == 3
    # Only the shared function itself holds its code.
    assert [FAR in module for module in finished] == [True, False, False]
    search = sys.modules[load(MINUS).search.__module__].search
    assert search is load(TIMES).search
    assert sum(search.stats.cache_misses.values()) == 1
    fuse._load_module.cache_clear()  # as in a new process
    assert load(MINUS).minus(2.0) == -106.0
    other = unit("other", "def other(x): return search(x) + 1.0", loops=("other",))
    assert load(other).other(2.0) == 107.0
    assert not load(other).search.stats.cache_misses
    assert sum(load(other).search.stats.cache_hits.values()) == 1


@pytest.mark.usefixtures("empty_cache")
def test_link_only_function_has_no_machine_code() -> None:
    step = load(TIMES).step
    load(TIMES).times(1.0)
    (compiled,) = step.overloads.values()
    assert isinstance(compiled.library, LinkOnlyLibrary)
    assert compiled.library.get_pointer_to_function(compiled.fndesc.llvm_func_name) == 0


# Imports and the start of the compiler take most of the time of a process: those that compile are
# forked after them.
PROGRAM = """
import os, sys
import numba
from tests.kernels.test_shared_code import DEEP, MINUS, TIMES, load
loops = {"times": TIMES, "minus": MINUS, "deep": DEEP}
numba.njit(lambda x: x)(1.0)
for line in sys.stdin:
    if os.fork() == 0:
        print(*(getattr(load(loops[name]), name)(2.0) for name in line.split()), flush=True)
        os._exit(0)
    if os.wait()[1]:
        print("failed", flush=True)
"""


@pytest.fixture
def run_in_new_process() -> Iterator[Callable[..., list[float]]]:
    """Return a function that runs loops, given by name, in a process that has no code yet."""
    command = [sys.executable, "-c", PROGRAM]
    pipe = subprocess.PIPE
    with subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, bufsize=1) as process:
        assert process.stdin is not None
        assert process.stdout is not None
        lines = process.stdout

        def run(*names: str) -> list[float]:
            print(*names, file=process.stdin)
            return [float(word) for word in lines.readline().split()]

        yield run


@pytest.mark.usefixtures("empty_cache")
def test_cached_code_finds_the_shared_functions_that_it_calls(
    run_in_new_process: Callable[..., list[float]], tmp_path: Path
) -> None:
    """Whatever of a program is cached, and in whatever order the rest is compiled."""
    assert run_in_new_process("times") == [742.0]
    assert run_in_new_process("minus", "times") == [-106.0, 742.0]
    assert run_in_new_process("deep") == [7.0]
    entries = [path for path in tmp_path.rglob("*") if path.is_file()]
    contents = {path: path.read_bytes() for path in entries}
    assert len(entries) >= 6
    for path in entries:
        for other, content in contents.items():
            other.write_bytes(content)
        path.unlink()
        assert run_in_new_process("minus", "times", "deep") == [-106.0, 742.0, 7.0]
        assert path.exists()
