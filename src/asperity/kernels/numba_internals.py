"""Everything that uses private parts of Numba: three compilers, and caches of types and code.

Private names: ``JITCodeLibrary`` with its methods ``_optimize_final_module``,
``_finalize_final_module``, ``_finalize_dynamic_globals``, ``_verify_declare_only_symbols`` and
``_get_module_for_linking`` and its ``_final_module``, ``_linking_libraries`` and
``_shared_module``, ``CPUCodegen._create_empty_module``, ``_module_pass_manager`` and ``_engine``,
``JitEngine._defined_symbols``, ``_dynfunc.make_function``, ``Dispatcher._cache`` and ``_compiler``,
``CompileResult._rebuild`` and ``_reduce``, ``registry.cpu_target``, ``BaseFunction.get_call_type``
and its ``_impl_keys``, ``Flags._values``. The dependency on Numba has an upper bound for their
sake, and ``tests/kernels/test_numba_internals.py`` says which of them a new version changes.

Compilers. Numba optimises each function and generates machine code for it with everything that it
calls, again at each level of a chain of calls. Only functions that Python calls need that. The
others are link-only: their code is optimised in the loop that they are linked into. Identical
link-only functions of several modules are lowered once. A shared function has machine code of its
own, which its callers call. What is linked into either is private to it, so that LLVM drops what
no call needs, which saves a quarter of the time of some loops. Loops are compiled for the widest
vector registers of the processor.

Cache. Numba's own cache unpickles an index and code without verification: a flipped bit crashes
every start, a planted file is executed. Here each compiled overload is one entry of
:mod:`asperity.core.cache`, verified before anything is unpickled, and there is no index. Of two
processes that need the same code at the same time one compiles it and the other waits. Before that,
code is looked for in the package itself, see :mod:`asperity.core.packed_code`.
"""

from __future__ import annotations

import hashlib
import pickle
import sys
from collections.abc import Callable
from contextlib import suppress
from types import FunctionType, ModuleType
from typing import Any

import llvmlite  # type: ignore[import-untyped]  # it has no types
import numba
from numba import _dynfunc
from numba.core import (
    codegen,
    compiler,
    compiler_machinery,
    dispatcher,
    registry,
    serialize,
    targetconfig,
    typed_passes,
    types,
)

from asperity.core import cache
from asperity.core.compiled import COMPILE_CALLBACKS
from asperity.core.packed_code import (
    CODE_NAMESPACE,
    INTERPRETER,
    CodeTarget,
    PackedCode,
    find_packed_code,
)
from asperity.core.processes import defer_interrupt


class LinkOnlyLibrary(codegen.JITCodeLibrary):  # type: ignore[misc]  # Numba is untyped
    """Code that is only linked into other code."""

    def _optimize_final_module(self) -> None:
        """Do nothing: the code is optimised in its callers."""

    def _finalize_final_module(self) -> None:
        self._finalize_dynamic_globals()
        self._verify_declare_only_symbols()
        self._finalized = True


@compiler_machinery.register_pass(mutates_CFG=True, analysis_only=False)
class LinkOnlyLowering(typed_passes.NativeLowering):  # type: ignore[misc]  # see above
    """Numba's lowering from typed code to LLVM code, without machine code."""

    _name = "link_only_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower a function."""
        context = state.targetctx
        name = state.func_id.func_qualname
        state.library = LinkOnlyLibrary(context.codegen(), name)
        state.flags.no_compile = True
        changed: bool = super().run_pass(state)
        lowered = state["cr"]
        # Callers find the function by this handle, which is never called: it has no code.
        module = lowered.fndesc.lookup_module()
        handle = _dynfunc.make_function(module, name, "", 0, lowered.env, (state.library,))
        context.insert_user_function(handle, lowered.fndesc, [state.library])
        state["cr"] = lowered._replace(cfunc=handle)
        return changed


