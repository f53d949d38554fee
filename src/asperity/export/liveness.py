"""Liveness of the variables of a compiled function, and the place of their C declarations."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

from asperity.export.c_language import is_constant
from asperity.export.type_inference import FunctionTypes


def expressions_in(node: ast.stmt) -> Iterator[ast.expr]:
    """Yield the expressions of a statement, without those of nested statements."""
    for _name, value in ast.iter_fields(node):
        for part in value if isinstance(value, list) else [value]:
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
    documented = isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant)
    return body[1:] if documented else body


def names_in(target: ast.AST) -> Iterator[str]:
    """Yield the names in an expression or a statement."""
    for node in ast.walk(target):
        if isinstance(node, ast.Name):
            yield node.id


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
        found = {
            id(node)
            for node in ast.walk(types.node)
            if isinstance(node, (ast.Assign, ast.AugAssign, ast.AnnAssign))
            and not any(name in live for name in stored_names(node))
            and all(map(_is_names_only, _targets(node)))
            and not types.writes_arrays(node)
        }
        if found <= unused:
            return live
        unused |= found


def _targets(node: ast.Assign | ast.AugAssign | ast.AnnAssign) -> Sequence[ast.expr]:
    return node.targets if isinstance(node, ast.Assign) else [node.target]


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
        own = [loop for loop in loops if getattr(loop.target, "id", "") == name]
        inside = {id(part) for loop in own for inner in loop.body for part in ast.walk(inner)}
        targets = {id(loop.target) for loop in own}
        # Each use is the variable of such a loop that is not nested in another, or a read in one.
        free = all(
            (id(part) in targets) != (id(part) in inside)
            and (id(part) in targets or isinstance(part.ctx, ast.Load))
            for part in ast.walk(function)
            if isinstance(part, ast.Name) and part.id == name
        )
        if free and name not in {argument.arg for argument in function.args.args}:
            yield from ((loop, name) for loop in own)


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
    return next((statement for statement in body if name in names_in(statement)), None)


def _innermost_block(body: Sequence[ast.stmt], name: str) -> Sequence[ast.stmt]:
    """Return the innermost block that holds all uses of a name."""
    while True:
        using = [statement for statement in body if name in names_in(statement)]
        if len(using) != 1 or any(name in names_in(part) for part in expressions_in(using[0])):
            return body
        blocks = [getattr(using[0], field, ()) for field in ("body", "orelse")]
        inner = [block for block in blocks if _first_statement_with(block, name) is not None]
        if len(inner) != 1:
            return body
        body = inner[0]
