"""Linker of compiled modules: it collects the functions that a loop needs from their providers.

The linker knows no module and no function by name: it uses what modules declare; see
:class:`asperity.core.compiled.Kernels`.
"""

from __future__ import annotations

import ast
import builtins
import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from threading import Lock
from types import MappingProxyType, ModuleType

from asperity.core.compiled import EVERY_FUNCTION, Kernels
from asperity.core.errors import ParameterError

# Python 3.11 counts the depth of a tree for all threads together: two that parse at once may fail
# with "AST constructor recursion depth mismatch" (python/cpython issue 106905).
_PARSE_LOCK = Lock()


def parse_source(source: str) -> ast.Module:
    """Return the syntax tree of a source text, in any thread."""
    with _PARSE_LOCK:
        return ast.parse(source)


# Any function may call these and built-in functions; linked modules import them.
_INTRINSICS = "asperity.kernels.intrinsics"
INTRINSIC_MODULES = dict.fromkeys(("local_array", "multiply_add", "load_unchecked"), _INTRINSICS)
_UNDECLARED_CALLS = INTRINSIC_MODULES.keys() | frozenset(dir(builtins))


class MissingFunctionError(ParameterError):
    """Error: no available module provides a required function.

    Attributes:
        name: of the function.
    """

    def __init__(self, name: str, caller: str) -> None:
        super().__init__("sampler", f"must provide {name!r}, which {caller} requires")
        self.name = name


@dataclass(frozen=True, eq=False)
class SourceUnit:
    """The functions of a module as source, and the declaration of the module.

    Attributes:
        name: of the module.
        kernels: its declaration.
        sources: source of each top-level function.
        calls: the functions that each of them calls, except intrinsic and built-in ones.
        definitions: for each function, the lines that define the records and numbers it uses.
    """

    name: str
    kernels: Kernels
    sources: dict[str, str]
    calls: dict[str, tuple[str, ...]]
    definitions: dict[str, dict[str, str]]

    def find_provider(self, name: str, available: Sequence[SourceUnit]) -> SourceUnit:
        """Return the unit whose function of a name one of this unit's functions calls.

        Raises:
            MissingFunctionError: if there is none.
        """
        if name in self.sources and name not in self.kernels.provides:
            return self
        for unit in available:
            if name in unit.kernels.provides:
                return unit
        raise MissingFunctionError(name, self.name)

    def decorator(self, name: str, iterates: bool) -> str:
        """Return the decorator of one of its functions, defined in the header of a fused module."""
        if name in self.kernels.loops:
            return "@loop"
        if name in self.kernels.shared:
            return "@shared"
        return "@scalar" if iterates else "@inlined"


def unit_from_source(
    name: str, source: str, kernels: Kernels, namespace: Mapping[str, object] = MappingProxyType({})
) -> SourceUnit:
    """Return the unit of a source text; the namespace holds its records and numbers."""
    functions = [node for node in parse_source(source).body if isinstance(node, ast.FunctionDef)]
    if kernels.provides == EVERY_FUNCTION:
        names = [node.name for node in functions if node.name not in kernels.loops]
        kernels = replace(kernels, provides=tuple(names))
    unit = SourceUnit(name, kernels, {}, {}, {})
    rows = source.split("\n")  # once; ast.get_source_segment would split it for every function
    for node in functions:
        lines = _used_definitions(node, namespace, kernels.native)
        text = rows[node.lineno - 1 : node.end_lineno]
        text[-1] = text[-1].encode()[: node.end_col_offset].decode()
        unit.sources[node.name] = "\n".join(text)
        unit.definitions[node.name] = lines
        unit.calls[node.name] = tuple(sorted(_called_functions(node) - lines.keys()))
    return unit


def _called_functions(function: ast.FunctionDef) -> frozenset[str]:
    nodes = ast.walk(function)
    calls = [node.func for node in nodes if isinstance(node, ast.Call)]
    names = [call.id for call in calls if isinstance(call, ast.Name)]
    return frozenset(names) - _UNDECLARED_CALLS


def _used_definitions(
    function: ast.FunctionDef, namespace: Mapping[str, object], native: tuple[str, ...]
) -> dict[str, str]:
    """Return the lines that define records, numbers and native functions that a body uses."""
    body = ast.Module(function.body, [])
    names = {node.id for node in ast.walk(body) if isinstance(node, ast.Name)}
    lines = {}
    for name in sorted(names & namespace.keys()):
        value = namespace[name]
        if name in native:
            lines[name] = f"from {_INTRINSICS} import {name}"
        elif isinstance(value, type) and issubclass(value, tuple):
            # The fields of a record are part of the text, and so of the key of its machine code.
            fields = " ".join(getattr(value, "_fields", ()))
            lines[name] = f"from {value.__module__} import {name}  # {fields}".rstrip(" #")
        elif isinstance(value, (int, float)):
            lines[name] = f"{name} = {value!r}"
    return lines


def generated_unit(name: str, source: str) -> SourceUnit:
    """Return the unit of a generated source text, which provides all of its functions."""
    return unit_from_source(name, source, Kernels(EVERY_FUNCTION))