class WideVectorLibrary(codegen.JITCodeLibrary):  # type: ignore[misc]  # see above
    """Code in the widest vector registers of the processor, which callers call by its symbol.

    Other code is copied into its callers. For many processors LLVM uses half of an AVX-512
    register, because programs with a few wide instructions would run at a lower clock rate. A loop
    over many points consists of them.
    """

    def add_ir_module(self, ir_module: Any) -> None:
        """Add functions; llvmlite prints unknown attributes, too."""
        for function in ir_module.functions:
            if not function.is_declaration:
                set.add(function.attributes, '"prefer-vector-width"="512"')
        super().add_ir_module(ir_module)

    def _optimize_final_module(self) -> None:
        """Optimise the code with the functions that were linked into it, which it alone calls.

        LLVM may then drop arguments that they do not use, such as most parts of a record, and
        checks of their status. Numba's pass before this one is for reference counts.
        """
        for function in self._final_module.functions:
            if function.linkage.name == "linkonce_odr" and not function.is_declaration:
                function.linkage = "internal"
        passes, builder = self._codegen._module_pass_manager()
        passes.run(self._final_module, builder)

    def _finalize_final_module(self) -> None:
        empty = self._codegen._create_empty_module(self.name)
        self._shared_module = llvmlite.binding.parse_assembly(str(empty))
        super()._finalize_final_module()


@compiler_machinery.register_pass(mutates_CFG=True, analysis_only=False)
class WideVectorLowering(typed_passes.NativeLowering):  # type: ignore[misc]  # see above
    """Numba's lowering from typed code to machine code, in wide registers."""

    _name = "wide_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower a function."""
        state.library = WideVectorLibrary(state.targetctx.codegen(), state.func_id.func_qualname)
        state.library.enable_object_caching()
        return bool(super().run_pass(state))


@compiler_machinery.register_pass(mutates_CFG=True, analysis_only=False)
class SharedLowering(WideVectorLowering):
    """The same, with a symbol that is equal in all processes."""

    _name = "shared_lowering"

    def run_pass(self, state: Any) -> bool:
        """Lower a function."""
        # Instead of a counter; Numba's symbols contain the names of records, but not their fields.
        fields = repr([_record_fields(argument) for argument in state.args])
        state.func_ir.func_id.unique_id = hashlib.sha256(fields.encode()).hexdigest()[:16]
        return super().run_pass(state)


# They are for array expressions and inlined overloads, which compiled modules do not hold; looking
# for them took 4 % of the time of compilation.
UNNEEDED_PASSES = (typed_passes.NopythonRewrites, typed_passes.InlineOverloads)


class _CustomLoweringCompiler(compiler.Compiler):  # type: ignore[misc]  # see above
    """Numba's compiler with a different lowering."""

    lowering: Any

    def define_pipelines(self) -> list[Any]:
        """Return Numba's pipeline with its lowering replaced, without UNNEEDED_PASSES."""
        (manager,) = super().define_pipelines()
        replaced = {typed_passes.NativeLowering: self.lowering}
        manager.passes = [
            (replaced.get(step, step), description)
            for step, description in manager.passes
            if step not in UNNEEDED_PASSES
        ]
        manager.finalize()
        return [manager]


class LinkOnlyCompiler(_CustomLoweringCompiler):
    """Compiler of link-only functions: ``njit(pipeline_class=LinkOnlyCompiler)``."""

    lowering = LinkOnlyLowering


class LoopCompiler(_CustomLoweringCompiler):
    """Compiler of loops over points or samples."""

    lowering = WideVectorLowering


class SharedCompiler(_CustomLoweringCompiler):
    """Compiler of the functions that loops share."""

    lowering = SharedLowering


def remember_signatures(resolve: Callable[..., Any]) -> Callable[..., Any]:
    """Return Numba's ``get_call_type`` such that it resolves equal calls once.

    Numba tries all implementations of an operator or function wherever it is used, which took a
    fifth of the time of compilation. What it finds depends on the types and on the options of the
    caller; a function to which somebody adds an implementation is another object.
    """

    def get_call_type(function: Any, context: Any, args: Any, kws: Any) -> Any:
        known = vars(function).setdefault("_resolved_calls", {})
        call = (context, tuple(args), tuple(dict(kws).items()))
        options = dict(getattr(targetconfig.ConfigStack.top_or_none(), "_values", {}))
        signature, implementation, used_options = known.get(call, (None, None, None))
        if signature is None or options != used_options:
            signature = resolve(function, context, args, kws)
            implementation = function._impl_keys[signature.args]
            known[call] = (signature, implementation, options)
        function._impl_keys[signature.args] = implementation
        return signature

    return get_call_type


