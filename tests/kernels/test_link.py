"""Modules declare what they provide and require, and the linker uses only these declarations."""

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
from asperity.core.compiled import Kernels
from asperity.core.errors import ParameterError
from asperity.kernels import fuse
from asperity.kernels.link import (
    INTRINSIC_MODULES,
    MissingFunctionError,
    SourceUnit,
    link,
    link_modules,
    loops_of,
    unit_from_module,
    unit_from_source,
)
from asperity.laws import LAWS
from asperity.laws.clamps import NONE
from asperity.textures import Sinusoid


def compiled_modules() -> Iterator[ModuleType]:
    """Yield the modules of the package that declare kernels."""
    for info in pkgutil.walk_packages(asperity.__path__, "asperity."):
        path = Path(info.module_finder.path) / f"{info.name.rpartition('.')[2]}.py"
        if path.exists() and "\nKERNELS = " in path.read_text(encoding="utf-8"):
            yield importlib.import_module(info.name)


MakeModule = Callable[[str], ModuleType]

MODULES = list(compiled_modules())


def called_names(function: ast.FunctionDef) -> set[str]:
    """Return the names that a function calls."""
    return {
        node.func.id
        for node in ast.walk(function)
        if isinstance(node, ast.Call) and isinstance(node.func, ast.Name)
    }


def is_record(node: ast.ClassDef) -> bool:
    return "NamedTuple" in [getattr(base, "id", "") for base in node.bases]


def parsed_functions(module: ModuleType) -> tuple[set[str], set[str], set[str]]:
    """Return functions that a module compiles, calls of these, and calls of others, by its AST.

    A driver's module holds its Python class and functions, too: there, what is compiled is what
    the offered functions call.
    """
    tree = ast.parse(inspect.getsource(module))
    functions = {node.name: node for node in tree.body if isinstance(node, ast.FunctionDef)}
    calls = {name: called_names(node) for name, node in functions.items()}
    defined = set(functions)
    if any(isinstance(node, ast.ClassDef) and not is_record(node) for node in tree.body):
        kernels = unit_from_module(module).kernels
        pending = [*kernels.provides, *kernels.loops]
        defined = set()
        while pending:
            name = pending.pop()
            if name in functions and name not in defined:
                defined.add(name)
                pending += calls[name]
    called = set[str]().union(*(calls[name] for name in defined))
    builtin_names = {*INTRINSIC_MODULES, *dir(__builtins__), *__builtins__}
    records = {name for name, value in vars(module).items() if isinstance(value, type)}
    return defined, called & defined, called - defined - builtin_names - records


def disagreements(module: ModuleType) -> list[str]:
    """Return the differences between a module's declaration and its source."""
    kernels = unit_from_module(module).kernels
    defined, internal_calls, external_calls = parsed_functions(module)
    offered = {*kernels.provides, *kernels.loops}
    faults = [f"calls {name}" for name in external_calls - vars(module).keys()]
    faults += [f"binds {name}" for name in {*kernels.native} - external_calls]
    faults += [f"offers {name}" for name in offered - defined]
    faults += [f"hides {name}" for name in defined - internal_calls - offered]
    return faults + [f"shares {name}" for name in {*kernels.shared} - defined]


@pytest.mark.parametrize("module", MODULES, ids=lambda module: module.__name__)
def test_declaration_of_a_module_matches_its_source(module: ModuleType) -> None:
    assert disagreements(module) == []


def test_samplers_and_searches_declare_kernels() -> None:
    names = {module.__name__.removeprefix("asperity.") for module in MODULES}
    assert names >= {"textures.kinds.sinusoid_sampler", "contacts.split_solver"}
    assert "kernels.sampler_loops" in names
    assert len(names) > 15


FAULTS = {
    "calls b": "KERNELS = Kernels(provides=('a',))\ndef a(x): return b(x)",
    "binds c": "KERNELS = Kernels(provides=('a',), native=('c',))\ndef a(x): return x",
    "offers b": "KERNELS = Kernels(provides=('a', 'b'))\ndef a(x): return x",
    "hides b": "KERNELS = Kernels(provides=('a',))\ndef a(x): return x\ndef b(x): return x",
    "shares c": "KERNELS = Kernels(provides=('a',), shared=('c',))\ndef a(x): return x",
}


