"""Functions that are compiled into their callers only.

Of every function that Numba compiles it optimises the code, and makes machine code of it, with all
that it calls, again at each level of a chain of calls. Only what Python calls needs that: the code
of an ingredient is optimised once, in the loop that it ends up in.

The functions of a texture are ingredients of every law on it: those that are the same in several
modules, with all that they call, are lowered once. The loop itself, and what loops share, is
compiled for the widest registers that the processor has.
"""

from __future__ import annotations

from types import FunctionType, ModuleType
from typing import Any

from numba import _dynfunc  # type: ignore[attr-defined]  # of compiled code
from numba.core import codegen, compiler, compiler_machinery, dispatcher, typed_passes

# Numba is untyped.
_Library: Any = codegen.JITCodeLibrary
_Lowering: Any = typed_passes.NativeLowering
_Compiler: Any = compiler.Compiler
_Dispatcher: Any = dispatcher.Dispatcher
_register: Any = compiler_machinery.register_pass


class Ingredient(_Library):  # type: ignore[misc]  # see above
    """Code that is only there to be linked into other code."""

    def _optimize_final_module(self) -> None:
        """Nothing: it is optimised where it is called."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


@_register(mutates_CFG=True, analysis_only=False)
class IngredientLowering(_Lowering):  # type: ignore[misc]  # see above
    """Numba's step from typed code to LLVM's, without machine code at its end."""

    _name = "ingredient_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower a function."""
        context, name = state.targetctx, state.func_id.func_qualname
        state.library = Ingredient(context.codegen(), name)
        state.flags.no_compile = True
        changed: bool = super().run_pass(state)
        lowered = state["cr"]
        # Callers look it up by this object, which nobody calls: there is no code at its address.
        module = lowered.fndesc.lookup_module()
        handle = _dynfunc.make_function(module, name, "", 0, lowered.env, (state.library,))
        context.insert_user_function(handle, lowered.fndesc, [state.library])
        state["cr"] = lowered._replace(cfunc=handle)
        return changed


class Wide(_Library):  # type: ignore[misc]  # see above
    """Code in registers as wide as the processor has.

    For many processors the compiler takes half of AVX-512's, for the sake of programs that need
    them now and then and would clock lower; a loop over many points needs nothing else.
    """

    def add_ir_module(self, ir_module: Any) -> None:
        """Add functions; llvmlite prints attributes that it does not know, too."""
        for function in ir_module.functions:
            if not function.is_declaration:
                set.add(function.attributes, '"prefer-vector-width"="512"')
        super().add_ir_module(ir_module)


@_register(mutates_CFG=True, analysis_only=False)
class WideLowering(_Lowering):  # type: ignore[misc]  # see above
    """Numba's step from typed code to machine code, in such registers."""

    _name = "wide_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower a function."""
        state.library = Wide(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        changed: bool = super().run_pass(state)
        return changed


class _WithLowering(_Compiler):  # type: ignore[misc]  # see above
    """Numba's compiler with another lowering."""

    lowering: Any

    def define_pipelines(self) -> list[Any]:
        """Return Numba's own pipeline, its lowering replaced."""
        (manager,) = super().define_pipelines()
        manager.passes = [
            (self.lowering if step is typed_passes.NativeLowering else step, words)
            for step, words in manager.passes
        ]
        manager.finalize()
        return [manager]


class IngredientCompiler(_WithLowering):
    """Numba's compiler of an ingredient: ``njit(pipeline_class=IngredientCompiler)``."""

    lowering = IngredientLowering


class LoopCompiler(_WithLowering):
    """Numba's compiler of a loop over many points, or many samples, and of what loops share."""

    lowering = WideLowering


_IDENTITIES: dict[tuple[object, ...], int] = {}
_KNOWN: dict[int, Any] = {}


def share_ingredients(module: ModuleType) -> None:
    """Replace ingredients of a module by those of earlier ones that are the same.

    They are where the code is, the options of the compiler, and all that the code names: numbers,
    records, and functions that are themselves the same. Nothing is compiled yet: a function finds
    what it calls in the module that it comes from.
    """
    names, found = vars(module), dict[FunctionType, int]()
    for name, value in list(names.items()):
        if _is_ingredient(value) and value.py_func.__globals__ is names:
            names[name] = _KNOWN.setdefault(_identity(value, found), value)


def _is_ingredient(value: object) -> bool:
    return isinstance(value, _Dispatcher) and value._compiler.pipeline_class is IngredientCompiler


def _identity(ingredient: Any, found: dict[FunctionType, int]) -> int:
    """Return a number that two ingredients share if they are the same; ``found``: known ones."""
    function: FunctionType = ingredient.py_func
    if function not in found:
        found[function] = id(function)  # one that calls itself is like no other
        code, names = function.__code__, function.__globals__
        said = (code.co_code, repr(code.co_consts), code.co_names, code.co_varnames)
        options = repr(sorted(ingredient.targetoptions.items()))
        named = tuple(_named(names.get(name), found) for name in code.co_names)
        whole = (function.__name__, *said, repr(function.__defaults__), options, named)
        found[function] = _IDENTITIES.setdefault(whole, len(_IDENTITIES))
    return found[function]


def _named(value: object, found: dict[FunctionType, int]) -> object:
    """Return what tells values that code names apart; most objects by themselves."""
    if _is_ingredient(value):
        return "ingredient", _identity(value, found)
    return repr(value) if isinstance(value, (int, float)) else id(value)
