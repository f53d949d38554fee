"""Ingredients: what is the same in several fused modules is compiled once, what differs is not."""

from __future__ import annotations

import subprocess
import sys
from typing import Any

import numpy as np
import pytest
from llvmlite import binding  # type: ignore[import-untyped]  # it has no types

from asperity.clamps import BACKED
from asperity.kernels import fuse
from asperity.laws import LAWS
from asperity.textures import Sinusoid

HEAD = fuse._module_header("A test.", "")
BELOW = """
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


def loaded(number: str = "3.0", factor: str = "2.0", loop: str = "1.0", head: str = HEAD) -> Any:
    text = BELOW.format(number=number, loop=loop)
    return fuse.load_fused(f"{head}FACTOR = {factor}\n\n{text}")


def test_modules_share_what_is_the_same() -> None:
    first, second = loaded(), loaded(loop="5.0")
    assert second.above is first.above
    assert second.below is first.below
    assert second.run is not first.run
    assert (first.run(7.0), second.run(7.0)) == (23.0, 115.0)


@pytest.mark.parametrize(
    ("changed", "value"),
    [({"number": "4.0"}, 30.0), ({"factor": "2.5"}, 23.5), ({"factor": "2"}, 23.0),
     ({"head": HEAD.replace('"numpy", _nrt', '"python", _nrt')}, 23.0)],
)  # fmt: skip
def test_what_differs_anywhere_below_is_another_function(
    changed: dict[str, str], value: float
) -> None:
    """A number in what it calls, a number or its type that it names, an option of the compiler."""
    first, second = loaded(), loaded(**changed)
    assert second.above is not first.above
    assert (second.below is first.below) == ("factor" in changed)
    assert (first.run(7.0), second.run(7.0)) == (23.0, value)


def test_a_record_that_was_defined_again_is_another_one() -> None:
    """Who makes one is another function; who receives one is compiled for each, by its type."""
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
    define = "from typing import NamedTuple\n\nRecord = NamedTuple('Record', {})\n"
    one, two = (
        fuse.load_fused(HEAD + define.format(fields) + text)
        for fields in ("[('a', float), ('b', float)]", "[('b', float), ('a', float)]")
    )
    assert one.made is not two.made
    assert one.first is two.first
    assert (one.run(3.0), two.run(3.0)) == (3.0, 6.0)


def test_a_function_that_calls_itself_is_like_no_other() -> None:
    text = """
@scalar
def count(n):
    return 0 if n < 1 else 1 + count(n - 1)


@loop
def run(n):
    return {loop} * count(n)
"""
    one, two = (fuse.load_fused(HEAD + text.format(loop=loop)) for loop in (1, 2))
    assert one.count is not two.count
    assert (one.run(4), two.run(4)) == (4, 8)


def test_laws_on_a_texture_share_its_functions() -> None:
    sampler = Sinusoid(1e-4, 1e-3).sampler
    one, two = (fuse.fuse_path(LAWS[letter], sampler, BACKED) for letter in "BC")
    assert one.sample_gradient is two.sample_gradient
    assert one.path_batch is not two.path_batch


KEPT = """
import sys
from asperity import Surface
from asperity.core.compiled import COMPILE_CALLBACKS
from asperity.textures import Sinusoid
COMPILE_CALLBACKS.append(print)
for law in sys.argv[1]:
    surface = Surface(Sinusoid(1e-4, 1e-3), law)
    print(surface.force_and_jacobian([(0.0, 0.0, -1e-4)])[1].tobytes().hex())
"""


def test_code_with_ingredients_of_another_module_is_kept_by_itself(
    tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Law C, compiled after B, is found by a process that never asks for B."""
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path))

    def said(laws: str) -> list[str]:
        command = [sys.executable, "-W", "error", "-c", KEPT, laws]
        return subprocess.run(command, check=True, capture_output=True, text=True).stdout.split()

    both = said("BC")
    assert len(both) > 2  # it compiled
    assert said("C") == both[-1:]


def test_loops_are_compiled_for_the_widest_registers(
    tmp_path: Any, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Where the processor has AVX-512, a loop over many points takes eight of them at a time.

    So does what loops share.
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
    has = dict(binding.get_host_cpu_features()).get("avx512f", False)
    for function in (module.fill, module.run):
        (code,) = function.inspect_asm().values()
        assert ("zmm" in code) == has