@pytest.fixture
def user_module(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[MakeModule]:
    """``user_module(text)`` writes and imports a module outside of the package."""
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
def test_wrong_declaration_is_detected(fault: str, user_module: MakeModule) -> None:
    assert disagreements(user_module(FAULTS[fault])) == [fault]


# --- linking --------------------------------------------------------------------------------------

LOOP = "def run_batch(x): return one(x)"
ONE = "def one(x): return helper(x)\ndef helper(x): return 1\ndef idle(x): return 0"
TWO = "def one(x): return 2"


def unit(name: str, text: str, **kernels: Any) -> SourceUnit:
    return unit_from_source(name, text, Kernels(**kernels))


def link_and_run(*units: SourceUnit) -> int:
    loop = unit("loop", LOOP, loops=("run_batch",))
    text = link(loops_of(loop), (*units, loop))
    space: dict[str, object] = {name: lambda f: f for name in ("loop", "inlined", "scalar")}
    exec(text, space)
    assert "idle" not in space
    return space["run_batch"](0)


def test_first_provider_of_a_name_is_used() -> None:
    one, two = unit("m1", ONE, provides=("one",)), unit("m2", TWO, provides=("one",))
    assert (link_and_run(one, two), link_and_run(two, one)) == (1, 2)


def test_private_function_is_not_replaced() -> None:
    """A function that is not provided is never replaced by another module's function."""
    one, private_helper = unit("m1", ONE, provides=("one",)), unit("m2", "def helper(x): return 7")
    assert link_and_run(private_helper, one) == 1
    public_helper = unit("m2", "def helper(x): return 7", provides=("helper",))
    assert link_and_run(public_helper, one) == 1
    public_module = unit("m1", ONE, provides=("one", "helper"))
    assert link_and_run(public_helper, public_module) == 7


def test_name_conflict_of_required_functions_is_an_error() -> None:
    one = unit(
        "m1", "def one(x): return two(x) + helper(x)\ndef helper(x): return 1", provides=("one",)
    )
    two = unit("m2", "def two(x): return helper(x)\ndef helper(x): return 2", provides=("two",))
    with pytest.raises(ParameterError, match="function 'helper' is defined by both m"):
        link_and_run(one, two)


def test_missing_function_is_named_in_the_error() -> None:
    with pytest.raises(MissingFunctionError, match="provide 'one', which loop requires"):
        link_and_run()
    requiring = unit("m1", "def one(x): return other(x)", provides=("one",))
    with pytest.raises(MissingFunctionError, match="provide 'other', which m1 requires"):
        link_and_run(requiring)


def test_module_without_declaration_is_an_error() -> None:
    with pytest.raises(ParameterError, match="test_link must declare KERNELS"):
        unit_from_module(sys.modules[__name__])


def decorators(text: str) -> dict[str, str]:
    lines = text.splitlines()
    names = {i: line for i, line in enumerate(lines) if line.startswith("def ")}
    return {line[4 : line.index("(")]: lines[i - 1] for i, line in names.items()}


@pytest.mark.parametrize(("iterates", "expected"), [(False, "@inlined"), (True, "@scalar")])
def test_compilation_hints_become_decorators(iterates: bool, expected: str) -> None:
    bodies = {"run": "a(x) + b(x)", "a": "x", "b": "c(x)", "c": "x"}
    text = "".join(f"def {name}(x): return {body}\n" for name, body in bodies.items())
    module = unit("m", text, loops=("run",), shared=("b",), iterates=iterates)
    shared, loops = (decorators(part.source) for part in link_modules(loops_of(module), (module,)))
    assert shared == {"b": "@shared", "c": expected}
    assert loops == {"run": "@loop", "a": expected}


# --- textures -------------------------------------------------------------------------------------

FLAT = """KERNELS = Kernels(provides=("sample_height", "sample_gradient"))
def sample_height(x, y, texture): return 0.1 * x
def sample_gradient(x, y, texture): return 0.1 * x, 0.1, 0.0
"""


def test_law_that_requires_a_missing_sampler_is_an_error(user_module: MakeModule) -> None:
    """A needs slopes; B second derivatives; E closest points."""
    sampler = (user_module(FLAT),)
    fuse.fuse_surface(LAWS["A"], sampler, NONE)
    missing = (
        r"texture lacks the sampler function 'sample_hessian' \(second derivatives\), required by"
    )
    provided = "provides sample_gradient, sample_height"
    with pytest.raises(ParameterError, match=rf"{missing} law B.*users_module.* {provided}"):
        fuse.fuse_surface(LAWS["B"], sampler, NONE)
    with pytest.raises(ParameterError, match=r"texture lacks .*closest points.*law E"):
        fuse.fuse_surface(LAWS["E"], sampler, NONE)
    with pytest.raises(ParameterError, match=r"texture lacks .*second derivatives.*law H"):
        fuse.fuse_surface(LAWS["H"], sampler, NONE)


def test_sampler_loops_exist_for_provided_functions_only(user_module: MakeModule) -> None:
    loops = fuse.fuse_sampler((user_module(FLAT),))
    out = np.empty((1, 1))
    loops.height_batch(np.array([[2.0, 0.0]]), out, ())
    assert out[0, 0] == 0.2
    with pytest.raises(ParameterError, match=r"texture lacks .*second derivatives"):
        loops.curvature_batch(np.zeros((1, 2)), np.empty((1, 6)), ())


def test_sinusoid_uses_its_closed_form_of_the_split_contact() -> None:
    module = fuse.fuse_surface(LAWS["H"], Sinusoid(1e-3, 1e-3).sampler, NONE)
    text = "".join(linecache.getlines(module.__file__ or ""))
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


def test_records_and_constants_of_a_module_are_linked(user_module: MakeModule) -> None:
    module = user_module(RECORD)
    loops = fuse.fuse_module(module)
    assert loops.run_batch(3.0) == module.Pair(2.5, 3.0)
    assert isinstance(loops.run_batch(3.0), module.Pair)


def test_fields_of_a_record_are_part_of_the_linked_source() -> None:
    """Machine code accesses fields by position, so other fields need other code."""
    text = "def run_batch(x): return Pair(x, x).a"
    lines = set()
    for fields in ("a b", "b a", "a b c"):
        space = {"Pair": namedtuple("Pair", fields, module="home")}
        lines.add(unit_from_source("m", text, Kernels(), space).definitions["run_batch"]["Pair"])
    assert len(lines) == 3
    assert "from home import Pair  # a b" in lines


def test_constant_with_two_values_is_an_error(user_module: MakeModule) -> None:
    one = unit_from_module(
        user_module("LIMIT = 1\nKERNELS = Kernels(('one',))\ndef one(x): return LIMIT + two(x)")
    )
    two = unit_from_module(
        user_module("LIMIT = 2\nKERNELS = Kernels(('two',))\ndef two(x): return LIMIT")
    )
    one = replace(one, kernels=Kernels(("one",), loops=("one",)))
    with pytest.raises(ParameterError, match=r"defines 'LIMIT' in two ways: 'LIMIT = [12]' and"):
        link(loops_of(one), (one, two))
