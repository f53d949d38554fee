"""Modules say what they provide and require, and the linker goes by that alone."""

from __future__ import annotations

import ast
import importlib
import inspect
import linecache
import pkgutil
import sys
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import asperity
from asperity.compiled import Kernels
from asperity.errors import ParameterError
from asperity.kernels import fuse
from asperity.kernels.link import (
    COMMON,
    MissingFunctionError,
    Unit,
    link,
    loops_of,
    module_unit,
    text_unit,
)
from asperity.laws import LAWS
from asperity.textures import Sinusoid


def compiled_modules() -> Iterator[ModuleType]:
    """All modules of the package that declare themselves."""
    for found in pkgutil.walk_packages(asperity.__path__, "asperity."):
        path = Path(found.module_finder.path) / f"{found.name.rpartition('.')[2]}.py"
        if path.exists() and "\nKERNELS = " in path.read_text(encoding="utf-8"):
            yield importlib.import_module(found.name)


Make = Callable[[str], ModuleType]

MODULES = list(compiled_modules())


def written(module: ModuleType) -> tuple[set[str], set[str], set[str]]:
    """Functions that a module defines, calls of its own, and calls of others, by its AST."""
    tree = ast.parse(inspect.getsource(module))
    defined = {node.name for node in tree.body if isinstance(node, ast.FunctionDef)}
    called = {
        node.func.id
        for node in ast.walk(tree)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }
    known = {*COMMON, *dir(__builtins__), *__builtins__}
    records = {name for name, value in vars(module).items() if isinstance(value, type)}
    return defined, called & defined, called - defined - known - records


def disagreements(module: ModuleType) -> list[str]:
    """What a module says of itself and its text does not."""
    kernels: Kernels = module.KERNELS
    defined, own, others = written(module)
    offered = {*kernels.provides, *kernels.loops}
    faults = [f"requires {name}" for name in others ^ {*kernels.requires, *kernels.native}]
    faults += [f"offers {name}" for name in offered - defined]
    faults += [f"hides {name}" for name in defined - own - offered]
    hinted = {*kernels.called, *kernels.shared, *kernels.merged}
    return faults + [f"hints {name}" for name in hinted - defined]


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_what_a_module_declares_is_what_it_does(module: ModuleType) -> None:
    assert disagreements(module) == []


def test_all_samplers_and_searches_declare_themselves() -> None:
    names = {module.__name__.removeprefix("asperity.") for module in MODULES}
    assert names >= {"textures.samplers.sinusoid", "contacts.split.solver", "kernels.sampler_loops"}
    assert len(names) > 15


FAULTS = {
    "requires b": "KERNELS = Kernels(provides=('a',))\ndef a(x): return b(x)",
    "requires c": "KERNELS = Kernels(provides=('a',), requires=('c',))\ndef a(x): return x",
    "offers b": "KERNELS = Kernels(provides=('a', 'b'))\ndef a(x): return x",
    "hides b": "KERNELS = Kernels(provides=('a',))\ndef a(x): return x\ndef b(x): return x",
    "hints c": "KERNELS = Kernels(provides=('a',), called=('c',))\ndef a(x): return x",
}


@pytest.fixture
def user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Make]:
    """``user(text)``: a module of a user's, outside of the package."""
    monkeypatch.syspath_prepend(str(tmp_path))
    names: list[str] = []

    def make(text: str) -> ModuleType:
        names.append(f"users_module_{len(names)}_{abs(hash(text))}")
        text = "from asperity.compiled import Kernels\n" + text
        (tmp_path / f"{names[-1]}.py").write_text(text, encoding="utf-8")
        return importlib.import_module(names[-1])

    yield make
    for name in names:
        del sys.modules[name]


@pytest.mark.parametrize("fault", FAULTS)
def test_a_declaration_that_lies_is_found(fault: str, user: Make) -> None:
    assert disagreements(user(FAULTS[fault])) == [fault]


# --- linking --------------------------------------------------------------------------------------

LOOP = "def run_batch(x): return one(x)"
ONE = "def one(x): return helper(x)\ndef helper(x): return 1\ndef idle(x): return 0"
TWO = "def one(x): return 2"


def unit(name: str, text: str, **kernels: Any) -> Unit:
    return text_unit(name, text, Kernels(**kernels))


def result(*at_hand: Unit) -> int:
    loop = unit("loop", LOOP, requires=("one",), loops=("run_batch",))
    text = link(loops_of(loop), (*at_hand, loop))
    space: dict[str, object] = {name: lambda f: f for name in ("loop", "inlined", "scalar")}
    exec(text, space)
    assert "idle" not in space
    return space["run_batch"](0)


def test_the_first_that_provides_a_name_is_taken() -> None:
    one, two = unit("m1", ONE, provides=("one",)), unit("m2", TWO, provides=("one",))
    assert (result(one, two), result(two, one)) == (1, 2)


def test_what_a_module_keeps_to_itself_is_its_own() -> None:
    """A helper is not offered: another module's function of that name does not replace it."""
    one, other = unit("m1", ONE, provides=("one",)), unit("m2", "def helper(x): return 7")
    assert result(other, one) == 1
    offered = unit("m2", "def helper(x): return 7", provides=("helper",))
    assert result(offered, one) == 1
    open_ = unit("m1", ONE, provides=("one", "helper"))
    assert result(offered, open_) == 7


