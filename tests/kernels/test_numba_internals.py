"""The private parts of Numba that ``numba_internals`` uses exist, with the expected signatures.

If one of these tests fails after an upgrade of Numba, its message names the class or function of
``asperity.kernels.numba_internals`` that has to be adapted. Then raise the upper bound of Numba in
pyproject.toml.
"""

from __future__ import annotations

import inspect
import re
import tomllib
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numba
import numpy as np
import pytest
from numba import _dynfunc
from numba.core import codegen, compiler, dispatcher, targetconfig, typed_passes, types

from asperity.kernels import numba_internals

# The private name, its parameters (None: not inspected), and what uses it.
USED: dict[str, tuple[Any, str, tuple[str, ...] | None, str]] = {
    "optimize": (codegen.JITCodeLibrary, "_optimize_final_module", ("self",), "LinkOnlyLibrary"),
    "finalize": (codegen.JITCodeLibrary, "_finalize_final_module", ("self",), "LinkOnlyLibrary"),
    "globals": (codegen.JITCodeLibrary, "_finalize_dynamic_globals", ("self",), "LinkOnlyLibrary"),
    "verify": (
        codegen.CPUCodeLibrary,
        "_verify_declare_only_symbols",
        ("self",),
        "LinkOnlyLibrary",
    ),
    "link": (codegen.CPUCodeLibrary, "_get_module_for_linking", ("self",), "WideVectorLibrary"),
    "empty": (codegen.CPUCodegen, "_create_empty_module", ("self", "name"), "WideVectorLibrary"),
    "passes": (codegen.CPUCodegen, "_module_pass_manager", None, "WideVectorLibrary"),
    "add": (codegen.CodeLibrary, "add_ir_module", ("self", "ir_module"), "WideVectorLibrary"),
    "lower": (typed_passes.NativeLowering, "run_pass", ("self", "state"), "LinkOnlyLowering"),
    "pipeline": (compiler.Compiler, "define_pipelines", ("self",), "LoopCompiler"),
    "function": (_dynfunc, "make_function", None, "LinkOnlyLowering"),
    "rebuild": (compiler.CompileResult, "_rebuild", None, "MachineCodeCache._load_cached"),
    "reduce": (compiler.CompileResult, "_reduce", ("self",), "MachineCodeCache.save_overload"),
    "resolve": (
        types.BaseFunction,
        "get_call_type",
        ("function", "context", "args", "kws"),
        "remember_signatures",
    ),
    "magic": (codegen.CPUCodegen, "magic_tuple", ("self",), "MachineCodeCache._key"),
}


@pytest.mark.parametrize("case", USED)
def test_private_name_exists(case: str) -> None:
    owner, name, parameters, user = USED[case]
    message = f"Numba {numba.__version__}: {owner.__name__}.{name} changed; adapt {user}"
    assert hasattr(owner, name), message
    assert hasattr(numba_internals, user.partition(".")[0])
    if parameters is not None:
        assert tuple(inspect.signature(getattr(owner, name)).parameters) == parameters, message


def test_dispatcher_has_a_cache_and_a_compiler() -> None:
    function = numba.njit(lambda x: x)
    message = f"Numba {numba.__version__}: Dispatcher changed; adapt "
    assert isinstance(function, dispatcher.Dispatcher), message + "_is_link_only"
    assert hasattr(function, "_cache"), message + "cache_machine_code"
    assert function._compiler.pipeline_class is compiler.Compiler, message + "_is_link_only"


def test_libraries_know_what_they_link() -> None:
    message = f"Numba {numba.__version__}: CPUCodeLibrary changed; adapt "
    library = codegen.JITCPUCodegen("a test").create_library("a test")
    assert library._linking_libraries == [], message + "_shared_callees"
    assert library._shared_module is None, message + "WideVectorLibrary"
    assert not list(library._final_module.functions), message + "WideVectorLibrary"
    assert library.codegen._engine._defined_symbols == set(), message + "MachineCodeCache._rebuild"


