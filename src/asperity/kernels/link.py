"""Compiled modules put together: every function that is needed, and its provider.

The linker knows no module and no function by name: it goes by what modules declare, see
:class:`asperity.compiled.Kernels`.
"""

from __future__ import annotations

import ast
import builtins
import inspect
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from types import MappingProxyType, ModuleType

from asperity.compiled import Kernels
from asperity.errors import ParameterError
from asperity.kernels.parsing import tree_of

# Anyone may call these and what is built in; they are in the head of every linked text that does.
COMMON = {
    "local_array": "asperity.kernels.stack_memory",
    "multiply_add": "asperity.kernels.lanes",
    "number_at": "asperity.kernels.lanes",
}
_ANYONES = COMMON.keys() | frozenset(dir(builtins))


class MissingFunctionError(ParameterError):
    """A function that is required and that no module at hand provides.

    Attributes:
        name: of the function.
    """

    def __init__(self, name: str, caller: str) -> None:
        super().__init__("sampler", f"must provide {name!r}, which {caller} requires")
        self.name = name


@dataclass(frozen=True, eq=False)
class Unit:
    """The functions of a module as text, and what the module says of itself.

    Attributes:
        name: of the module.
        kernels: its declaration.
        texts: source of each top-level function.
        calls: the functions that each of them calls, but for those that anyone may call.
        lines: the lines that define the records and numbers of the module that each of them uses.
    """

    name: str
    kernels: Kernels
    texts: dict[str, str]
    calls: dict[str, tuple[str, ...]]
    lines: dict[str, dict[str, str]]

    def owner(self, name: str, at_hand: Sequence[Unit]) -> Unit:
        """Return the unit whose function of a name one of this unit's functions calls.

        Raises:
            MissingFunctionError: if there is none.
            ParameterError: for a function that is neither defined nor declared as required.
        """
        if name in self.texts and name not in self.kernels.provides:
            return self
        if name not in self.texts and name not in self.kernels.requires:
            words = f"{self.name} calls {name!r}, which it neither defines nor requires in KERNELS"
            raise ParameterError("sampler", words)
        for unit in at_hand:
            if name in unit.kernels.provides:
                return unit
        raise MissingFunctionError(name, self.name)

    def decorator(self, name: str, iterates: bool) -> str:
        """Return how one of its functions is compiled, in words of the head of a fused module."""
        kernels = self.kernels
        if name in kernels.loops:
            return "@loop"
        if name in kernels.shared:
            return "@shared"
        if iterates:
            return "@merged" if name in kernels.merged else "@scalar"
        return "@scalar" if name in kernels.called else "@inlined"


def text_unit(
    name: str, source: str, kernels: Kernels, space: Mapping[str, object] = MappingProxyType({})
) -> Unit:
    """Return the unit of a source text, whose records and numbers are in a name space."""
    unit = Unit(name, kernels, {}, {}, {})
    rows = source.split("\n")  # once: ast.get_source_segment splits it for every function
    for node in tree_of(source).body:
        if isinstance(node, ast.FunctionDef):
            lines = _lines(node, space, kernels.native)
            text = rows[node.lineno - 1 : node.end_lineno]
            text[-1] = text[-1].encode()[: node.end_col_offset].decode()
            unit.texts[node.name] = "\n".join(text)
            unit.lines[node.name] = lines
            unit.calls[node.name] = tuple(sorted(_calls(node) - lines.keys()))
    return unit


def _calls(function: ast.FunctionDef) -> frozenset[str]:
    nodes = ast.walk(function)
    calls = [node.func for node in nodes if isinstance(node, ast.Call)]
    return frozenset(call.id for call in calls if isinstance(call, ast.Name)) - _ANYONES


def _lines(
    function: ast.FunctionDef, space: Mapping[str, object], native: tuple[str, ...]
) -> dict[str, str]:
    """Return the lines that define records, numbers and native functions that a body uses."""
    body = (node for part in function.body for node in ast.walk(part))
    names = {node.id for node in body if isinstance(node, ast.Name)}
    lines = {}
    for name in sorted(names & space.keys()):
        value = space[name]
        if name in native or (isinstance(value, type) and issubclass(value, tuple)):
            lines[name] = f"from {value.__module__} import {name}"
        elif isinstance(value, (int, float)):
            lines[name] = f"{name} = {value!r}"
    return lines


def written_unit(
    name: str, source: str, *, loops: tuple[str, ...] = (), merged: tuple[str, ...] = ()
) -> Unit:
    """Return the unit of a text that code has written: it provides and requires all it can."""
    unit = text_unit(name, source, Kernels())
    called = {called for names in unit.calls.values() for called in names}
    provides = tuple(unit.texts)
    requires = tuple(sorted(called.difference(provides)))
    return replace(unit, kernels=Kernels(provides, requires, loops, merged=merged))