def test_two_needed_functions_of_one_name_are_an_error() -> None:
    one = unit("m1", "def one(x): return two(x) + helper(x)\ndef helper(x): return 1",
               provides=("one",), requires=("two",))  # fmt: skip
    two = unit("m2", "def two(x): return helper(x)\ndef helper(x): return 2", provides=("two",))
    with pytest.raises(ParameterError, match="two functions 'helper', of m"):
        result(one, two)


def test_what_is_required_and_missing_is_named() -> None:
    with pytest.raises(MissingFunctionError, match="provide 'one', which loop requires"):
        result()
    secret = unit("m1", "def one(x): return other(x)", provides=("one",))
    with pytest.raises(ParameterError, match="m1 calls 'other', which it neither defines nor"):
        result(secret)


def test_a_module_without_a_declaration_is_refused() -> None:
    with pytest.raises(ParameterError, match="test_link must declare KERNELS"):
        module_unit(sys.modules[__name__])


def decorators(text: str) -> dict[str, str]:
    lines = text.splitlines()
    names = {i: line for i, line in enumerate(lines) if line.startswith("def ")}
    return {line[4 : line.index("(")]: lines[i - 1] for i, line in names.items()}


@pytest.mark.parametrize(
    ("iterates", "expected"),
    [(False, "@inlined @scalar @inlined"), (True, "@scalar @scalar @merged")],
)
def test_hints_are_followed(iterates: bool, expected: str) -> None:
    text = "def run(x): return a(x) + b(x) + c(x)\n" + "".join(
        f"def {name}(x): return x\n" for name in "abc"
    )
    one = unit("m", text, loops=("run",), called=("b",), merged=("c",), iterates=iterates)
    found = decorators(link(loops_of(one), (one,)))
    assert found == dict(zip(["run", "a", "b", "c"], ["@loop", *expected.split()], strict=True))


# --- textures -------------------------------------------------------------------------------------

FLAT = """KERNELS = Kernels(provides=("height", "slope"))
def height(x, y, texture): return 0.1 * x
def slope(x, y, texture): return 0.1 * x, 0.1, 0.0
"""


def test_a_texture_serves_the_laws_that_need_no_more_than_it_offers(user: Make) -> None:
    """A needs slopes; B second derivatives, E nearest points, and both say so."""
    sampler = (user(FLAT),)
    fuse.fuse_surface(LAWS["A"], sampler, "none")
    what = r"texture must offer second derivatives \(a sampler function 'curvature'\), which law B"
    with pytest.raises(ParameterError, match=rf"{what}.*users_module.* offers height, slope"):
        fuse.fuse_surface(LAWS["B"], sampler, "none")
    with pytest.raises(ParameterError, match=r"texture must offer nearest points.*law E"):
        fuse.fuse_surface(LAWS["E"], sampler, "none")
    with pytest.raises(ParameterError, match=r"texture must offer second derivatives.*law H"):
        fuse.fuse_surface(LAWS["H"], sampler, "none")


def test_loops_over_a_texture_are_those_that_it_can_serve(user: Make) -> None:
    loops = fuse.fuse_sampler((user(FLAT),))
    out = np.empty((1, 1))
    loops.height_batch(np.array([[2.0, 0.0]]), out, ())
    assert out[0, 0] == 0.2
    with pytest.raises(ParameterError, match="texture must offer second derivatives"):
        loops.curvature_batch(np.zeros((1, 2)), np.empty((1, 6)), ())


def test_the_closed_form_of_a_sinusoid_comes_before_the_general_split() -> None:
    split = fuse.fuse_surface(LAWS["H"], Sinusoid(1e-3, 1e-3).sampler, "none")
    text = "".join(linecache.getlines(split.__file__ or ""))
    assert "def split_foot" in text
    assert "def split_polish" not in text


# --- records and numbers --------------------------------------------------------------------------

RECORD = """
from typing import NamedTuple
KERNELS = Kernels(loops=("run_batch",))
LIMIT = 2.5
class Pair(NamedTuple):
    a: float
    b: float
def run_batch(x):
    return Pair(min(x, LIMIT), x)
"""


def test_records_and_numbers_of_a_module_come_along(user: Make) -> None:
    module = user(RECORD)
    loops = fuse.fuse_module(module)
    assert loops.run_batch(3.0) == module.Pair(2.5, 3.0)
    assert isinstance(loops.run_batch(3.0), module.Pair)


def test_a_number_of_two_values_is_an_error(user: Make) -> None:
    one = module_unit(
        user("LIMIT = 1\nKERNELS = Kernels(('one',))\ndef one(x): return LIMIT + two(x)")
    )
    two = module_unit(user("LIMIT = 2\nKERNELS = Kernels(('two',))\ndef two(x): return LIMIT"))
    one = replace(one, kernels=Kernels(("one",), ("two",), ("one",)))
    with pytest.raises(ParameterError, match=r"defines 'LIMIT' in two ways: 'LIMIT = [12]' and"):
        link(loops_of(one), (one, two))