types.BaseFunction.get_call_type = remember_signatures(types.BaseFunction.get_call_type)

_FUNCTION_IDS: dict[tuple[object, ...], int] = {}
_CANONICAL_FUNCTIONS: dict[int, Any] = {}


def share_identical_functions(module: ModuleType) -> None:
    """Replace link-only functions of a module by identical ones of earlier modules.

    Functions are identical if their code, the options of the compiler and all global names in the
    code are: numbers, records, and functions that are identical themselves. This happens before
    compilation, since a function looks up what it calls in the module that it comes from.
    """
    names = vars(module)
    known_ids = dict[FunctionType, int]()
    for name, value in list(names.items()):
        if _is_link_only(value) and value.py_func.__globals__ is names:
            names[name] = _CANONICAL_FUNCTIONS.setdefault(_function_id(value, known_ids), value)


def _is_link_only(value: object) -> bool:
    return (
        isinstance(value, dispatcher.Dispatcher)
        and value._compiler.pipeline_class is LinkOnlyCompiler
    )


def _function_id(dispatcher: Any, known_ids: dict[FunctionType, int]) -> int:
    """Return a number that identical link-only functions share; ``known_ids`` is a cache."""
    function: FunctionType = dispatcher.py_func
    if function not in known_ids:
        known_ids[function] = id(function)  # a recursive function is identical to no other
        code = function.__code__
        names = function.__globals__
        content = (code.co_code, repr(code.co_consts), code.co_names, code.co_varnames)
        options = repr(sorted(dispatcher.targetoptions.items()))
        used = tuple([_global_key(names.get(name), known_ids) for name in code.co_names])
        whole = (function.__name__, *content, repr(function.__defaults__), options, used)
        known_ids[function] = _FUNCTION_IDS.setdefault(whole, len(_FUNCTION_IDS))
    return known_ids[function]


def _global_key(value: object, known_ids: dict[FunctionType, int]) -> object:
    """Return a key of a global value in code; most objects are their own."""
    if _is_link_only(value):
        return "function", _function_id(value, known_ids)
    return repr(value) if isinstance(value, (int, float)) else id(value)


# How code is linked that entries hold. A version of the package that links in another way would
# end with a segmentation fault: raise the number where the libraries or lowerings above change.
_LINKING = 3