_UNITS: dict[ModuleType, Unit] = {}


def module_unit(module: ModuleType) -> Unit:
    """Return the unit of a compiled module: one and the same, whichever thread asks.

    Raises:
        ParameterError: for a module that does not declare itself.
    """
    if module in _UNITS:
        return _UNITS[module]
    kernels = getattr(module, "KERNELS", None)
    if not isinstance(kernels, Kernels):
        raise ParameterError("sampler", f"{module.__name__} must declare KERNELS = Kernels(...)")
    made = text_unit(module.__name__, inspect.getsource(module), kernels, vars(module))
    # Units are told apart by identity: of two that threads make at once, the first is kept.
    return _UNITS.setdefault(module, made)


def loops_of(*units: Unit) -> list[tuple[str, Unit]]:
    """Return all loops of units, as :func:`link` takes them."""
    return [(name, unit) for unit in units for name in unit.kernels.loops]


def link(loops: Sequence[tuple[str, Unit]], at_hand: Sequence[Unit]) -> str:
    """Return loops, each named with its unit, and all that they call, with their decorators.

    Raises:
        MissingFunctionError: for a function that is required and not provided.
        ParameterError: for two functions of one name that are both needed.
    """
    return _text(_needed(loops, at_hand, whole=True)[0], at_hand)


@dataclass(frozen=True)
class Part:
    """A piece of a program that is compiled on its own.

    Attributes:
        title: the function that it is made for, and its module; empty for the loops.
        name: of that function.
        source: its functions.
        borrows: the functions of earlier parts that it calls.
    """

    title: str
    name: str
    source: str
    borrows: tuple[str, ...]


def link_parts(loops: Sequence[tuple[str, Unit]], at_hand: Sequence[Unit]) -> list[Part]:
    """Return the same in parts: every shared function in one of its own, the loops in the last.

    A part comes after those that it borrows from, and is the same text whoever borrows from it.

    Raises:
        MissingFunctionError: see :func:`link`.
        ParameterError: see :func:`link`; for a shared function that calls itself by way of others.
    """
    owners: dict[str, Unit] = {}
    parts: dict[str, Part] = {}

    def add(roots: Sequence[tuple[str, Unit]], title: str, name: str) -> None:
        taken, borrowed = _needed(roots, at_hand, whole=False)
        for callee, unit in borrowed.items():
            if callee not in owners:
                owners[callee] = unit
                add([(callee, unit)], f"Function {callee} of {unit.name}.", callee)
            elif owners[callee] is not unit:
                raise _two(callee, owners[callee], unit)
            elif callee not in parts:  # it is under way
                words = f"{unit.name}: the shared function {callee!r} calls itself"
                raise ParameterError("sampler", words)
        parts[name] = Part(title, name, _text(taken, at_hand), tuple(sorted(borrowed)))

    add(loops, "", "")
    return list(parts.values())


def _needed(
    roots: Sequence[tuple[str, Unit]], at_hand: Sequence[Unit], whole: bool
) -> tuple[dict[str, Unit], dict[str, Unit]]:
    """Return functions with their units: those that are needed here, and the shared ones."""
    taken: dict[str, Unit] = {}
    borrowed: dict[str, Unit] = {}
    waiting = list(roots)
    while waiting:
        name, unit = waiting.pop()
        known = taken.setdefault(name, unit)
        if known is not unit:
            raise _two(name, known, unit)
        for callee in unit.calls[name]:
            owner = unit.owner(callee, at_hand)
            if callee in owner.kernels.shared and not whole:
                if borrowed.setdefault(callee, owner) is not owner:
                    raise _two(callee, borrowed[callee], owner)
            elif taken.get(callee) is not owner:
                waiting.append((callee, owner))
    return taken, borrowed


def _two(name: str, one: Unit, other: Unit) -> ParameterError:
    words = f"has two functions {name!r}, of {one.name} and of {other.name}"
    return ParameterError("sampler", words)


def _text(taken: Mapping[str, Unit], at_hand: Sequence[Unit]) -> str:
    """Return functions with their decorators, after the records and numbers that they use."""
    iterates = any(unit.kernels.iterates for unit in taken.values())
    parts = [
        f"{unit.decorator(name, iterates)}\n{text}"
        for unit in at_hand
        for name, text in unit.texts.items()
        if taken.get(name) is unit
    ]
    return "\n\n\n".join([_common_lines(taken), *parts]) + "\n"


def _common_lines(taken: Mapping[str, Unit]) -> str:
    """Return the lines that define records and numbers, each once."""
    lines: dict[str, str] = {}
    for name, unit in taken.items():
        for used, line in unit.lines[name].items():
            if lines.setdefault(used, line) != line:
                words = f"defines {used!r} in two ways: {line!r} and {lines[used]!r}"
                raise ParameterError("sampler", words)
    return "\n".join(sorted(lines.values()))
