"""Functions that are identical in several fused modules are compiled once, others separately."""

from __future__ import annotations

import subprocess
import sys
from typing import Any, NamedTuple

import numpy as np
import pytest
from llvmlite import binding  # type: ignore[import-untyped]  # it has no types

from asperity.kernels import fuse
from asperity.laws import LAWS
from asperity.laws.clamps import BACKED
from asperity.textures import Sinusoid

HEAD = fuse._module_header("A test.", "")
SOURCE = """
@scalar
def below(x):
    return {number} * x


@scalar
def above(x):
    return below(x) + FACTOR


@loop
def run(x):
    return {loop} * above(x)
"""


def load_module(
    number: str = "3.0", factor: str = "2.0", loop: str = "1.0", head: str = HEAD
) -> Any:
    text = SOURCE.format(number=number, loop=loop)
    return fuse.load_fused(f"{head}FACTOR = {factor}\n\n{text}")


def test_modules_share_identical_functions() -> None:
    first, second = load_module(), load_module(loop="5.0")
    assert second.above is first.above
    assert second.below is first.below
    assert second.run is not first.run
    assert (first.run(7.0), second.run(7.0)) == (23.0, 115.0)


@pytest.mark.parametrize(
    ("changes", "value"),
    [
        ({"number": "4.0"}, 30.0),
        ({"factor": "2.5"}, 23.5),
        ({"factor": "2"}, 23.0),
        ({"head": HEAD.replace('"numpy", _nrt', '"python", _nrt')}, 23.0),
    ],
)
def test_function_with_a_different_dependency_is_not_shared(
    changes: dict[str, str], value: float
) -> None:
    """Called code, the value or type of a named number, or a compiler option differs."""
    first, second = load_module(), load_module(**changes)
    assert second.above is not first.above
    assert (second.below is first.below) == ("factor" in changes)
    assert (first.run(7.0), second.run(7.0)) == (23.0, value)


def test_redefined_record_is_a_different_type() -> None:
    """Functions that construct it are not shared; functions that receive it specialise by type."""
    text = """
@scalar
def made(x):
    return Record(x, 2.0 * x)


@scalar
def first(record):
    return record.a


@loop
def run(x):
    return first(made(x))
"""
    definition = "from typing import NamedTuple\n\nRecord = NamedTuple('Record', {})\n"
    original, redefined = (
        fuse.load_fused(HEAD + definition.format(fields) + text)
        for fields in ("[('a', float), ('b', float)]", "[('b', float), ('a', float)]")
    )
    assert original.made is not redefined.made
    assert original.first is redefined.first
    assert (original.run(3.0), redefined.run(3.0)) == (3.0, 6.0)


@pytest.mark.usefixtures("empty_code_cache")
def test_shared_function_has_code_for_each_record_of_a_name() -> None:
    """Numba names both types alike."""
    text = """
@shared
def first(record):
    return record.a


@loop
def run(record):
    return 2.0 * first(record)


@loop
def run_later(record):
    return 3.0 * first(record)
"""

    class Record(NamedTuple):
        a: float
        b: float

    original = Record

    class Record(NamedTuple):  # type: ignore[no-redef]  # as in a notebook
        b: float
        a: float

    module = fuse.load_fused(HEAD + text)
    assert module.run(original(3.0, 4.0)) == 6.0
    assert module.run(Record(3.0, 4.0)) == 8.0
    assert module.run_later(original(3.0, 4.0)) == 9.0


def test_recursive_function_is_not_shared() -> None:
    text = """
@scalar
def count(n):
    return 0 if n < 1 else 1 + count(n - 1)


@loop
def run(n):
    return {loop} * count(n)
"""
    first, second = (fuse.load_fused(HEAD + text.format(loop=loop)) for loop in (1, 2))
    assert first.count is not second.count
    assert (first.run(4), second.run(4)) == (4, 8)


def test_laws_on_a_texture_share_its_sampler() -> None:
    sampler = Sinusoid(1e-4, 1e-3).sampler
    first, second = (fuse.fuse_path(LAWS[letter], sampler, BACKED) for letter in "BC")
    assert first.sample_gradient is second.sample_gradient
    assert first.path_batch is not second.path_batch


CACHED_RUN = """
import sys
from asperity import Surface
from asperity.core.compiled import COMPILE_CALLBACKS
from asperity.textures import Sinusoid
COMPILE_CALLBACKS.append(print)
for law in sys.argv[1]:
    surface = Surface(Sinusoid(1e-4, 1e-3), law)
    print(surface.force_and_jacobian([(0.0, 0.0, -1e-4)])[1].tobytes().hex())
"""


def test_cached_code_does_not_depend_on_other_modules(
    tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Law C, compiled after B, is found in the cache by a process that never loads B."""
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path))

    def run_laws(laws: str) -> list[str]:
        command = [sys.executable, "-W", "error", "-c", CACHED_RUN, laws]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()

    output = run_laws("BC")
    assert len(output) > 2  # messages of compilations and two results
    assert run_laws("C") == output[-1:]


def test_loops_use_the_widest_vector_registers(
    tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """With AVX-512 a loop over many points processes eight of them at a time.

    This includes functions that loops share.
    """
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path))
    text = """
@shared
def fill(x, out):
    for i in range(x.shape[0]):
        out[i] = 2.0 * x[i]

@loop
def run(x, out):
    fill(x, out)
    for i in range(x.shape[0]):
        out[i] += 3.0
"""
    module, out = fuse.load_fused(HEAD + text), np.empty(64)
    module.run(np.arange(64.0), out)
    assert out.tolist() == [2.0 * x + 3.0 for x in range(64)]
    has_avx512 = dict(binding.get_host_cpu_features()).get("avx512f", False)
    for function in (module.fill, module.run):
        (assembly,) = function.inspect_asm().values()
        assert ("zmm" in assembly) == has_avx512
