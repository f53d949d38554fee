"""Modules say what they provide and require, and the linker goes by that alone."""

from __future__ import annotations

import ast
import importlib
import inspect
import linecache
import pkgutil
import sys
from collections import namedtuple
from collections.abc import Callable, Iterator
from dataclasses import replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import pytest

import asperity
from asperity.clamps import NONE
from asperity.core.compiled import Kernels
from asperity.core.errors import ParameterError
from asperity.kernels import fuse
from asperity.kernels.link import (
    INTRINSIC_MODULES,
    MissingFunctionError,
    SourceUnit,
    link,
    loops_of,
    unit_from_module,
    unit_from_source,
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
    known = {*INTRINSIC_MODULES, *dir(__builtins__), *__builtins__}
    records = {name for name, value in vars(module).items() if isinstance(value, type)}
    return defined, called & defined, called - defined - known - records


def disagreements(module: ModuleType) -> list[str]:
    """What a module says of itself and its text does not."""
    kernels = unit_from_module(module).kernels
    defined, own, others = written(module)
    offered = {*kernels.provides, *kernels.loops}
    faults = [f"calls {name}" for name in others - vars(module).keys()]
    faults += [f"binds {name}" for name in {*kernels.native} - others]
    faults += [f"offers {name}" for name in offered - defined]
    faults += [f"hides {name}" for name in defined - own - offered]
    hinted = {*kernels.not_inlined, *kernels.shared, *kernels.merged}
    return faults + [f"hints {name}" for name in hinted - defined]


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_what_a_module_declares_is_what_it_does(module: ModuleType) -> None:
    assert disagreements(module) == []


def test_all_samplers_and_searches_declare_themselves() -> None:
    names = {module.__name__.removeprefix("asperity.") for module in MODULES}
    assert names >= {"textures.kinds.sinusoid_sampler", "contacts.split.solver"}
    assert "kernels.loops.sampler_loops" in names
    assert len(names) > 15


FAULTS = {
    "calls b": "KERNELS = Kernels(provides=('a',))\ndef a(x): return b(x)",
    "binds c": "KERNELS = Kernels(provides=('a',), native=('c',))\ndef a(x): return x",
    "offers b": "KERNELS = Kernels(provides=('a', 'b'))\ndef a(x): return x",
    "hides b": "KERNELS = Kernels(provides=('a',))\ndef a(x): return x\ndef b(x): return x",
    "hints c": "KERNELS = Kernels(provides=('a',), not_inlined=('c',))\ndef a(x): return x",
}


@pytest.fixture
def user(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[Make]:
    """``user(text)``: a module of a user's, outside of the package."""
    monkeypatch.syspath_prepend(str(tmp_path))
    names: list[str] = []

    def make(text: str) -> ModuleType:
        names.append(f"users_module_{len(names)}_{abs(hash(text))}")
        text = "from asperity.core.compiled import Kernels\n" + text
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


def unit(name: str, text: str, **kernels: Any) -> SourceUnit:
    return unit_from_source(name, text, Kernels(**kernels))


def result(*at_hand: SourceUnit) -> int:
    loop = unit("loop", LOOP, loops=("run_batch",))
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
               provides=("one",))  # fmt: skip
    two = unit("m2", "def two(x): return helper(x)\ndef helper(x): return 2", provides=("two",))
    with pytest.raises(ParameterError, match="function 'helper' is defined by both m"):
        result(one, two)


def test_what_is_required_and_missing_is_named() -> None:
    with pytest.raises(MissingFunctionError, match="provide 'one', which loop requires"):
        result()
    secret = unit("m1", "def one(x): return other(x)", provides=("one",))
    with pytest.raises(MissingFunctionError, match="provide 'other', which m1 requires"):
        result(secret)


def test_a_module_without_a_declaration_is_refused() -> None:
    with pytest.raises(ParameterError, match="test_link must declare KERNELS"):
        unit_from_module(sys.modules[__name__])


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
    one = unit("m", text, loops=("run",), not_inlined=("b",), merged=("c",), iterates=iterates)
    found = decorators(link(loops_of(one), (one,)))
    assert found == dict(zip(["run", "a", "b", "c"], ["@loop", *expected.split()], strict=True))


# --- textures -------------------------------------------------------------------------------------

FLAT = """KERNELS = Kernels(provides=("sample_height", "sample_gradient"))
def sample_height(x, y, texture): return 0.1 * x
def sample_gradient(x, y, texture): return 0.1 * x, 0.1, 0.0
"""


def test_a_texture_serves_the_laws_that_need_no_more_than_it_offers(user: Make) -> None:
    """A needs slopes; B second derivatives, E nearest points, and both say so."""
    sampler = (user(FLAT),)
    fuse.fuse_surface(LAWS["A"], sampler, NONE)
    what = (
        r"texture lacks the sampler function 'sample_hessian' \(second derivatives\), required by"
    )
    provided = "provides sample_gradient, sample_height"
    with pytest.raises(ParameterError, match=rf"{what} law B.*users_module.* {provided}"):
        fuse.fuse_surface(LAWS["B"], sampler, NONE)
    with pytest.raises(ParameterError, match=r"texture lacks .*closest points.*law E"):
        fuse.fuse_surface(LAWS["E"], sampler, NONE)
    with pytest.raises(ParameterError, match=r"texture lacks .*second derivatives.*law H"):
        fuse.fuse_surface(LAWS["H"], sampler, NONE)


def test_loops_over_a_texture_are_those_that_it_can_serve(user: Make) -> None:
    loops = fuse.fuse_sampler((user(FLAT),))
    out = np.empty((1, 1))
    loops.height_batch(np.array([[2.0, 0.0]]), out, ())
    assert out[0, 0] == 0.2
    with pytest.raises(ParameterError, match=r"texture lacks .*second derivatives"):
        loops.curvature_batch(np.zeros((1, 2)), np.empty((1, 6)), ())


def test_the_closed_form_of_a_sinusoid_comes_before_the_general_split() -> None:
    split = fuse.fuse_surface(LAWS["H"], Sinusoid(1e-3, 1e-3).sampler, NONE)
    text = "".join(linecache.getlines(split.__file__ or ""))
    assert "def split_contact" in text
    assert "def split_newton" not in text


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


def test_the_fields_of_a_record_are_part_of_the_text() -> None:
    """Machine code accesses fields by position: other fields of the same record need other code."""
    text = "def run_batch(x): return Pair(x, x).a"
    lines = set()
    for fields in ("a b", "b a", "a b c"):
        space = {"Pair": namedtuple("Pair", fields, module="home")}
        lines.add(unit_from_source("m", text, Kernels(), space).definitions["run_batch"]["Pair"])
    assert len(lines) == 3
    assert "from home import Pair  # a b" in lines


def test_a_number_of_two_values_is_an_error(user: Make) -> None:
    one = unit_from_module(
        user("LIMIT = 1\nKERNELS = Kernels(('one',))\ndef one(x): return LIMIT + two(x)")
    )
    two = unit_from_module(user("LIMIT = 2\nKERNELS = Kernels(('two',))\ndef two(x): return LIMIT"))
    one = replace(one, kernels=Kernels(("one",), loops=("one",)))
    with pytest.raises(ParameterError, match=r"defines 'LIMIT' in two ways: 'LIMIT = [12]' and"):
        link(loops_of(one), (one, two))
