"""Where the variables of a compiled function are used: C declares each one, in one place."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

from asperity.export.scope import Scope
from asperity.export.subset import is_constant


def expressions_in(node: ast.stmt) -> Iterator[ast.expr]:
    """Yield the expressions of a statement, without those of the statements inside."""
    for _name, value in ast.iter_fields(node):
        for part in value if isinstance(value, list) else [value]:
            if isinstance(part, ast.expr):
                yield part


def sequenced(node: ast.expr) -> Iterator[ast.expr]:
    """Yield the parts of an expression that C evaluates one after the other."""
    if isinstance(node, ast.BoolOp):
        for part in node.values:
            yield from sequenced(part)
    elif isinstance(node, ast.IfExp):
        for part in (node.test, node.body, node.orelse):
            yield from sequenced(part)
    elif isinstance(node, ast.UnaryOp) and isinstance(node.op, ast.Not):
        yield from sequenced(node.operand)
    else:
        yield node


def without_docstring(body: Sequence[ast.stmt]) -> Sequence[ast.stmt]:
    """Return the statements of a function without its documentation."""
    said = isinstance(body[0], ast.Expr) and isinstance(body[0].value, ast.Constant)
    return body[1:] if said else body


def as_value(target: ast.expr) -> ast.expr:
    """Return a target as the expression of its value."""
    return ast.parse(ast.unparse(target), mode="eval").body


def names_in(target: ast.AST) -> Iterator[str]:
    """Yield the names in an expression or a statement."""
    for node in ast.walk(target):
        if isinstance(node, ast.Name):
            yield node.id


def stored_in(node: ast.stmt) -> Iterator[str]:
    """Yield the names that a statement, or one inside it, gives values."""
    for part in ast.walk(node):
        if isinstance(part, ast.Name) and isinstance(part.ctx, ast.Store):
            yield part.id


def live_names(scope: Scope) -> set[str]:
    """Return the names whose values are used: others would be unused variables of C."""
    idle: set[int] = set()
    while True:
        live = set(_loads(scope.node, idle))
        more = {
            id(node)
            for node in ast.walk(scope.node)
            if isinstance(node, (ast.Assign, ast.AugAssign, ast.AnnAssign))
            and not any(name in live for name in stored_in(node))
            and all(map(_only_names, _targets(node)))
            and not any(_acting(scope, node))
        }
        if more <= idle:
            return live
        idle |= more


def _acting(scope: Scope, node: ast.stmt) -> Iterator[bool]:
    for part in ast.walk(node):
        if isinstance(part, ast.Call):
            yield bool(scope.effects(part))


def _targets(node: ast.Assign | ast.AugAssign | ast.AnnAssign) -> Sequence[ast.expr]:
    return node.targets if isinstance(node, ast.Assign) else [node.target]


def _only_names(target: ast.expr) -> bool:
    """Return whether a target is of names alone: what is written to an array is used elsewhere."""
    if isinstance(target, ast.Tuple):
        return all(map(_only_names, target.elts))
    return isinstance(target, ast.Name)


def _loads(node: ast.AST, idle: set[int]) -> Iterator[str]:
    if id(node) in idle:
        return
    if isinstance(node, ast.Name) and isinstance(node.ctx, ast.Load):
        yield node.id
    for child in ast.iter_child_nodes(node):
        yield from _loads(child, idle)


def owned_loops(function: ast.FunctionDef) -> Iterator[tuple[ast.For, str]]:
    """Yield the loops that may declare their variable themselves: it is used nowhere else."""
    loops = [node for node in ast.walk(function) if isinstance(node, ast.For)]
    for name in {loop.target.id for loop in loops if isinstance(loop.target, ast.Name)}:
        own = [loop for loop in loops if getattr(loop.target, "id", "") == name]
        inside = {id(part) for loop in own for inner in loop.body for part in ast.walk(inner)}
        targets = {id(loop.target) for loop in own}
        # Once: as the variable of such a loop, not inside another one, or read inside one.
        free = all(
            (id(part) in targets) != (id(part) in inside)
            and (id(part) in targets or isinstance(part.ctx, ast.Load))
            for part in ast.walk(function)
            if isinstance(part, ast.Name) and part.id == name
        )
        if free and name not in {argument.arg for argument in function.args.args}:
            yield from ((loop, name) for loop in own)


def first_values(scope: Scope, live: set[str], loops: set[str]) -> dict[str, ast.stmt]:
    """Return the statement that declares each variable, of those that one may declare.

    It stands in the innermost block that holds all that the variable is used for, is the first
    there that names it, and does not ask for its value.
    """
    result: dict[str, ast.stmt] = {}
    for name in live - set(scope.arguments) - loops:
        if name not in scope.kinds or is_constant(scope.kinds[name]):
            continue
        first = _first_in(_innermost(scope.node.body, name), name)
        if not isinstance(first, (ast.Assign, ast.AnnAssign)) or first.value is None:
            continue
        if name in stored_in(first) and name not in names_in(first.value):
            result[name] = first
    return result


def _first_in(body: Sequence[ast.stmt], name: str) -> ast.stmt | None:
    return next((statement for statement in body if name in names_in(statement)), None)


def _innermost(body: Sequence[ast.stmt], name: str) -> Sequence[ast.stmt]:
    """Return the innermost block that holds all uses of a name."""
    while True:
        using = [statement for statement in body if name in names_in(statement)]
        if len(using) != 1 or any(name in names_in(part) for part in expressions_in(using[0])):
            return body
        blocks = [getattr(using[0], field, ()) for field in ("body", "orelse")]
        inner = [block for block in blocks if _first_in(block, name) is not None]
        if len(inner) != 1:
            return body
        body = inner[0]