def test_pipeline_has_one_lowering_pass() -> None:
    message = f"Numba {numba.__version__}: the pipeline changed; adapt _CustomLoweringCompiler"
    state = compiler.StateDict()
    state.flags, state.func_ir = compiler.Flags(), None
    for kind in (
        numba_internals.LinkOnlyCompiler,
        numba_internals.LoopCompiler,
        numba_internals.SharedCompiler,
    ):
        instance = object.__new__(kind)
        instance.state = state
        (manager,) = instance.define_pipelines()
        steps = [step for step, _description in manager.passes]
        (default,) = compiler.Compiler.define_pipelines(instance)
        unneeded = {step for step, _description in default.passes} - set(steps)
        unneeded.discard(typed_passes.NativeLowering)
        assert unneeded == set(numba_internals.UNNEEDED_PASSES), message
        assert steps.count(kind.lowering) == 1, message
        assert typed_passes.NativeLowering not in steps, message


def test_linked_functions_are_private_to_a_loop(monkeypatch: pytest.MonkeyPatch) -> None:
    libraries: list[Any] = []
    linkages: list[dict[str, str]] = []
    passes = codegen.CPUCodegen._module_pass_manager

    def create_passes(self: Any, **options: Any) -> Any:
        for library in libraries:
            functions = library.get_defined_functions()
            linkages.append({function.name: function.linkage.name for function in functions})
        return passes(self, **options)

    class Library(numba_internals.WideVectorLibrary):
        def _optimize_final_module(self) -> None:
            libraries.append(self)
            super()._optimize_final_module()

    monkeypatch.setattr(numba_internals, "WideVectorLibrary", Library)
    monkeypatch.setattr(codegen.CPUCodegen, "_module_pass_manager", create_passes)
    options: Any = {"error_model": "numpy", "_nrt": False, "no_cfunc_wrapper": True}
    link_only = {"no_cpython_wrapper": True, "pipeline_class": numba_internals.LinkOnlyCompiler}

    @numba.njit(**options, **link_only)
    def long_sum(x: Any) -> float:
        total = 0.0
        for i in range(x.shape[0]):
            total += x[i]
        return total

    @numba.njit(**options, pipeline_class=numba_internals.LoopCompiler)
    def loop(x: Any) -> float:
        return 2.0 * long_sum(x)

    assert loop(np.arange(4.0)) == 12.0
    (names,) = linkages
    assert [names[name] for name in names if "long_sum" in name] == ["internal"]
    assert "linkonce_odr" not in names.values()


def test_list_comprehension_is_refused_as_by_numba() -> None:
    options: Any = {"error_model": "numpy", "_nrt": False}

    @numba.njit(**options, pipeline_class=numba_internals.LoopCompiler)
    def loop(x: Any) -> float:
        return sum([2.0 * value for value in x])

    with pytest.raises(numba.TypingError, match="NRT required"):
        loop(np.arange(4.0))


def test_numba_dependency_has_an_upper_bound() -> None:
    project = tomllib.loads((Path(__file__).parents[2] / "pyproject.toml").read_text("utf-8"))
    (bound,) = [r for r in project["project"]["dependencies"] if r.startswith("numba")]
    major, minor = map(int, numba.__version__.split(".")[:2])
    assert re.fullmatch(rf"numba>=[0-9.]+,<{major}\.{minor + 1}", bound)


def test_equal_calls_are_resolved_once_for_the_options_of_the_caller() -> None:
    tried: list[Any] = []

    def resolve(function: Any, _context: Any, args: Any, _kws: Any) -> Any:
        tried.append(args)
        function._impl_keys[args] = len(tried)
        return SimpleNamespace(args=args)

    resolve_once = numba_internals.remember_signatures(resolve)
    function, flags = SimpleNamespace(_impl_keys={}), compiler.Flags()
    with targetconfig.ConfigStack().enter(flags):
        for args in (("float",), ("float",), ("int",), ("float",)):
            function._impl_keys.clear()
            assert resolve_once(function, None, args, {}).args == args
        assert (tried, function._impl_keys) == ([("float",), ("int",)], {("float",): 1})
        flags.error_model = "numpy"
        resolve_once(function, None, args, {})
    assert len(tried) == 3


def test_code_that_is_linked_in_another_way_has_another_key(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """A version before read entries of the next one, and ended with a segmentation fault."""
    function: Any = test_code_that_is_linked_in_another_way_has_another_key
    entry = numba_internals.MachineCodeCache(function, is_called=True)
    target = numba_internals.code_target()
    key = entry._key((), target, "cpython")
    monkeypatch.setattr(numba_internals, "_LINKING", 1)
    assert entry._key((), target, "cpython") != key