_UNITS: dict[ModuleType, SourceUnit] = {}


def unit_from_module(module: ModuleType) -> SourceUnit:
    """Return the unit of a compiled module; all threads get the same unit.

    Raises:
        ParameterError: for a module without a declaration.
    """
    if module in _UNITS:
        return _UNITS[module]
    kernels = getattr(module, "KERNELS", None)
    if not isinstance(kernels, Kernels):
        raise ParameterError("sampler", f"{module.__name__} must declare KERNELS = Kernels(...)")
    unit = unit_from_source(module.__name__, inspect.getsource(module), kernels, vars(module))
    # Units are compared by identity: of two created by threads at once, the first is used.
    return _UNITS.setdefault(module, unit)


def loops_of(*units: SourceUnit) -> list[tuple[str, SourceUnit]]:
    """Return all loops of units, as arguments of :func:`link`."""
    return [(name, unit) for unit in units for name in unit.kernels.loops]


def link(loops: Sequence[tuple[str, SourceUnit]], available: Sequence[SourceUnit]) -> str:
    """Return the source of loops, each given with its unit, and of all functions they call.

    Raises:
        MissingFunctionError: for a function that is required and not provided.
        ParameterError: for two needed functions of the same name.
    """
    return _render_functions(_resolve_calls(loops, available, include_shared=True)[0], available)


@dataclass(frozen=True)
class LinkedModule:
    """A part of a program that is compiled separately.

    Attributes:
        title: the shared function and its module; empty for the loops.
        name: of that function.
        source: its functions.
        imports: the functions of earlier parts that it calls.
    """

    title: str
    name: str
    source: str
    imports: tuple[str, ...]


def link_modules(
    loops: Sequence[tuple[str, SourceUnit]], available: Sequence[SourceUnit]
) -> list[LinkedModule]:
    """Return the same in parts: each shared function in its own part, the loops in the last.

    A part comes after those that it imports from; its source does not depend on the importer.

    Raises:
        MissingFunctionError: see :func:`link`.
        ParameterError: see :func:`link`; for a shared function that calls itself indirectly.
    """
    owners: dict[str, SourceUnit] = {}
    parts: dict[str, LinkedModule] = {}

    def add(roots: Sequence[tuple[str, SourceUnit]], title: str, name: str) -> None:
        taken, borrowed = _resolve_calls(roots, available, include_shared=False)
        for callee, unit in borrowed.items():
            if callee not in owners:
                owners[callee] = unit
                add([(callee, unit)], f"Function {callee} of {unit.name}.", callee)
            elif owners[callee] is not unit:
                raise _duplicate_error(callee, owners[callee], unit)
            elif callee not in parts:  # its part is not complete yet
                reason = f"{unit.name}: the shared function {callee!r} calls itself"
                raise ParameterError("sampler", reason)
        parts[name] = LinkedModule(
            title, name, _render_functions(taken, available), tuple(sorted(borrowed))
        )

    add(loops, "", "")
    return list(parts.values())


def _resolve_calls(
    roots: Sequence[tuple[str, SourceUnit]], available: Sequence[SourceUnit], include_shared: bool
) -> tuple[dict[str, SourceUnit], dict[str, SourceUnit]]:
    """Return functions with their units: those to include here, and the shared ones."""
    taken: dict[str, SourceUnit] = {}
    borrowed: dict[str, SourceUnit] = {}
    waiting = list(roots)
    while waiting:
        name, unit = waiting.pop()
        first = taken.setdefault(name, unit)
        if first is not unit:
            raise _duplicate_error(name, first, unit)
        for callee in unit.calls[name]:
            owner = unit.find_provider(callee, available)
            if callee in owner.kernels.shared and not include_shared:
                if borrowed.setdefault(callee, owner) is not owner:
                    raise _duplicate_error(callee, borrowed[callee], owner)
            elif taken.get(callee) is not owner:
                waiting.append((callee, owner))
    return taken, borrowed


def _duplicate_error(name: str, first: SourceUnit, second: SourceUnit) -> ParameterError:
    reason = f"function {name!r} is defined by both {first.name} and {second.name}"
    return ParameterError("sampler", reason)


def _render_functions(functions: Mapping[str, SourceUnit], available: Sequence[SourceUnit]) -> str:
    """Return functions with their decorators, after the records and numbers that they use."""
    iterates = any(unit.kernels.iterates for unit in functions.values())
    parts = [
        f"{unit.decorator(name, iterates)}\n{text}"
        for unit in available
        for name, text in unit.sources.items()
        if functions.get(name) is unit
    ]
    return "\n\n\n".join([_definition_lines(functions), *parts]) + "\n"


def _definition_lines(functions: Mapping[str, SourceUnit]) -> str:
    """Return the lines that define records and numbers, each once."""
    lines: dict[str, str] = {}
    for name, unit in functions.items():
        for used, line in unit.definitions[name].items():
            if lines.setdefault(used, line) != line:
                reason = f"defines {used!r} in two ways: {line!r} and {lines[used]!r}"
                raise ParameterError("sampler", reason)
    return "\n".join(sorted(lines.values()))
