"""Types and liveness of the variables of a compiled function, and the place of C declarations.

As in Numba, a function is typed for each combination of argument types by following its
assignments until no type changes.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from functools import lru_cache

from asperity.export import c_language as c
from asperity.export.c_language import ValueType, is_constant
from asperity.export.expression_types import (
    ExpressionTypes,
    ProgramContext,
    UnknownTypeError,
    called_name,
)


class FunctionTypes(ExpressionTypes):
    """Types of the variables of a function for given types of its arguments.

    Args:
        node: the function.
        argument_types: types of its arguments.
        program: the program, which types the other functions.

    Attributes:
        argument_types: types of the arguments, by name.
        types: types of the variables, by name.
        result_type: type of the result.
        written_arguments: arguments that are work arrays and that the function writes to.

    Raises:
        NotExportableError: for a construct that cannot be exported.
    """

    def __init__(
        self, node: ast.FunctionDef, argument_types: tuple[ValueType, ...], program: ProgramContext
    ) -> None:
        super().__init__(node, {}, program)
        self.argument_names = tuple([argument.arg for argument in node.args.args])
        self.argument_types = dict(zip(self.argument_names, argument_types, strict=True))
        self.types |= self.argument_types
        self._check_arguments()
        self._infer_variables()
        self.result_type = self.types.pop("return", c.VOID)
        self.written_arguments = self._find_written()

    def _infer_variables(self) -> None:
        """Follow the assignments until no type changes; types that are not known yet wait."""
        unknown: UnknownTypeError | None = None
        self._changed = True
        while self._changed:
            self._changed = False
            unknown = None
            for statement in _iterate_statements(self.node.body):
                try:
                    self._infer_statement(statement)
                except UnknownTypeError as error:
                    unknown = error
        if unknown is not None:
            raise unknown

    def _check_arguments(self) -> None:
        signature = self.node.args
        if signature.vararg or signature.kwarg or signature.kwonlyargs or signature.posonlyargs:
            raise self.not_exportable("has starred, keyword-only or positional-only arguments")

    # --- statements ------------------------------------------------------------------------------

    def _infer_statement(self, node: ast.stmt) -> None:
        if isinstance(node, ast.Assign):
            for target in node.targets:
                self._assign(target, node.value)
        elif isinstance(node, ast.AnnAssign):
            if node.value is not None:
                self._assign(node.target, node.value)
        elif isinstance(node, ast.AugAssign):
            self._assign(node.target, ast.BinOp(node.target, node.op, node.value))
        elif isinstance(node, ast.For):
            self._infer_loop(node)
        elif isinstance(node, ast.While) and node.orelse:
            raise self.not_exportable("has a loop with 'else'")
        elif isinstance(node, ast.Return) and node.value is not None:
            self._infer_return(self.infer(node.value))
        elif isinstance(node, ast.Expr):
            if not isinstance(node.value, (ast.Call, ast.Constant)):
                raise self.not_exportable("has an expression without effect", node.value)
        elif not isinstance(node, _CONTROL_FLOW):
            raise self.not_exportable(f"uses {type(node).__name__}", node)

    def _assign(self, target: ast.expr, value: ast.expr) -> None:
        self._assign_type(target, self.infer(value), value)

    def _assign_type(self, target: ast.expr, value_type: ValueType, value: ast.expr) -> None:
        if isinstance(target, ast.Tuple):
            self._unpack(target, value_type, value)
        elif isinstance(target, ast.Subscript):
            if c.is_constant(self.infer(target.value)):
                raise self.not_exportable("writes to the texture or the law", target)
        elif isinstance(target, ast.Name):
            self._unify(target.id, value_type)
        else:
            raise self.not_exportable("assigns to a target that is not a variable", target)

    def _unify(self, name: str, value_type: ValueType) -> None:
        if value_type == c.VOID:
            raise self.not_exportable(
                f"gives {name!r} the result of a function that returns nothing"
            )
        known = self.types.get(name, value_type)
        both = c.common_type(known, value_type)
        if both is None:
            raise self.not_exportable(f"uses {name!r} for values of different types")
        if self.types.get(name) != both:
            self.types[name] = both
            self._changed = True

    def _unpack(self, target: ast.Tuple, value_type: ValueType, value: ast.expr) -> None:
        if not isinstance(value_type, c.TupleType):
            raise self.not_exportable("unpacks a value that is not a tuple", value)
        if len(value_type.items) != len(target.elts):
            construct = f"unpacks {len(value_type.items)} values into {len(target.elts)} names"
            raise self.not_exportable(construct, target)
        for part, item in zip(target.elts, value_type.items, strict=True):
            self._assign_type(part, item, value)

    def _infer_loop(self, node: ast.For) -> None:
        call = node.iter
        ranged = isinstance(call, ast.Call) and getattr(call.func, "id", "") == "range"
        if not ranged or not isinstance(node.target, ast.Name):
            raise self.not_exportable("loops over something other than range(...)", call)
        if node.orelse:
            raise self.not_exportable("has a loop with 'else'")
        self._unify(node.target.id, c.INT)

    def _infer_return(self, value_type: ValueType) -> None:
        if isinstance(value_type, c.ArrayType) and not value_type.c_name:
            raise self.not_exportable("returns a work array, which lies on its stack")
        self._unify("return", value_type)

    # --- effects ---------------------------------------------------------------------------------

    def _find_written(self) -> frozenset[str]:
        """Return the names of work arrays that the function or its callees write to."""
        names = set()
        for node in ast.walk(self.node):
            if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store):
                if isinstance(node.value, ast.Name):
                    names.add(node.value.id)
            elif isinstance(node, ast.Call):
                names |= self.written_arrays(node)
        return frozenset(names)

    def writes_arrays(self, node: ast.AST) -> bool:
        """Return whether a part of the code writes to a work array."""
        calls = [part for part in ast.walk(node) if isinstance(part, ast.Call)]
        return any(map(self.written_arrays, calls))

    def written_arrays(self, node: ast.Call) -> set[str]:
        """Return the names of the work arrays that a call writes to."""
        if not self.is_compiled_call(node):
            return set()
        arguments = self.call_arguments(node)
        callee = self.program.infer_types(called_name(node), tuple(map(self.infer, arguments)))
        pairs = zip(callee.argument_names, arguments, strict=True)
        return {
            argument.id
            for parameter, argument in pairs
            if parameter in callee.written_arguments and isinstance(argument, ast.Name)
        }


_CONTROL_FLOW = (ast.If, ast.While, ast.Return, ast.Break, ast.Continue, ast.Pass)


def _iterate_statements(body: Sequence[ast.stmt]) -> Iterator[ast.stmt]:
    for statement in body:
        yield statement
        for field in ("body", "orelse"):
            yield from _iterate_statements(getattr(statement, field, ()))


def expressions_in(node: ast.stmt) -> Iterator[ast.expr]:
    """Yield the expressions of a statement, without those of nested statements."""
    for part in ast.iter_child_nodes(node):
        if isinstance(part, ast.expr):
            yield part


def sequenced_parts(node: ast.expr) -> Iterator[ast.expr]:
    """Yield the parts of an expression that C evaluates in sequence."""
    if isinstance(node, ast.BoolOp):
        for part in node.values:
            yield from sequenced_parts(part)
    elif isinstance(node, ast.IfExp):
        for part in (node.test, node.body, node.orelse):
            yield from sequenced_parts(part)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield from sequenced_parts(node.operand)
    else:
        yield node


def without_docstring(body: Sequence[ast.stmt]) -> Sequence[ast.stmt]:
    """Return the statements of a function without its docstring."""
    if isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant):
        return body[1:]
    return body


@lru_cache(maxsize=10_000)
def names_in(target: ast.AST) -> frozenset[str]:
    """Return the names in an expression or a statement."""
    return frozenset([node.id for node in ast.walk(target) if isinstance(node, ast.Name)])


def stored_names(node: ast.stmt) -> Iterator[str]:
    """Yield the names that a statement, or a nested statement, assigns to."""
    for part in ast.walk(node):
        if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store):
            yield part.id


def live_names(types: FunctionTypes) -> set[str]:
    """Return the names whose values are used."""
    unused: set[int] = set()
    while True:
        live = set(_loaded_names(types.node, unused))
        newly_unused = {
            id(node)
            for node in ast.walk(types.node)
            if isinstance(node, (ast.Assign, ast.AugAssign, ast.AnnAssign))
            and live.isdisjoint(stored_names(node))
            and all(map(_is_names_only, _targets(node)))
            and not types.writes_arrays(node)
        }
        if newly_unused <= unused:
            return live
        unused |= newly_unused


def _targets(node: ast.Assign | ast.AugAssign | ast.AnnAssign) -> Sequence[ast.expr]:
    if isinstance(node, ast.Assign):
        return node.targets
    return [node.target]


def _is_names_only(target: ast.expr) -> bool:
    """Return whether a target has no array elements."""
    if isinstance(target, ast.Tuple):
        return all(map(_is_names_only, target.elts))
    return isinstance(target, ast.Name)


def _loaded_names(node: ast.AST, unused: set[int]) -> Iterator[str]:
    if id(node) in unused:
        return
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
        yield node.id
    for child in ast.iter_child_nodes(node):
        yield from _loaded_names(child, unused)


def self_declaring_loops(function: ast.FunctionDef) -> Iterator[tuple[ast.For, str]]:
    """Yield the loops whose variable is used in them only, and its name."""
    loops = [node for node in ast.walk(function) if isinstance(node, ast.For)]
    for name in {loop.target.id for loop in loops if isinstance(loop.target, ast.Name)}:
        named = [loop for loop in loops if getattr(loop.target, "id", "") == name]
        arguments = {argument.arg for argument in function.args.args}
        if name not in arguments and _is_used_inside_only(function, name, named):
            for loop in named:
                yield loop, name


def _is_used_inside_only(function: ast.FunctionDef, name: str, loops: list[ast.For]) -> bool:
    """Return whether a name is the variable of these loops, not nested, and read inside only."""
    inside = {id(part) for loop in loops for inner in loop.body for part in ast.walk(inner)}
    targets = {id(loop.target) for loop in loops}
    for part in ast.walk(function):
        if isinstance(part, ast.Name) and part.id == name:
            is_target = id(part) in targets
            if is_target == (id(part) in inside):
                return False
            if not is_target and not isinstance(part.ctx, ast.Load):
                return False
    return True


def declaring_statements(
    types: FunctionTypes, live: set[str], loops: set[str]
) -> dict[str, ast.stmt]:
    """Return the statement that can declare each variable, where there is one.

    It is the first statement with the name in the innermost block that holds all uses of the
    variable, and assigns to it without reading it.
    """
    result: dict[str, ast.stmt] = {}
    for name in live - set(types.argument_names) - loops:
        if name not in types.types or is_constant(types.types[name]):
            continue
        first = _first_statement_with(_innermost_block(types.node.body, name), name)
        if not isinstance(first, (ast.Assign, ast.AnnAssign)) or first.value is None:
            continue
        if name in stored_names(first) and name not in names_in(first.value):
            result[name] = first
    return result


def _first_statement_with(body: Sequence[ast.stmt], name: str) -> ast.stmt | None:
    for statement in body:
        if name in names_in(statement):
            return statement
    return None


def _innermost_block(body: Sequence[ast.stmt], name: str) -> Sequence[ast.stmt]:
    """Return the innermost block that holds all uses of a name."""
    while True:
        using = [statement for statement in body if name in names_in(statement)]
        if len(using) != 1:
            return body
        if [part for part in expressions_in(using[0]) if name in names_in(part)]:
            return body
        blocks = [getattr(using[0], field, ()) for field in ("body", "orelse")]
        inner = [block for block in blocks if _first_statement_with(block, name) is not None]
        if len(inner) != 1:
            return body
        body = inner[0]