class MachineCodeCache:
    """Cache of the compiled overloads of one function, as Numba's dispatcher uses it.

    Args:
        function: the Python function; its module is named by the content of all that is compiled.
        is_called: whether Python calls it.
    """

    def __init__(self, function: FunctionType, is_called: bool) -> None:
        self._function = function
        self._is_called = is_called

    @property
    def cache_path(self) -> str:
        """The folder of the entries."""
        return str(cache.cache_folder() / CODE_NAMESPACE)

    def load_overload(self, sig: Any, target_context: Any) -> Any:
        """Return the compiled overload of a signature, or ``None`` to compile it."""
        target = code_target(target_context.codegen())
        target_context.refresh()
        packed = find_packed_code(target)
        overload = self._load_packed(packed, sig, target_context)
        if overload is not None:
            return overload
        key = self._key(sig, target, _interpreter())
        overload = self._load_cached(key, target_context)
        if overload is None and cache.wait_and_lock(CODE_NAMESPACE, key):
            overload = self._load_cached(key, target_context)
            if overload is not None:
                cache.unlock(CODE_NAMESPACE, key)
        if overload is None:
            packed.warn(self._packed_key(sig, packed))
            self._report(self._function.__name__)
        return overload

    def _load_packed(self, packed: PackedCode, sig: Any, target_context: Any) -> Any:
        content = packed.get_entry(self._packed_key(sig, packed))
        if content is None:
            return None
        with suppress(Exception):  # of another build of Numba: it is compiled, with a warning
            return self._rebuild(content, target_context)
        return None

    def _report(self, loop: str) -> None:
        for callback in COMPILE_CALLBACKS:
            callback(loop)

    def _load_cached(self, key: str, target_context: Any) -> Any:
        content = cache.get_entry(CODE_NAMESPACE, key)
        if content is None:
            return None
        try:
            return self._rebuild(content, target_context)
        except Exception:  # of another build of Numba: whatever it raises, compile again
            cache.quarantine(CODE_NAMESPACE, key)
            return None

    def _rebuild(self, content: bytes, target_context: Any) -> Any:
        *parts, callees = pickle.loads(content)
        for module, name, argument_types in callees:
            getattr(sys.modules[module], name).compile(argument_types)
        # Numba looks for this name in the code that callers copy: there is none.
        if self._is_called:
            engine = target_context.codegen()._engine
            engine._defined_symbols.add(parts[1].llvm_cpython_wrapper_name)
        return self._mark(compiler.CompileResult._rebuild(target_context, *parts))

    def save_overload(self, sig: Any, data: Any) -> None:
        """Store a compiled overload."""
        *parts, environments = self._mark(data)._reduce()
        # A link-only function may be of a module that does not exist where this code is loaded; no
        # compiled function uses its environment.
        module = self._function.__module__
        own = tuple([env for env in environments if env.globals["__name__"] == module])
        key = self._key(sig, code_target(data.codegen), _interpreter())
        content = (*parts, own, _shared_callees(data.library))
        cache.put_entry(CODE_NAMESPACE, key, serialize.dumps(content))
        cache.unlock(CODE_NAMESPACE, key)
        self._report("")

    def _mark(self, result: Any) -> Any:
        """Return compiled code with what its callers find it by in another process."""
        function = self._function
        result.library.origin = (function.__module__, function.__name__, result.signature.args)
        return result

    def _packed_key(self, sig: Any, packed: PackedCode) -> str:
        if packed.target is None:
            return ""
        return self._key(sig, packed.target, INTERPRETER)

    def _key(self, sig: Any, target: CodeTarget, interpreter: str) -> str:
        """Return what the machine code depends on: source, types, processor and versions."""
        versions = (interpreter, target.numba, target.llvmlite, sys.byteorder, _LINKING)
        types = (str(sig), *map(_record_fields, sig))
        function = (self._function.__module__, self._function.__name__, types)
        return repr((*function, tuple(target[2:]), *versions))


def code_target(codegen: Any = None) -> CodeTarget:
    """Return what this process compiles for."""
    codegen = codegen or registry.cpu_target.target_context.codegen()
    return CodeTarget(numba.__version__, llvmlite.__version__, *codegen.magic_tuple())


def _interpreter() -> str:
    """Return the interpreter for which code is compiled: for a named processor, of any build."""
    return sys.version if numba.config.CPU_NAME is None else INTERPRETER


def _shared_callees(library: Any) -> tuple[Any, ...]:
    """Return module, name and argument types of the shared functions that code calls."""
    callees = dict[Any, None]()
    waiting = [library]
    for caller in waiting:
        for linked in caller._linking_libraries:
            origin = getattr(linked, "origin", None)
            if origin is not None:
                callees[origin] = None
            elif linked not in waiting:
                waiting.append(linked)
    return tuple(callees)


def _record_fields(numba_type: Any) -> tuple[Any, ...]:
    """Return the module and fields of a record, on which stored code relies."""
    names = tuple(getattr(numba_type, "fields", ()))
    if names:
        names = (numba_type.instance_class.__module__, *names)
    return (*names, *map(_record_fields, getattr(numba_type, "types", ())))


def cache_machine_code(decorator: Callable[..., Any]) -> Callable[..., Any]:
    """Return a decorator of Numba whose functions cache their machine code between runs.

    Ctrl-C waits for the compiler, which would leave functions half compiled.
    """

    def decorate(function: FunctionType) -> Any:
        dispatcher = decorator(function)
        compile_overload = dispatcher.compile

        def compile_whole(signature: Any) -> Any:
            # No options of the caller are inherited: they are part of the symbol.
            with defer_interrupt(), compiler.ConfigStack().enter(compiler.Flags()):
                return compile_overload(signature)

        dispatcher.compile = compile_whole
        is_called = "no_cpython_wrapper" not in dispatcher.targetoptions
        dispatcher._cache = MachineCodeCache(function, is_called)
        return dispatcher

    return decorate
