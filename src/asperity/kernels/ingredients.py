"""Functions that are compiled into their callers only.

Of every function that Numba compiles it optimises the code, and makes machine code of it, with all
that it calls, again at each level of a chain of calls. Only what Python calls needs that: the code
of an ingredient is optimised once, in the loop that it ends up in.
"""

from __future__ import annotations

from typing import Any

from numba import _dynfunc  # type: ignore[attr-defined]  # of compiled code
from numba.core import codegen, compiler, compiler_machinery, typed_passes

# Numba is untyped.
_Library: Any = codegen.JITCodeLibrary
_Lowering: Any = typed_passes.NativeLowering
_Compiler: Any = compiler.Compiler
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


class IngredientCompiler(_Compiler):  # type: ignore[misc]  # see above
    """Numba's compiler with that step: ``njit(pipeline_class=IngredientCompiler)``."""

    def define_pipelines(self) -> list[Any]:
        """Return Numba's own pipeline, its lowering replaced."""
        (manager,) = super().define_pipelines()
        own = (IngredientLowering, "without machine code")
        manager.passes = [
            own if step is typed_passes.NativeLowering else (step, words)
            for step, words in manager.passes
        ]
        manager.finalize()
        return [manager]
