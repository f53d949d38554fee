"""What kind of value each name and expression of a compiled function has.

As Numba does it: a function is looked at once for each combination of kinds of its arguments, and
follows its assignments until nothing changes.
"""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

from asperity.export.kinds import WORDS, Callees, ExpressionKinds, called
from asperity.export.subset import INT, NOTHING, Constants, Data, Group, Kind, Work, common


class Scope(ExpressionKinds):
    """The kinds of a function's names, for given kinds of its arguments.

    Args:
        node: the function.
        kinds: of its arguments.
        callees: the others.

    Attributes:
        given: the kinds of its arguments, by name.
        kinds: of its variables, by name.
        result: of what it returns.
        written: its arguments that are work arrays and that it writes to.

    Raises:
        NotExportableError: for what C does not know.
    """

    def __init__(self, node: ast.FunctionDef, kinds: tuple[Kind, ...], callees: Callees) -> None:
        super().__init__(node, {}, callees)
        self.arguments = tuple(argument.arg for argument in node.args.args)
        self.given = dict(zip(self.arguments, kinds, strict=True))
        self.kinds |= self.given
        self._returned: Kind | None = None
        self._changed = True
        self._check_arguments()
        while self._changed:
            self._changed = False
            for statement in _statements(node.body):
                self._follow(statement)
        self.result: Kind = NOTHING if self._returned is None else self._returned
        self.written = self._written()

    def _check_arguments(self) -> None:
        given = self.node.args
        if given.vararg or given.kwarg or given.kwonlyargs or given.posonlyargs:
            raise self.refuse("takes arguments by stars, or by name or place only")

    # --- statements ------------------------------------------------------------------------------

    def _follow(self, node: ast.stmt) -> None:
        if isinstance(node, ast.Assign):
            for target in node.targets:
                self._assign(target, self.kind(node.value), node.value)
        elif isinstance(node, ast.AnnAssign):
            if node.value is not None:
                self._assign(node.target, self.kind(node.value), node.value)
        elif isinstance(node, ast.AugAssign):
            whole = ast.BinOp(_as_value(node.target), node.op, node.value)
            self._assign(node.target, self.kind(whole), whole)
        elif isinstance(node, ast.For):
            self._loop(node)
        elif isinstance(node, ast.While) and node.orelse:
            raise self.refuse("has a loop with 'else'")
        elif isinstance(node, ast.Return) and node.value is not None:
            self._return(self.kind(node.value))
        elif isinstance(node, ast.Expr):
            if not isinstance(node.value, (ast.Call, ast.Constant)):
                raise self.refuse("has an expression without effect", node.value)
        elif type(node).__name__ in WORDS:
            raise self.refuse(WORDS[type(node).__name__], node)

    def _assign(self, target: ast.expr, kind: Kind | None, value: ast.expr) -> None:
        if isinstance(target, ast.Tuple):
            self._unpack(target, kind, value)
        elif isinstance(target, ast.Subscript):
            if isinstance(self.kind(target.value), (Data, Constants)):
                raise self.refuse("writes to the texture or the law", target)
        elif isinstance(target, ast.Name):
            if kind is not None:
                self._join(target.id, kind)
        else:
            raise self.refuse("assigns to what is no variable", target)

    def _join(self, name: str, kind: Kind) -> None:
        if kind == NOTHING:
            raise self.refuse(f"gives {name!r} the result of a function that returns nothing")
        known = self.kinds.get(name, kind)
        both = common(known, kind)
        if both is None:
            raise self.refuse(f"uses {name!r} for values of different kinds")
        if self.kinds.get(name) != both:
            self.kinds[name], self._changed = both, True

    def _unpack(self, target: ast.Tuple, kind: Kind | None, value: ast.expr) -> None:
        if isinstance(value, ast.Tuple) and len(value.elts) == len(target.elts):
            for part, single in zip(target.elts, value.elts, strict=True):
                self._assign(part, self.kind(single), single)
            return
        if kind is None:
            return
        if isinstance(kind, Constants):
            items: Sequence[Kind] = [item for _name, item in kind.fields]
        elif isinstance(kind, Group):
            items = kind.items
        else:
            raise self.refuse("takes apart what is no tuple", value)
        if len(items) != len(target.elts):
            words = f"takes {len(items)} values apart into {len(target.elts)} names"
            raise self.refuse(words, target)
        for part, item in zip(target.elts, items, strict=True):
            self._assign(part, item, value)

    def _loop(self, node: ast.For) -> None:
        call = node.iter
        ranged = isinstance(call, ast.Call) and getattr(call.func, "id", "") == "range"
        if not ranged or not isinstance(node.target, ast.Name):
            raise self.refuse("loops over something other than range(...)", call)
        if node.orelse:
            raise self.refuse("has a loop with 'else'")
        self._join(node.target.id, INT)

    def _return(self, kind: Kind | None) -> None:
        if kind is None:
            return
        if isinstance(kind, Work):
            raise self.refuse("returns a work array, which ends with it")
        both = kind if self._returned is None else common(self._returned, kind)
        if both is None:
            raise self.refuse("returns values of different kinds")
        if both != self._returned:
            self._returned, self._changed = both, True

    # --- effects ---------------------------------------------------------------------------------

    def _written(self) -> frozenset[str]:
        """Return the names of work arrays that are written to, here or in what is called."""
        names = set()
        for node in ast.walk(self.node):
            if isinstance(node, ast.Subscript) and isinstance(node.ctx, ast.Store):
                names |= {node.value.id} if isinstance(node.value, ast.Name) else set()
            elif isinstance(node, ast.Call):
                names |= self.effects(node)
        return frozenset(names)

    def effects(self, node: ast.Call) -> set[str]:
        """Return the names of the work arrays that a call writes to."""
        if not self.own(node):
            return set()
        arguments = self.ordered(node)
        callee = self.callees.scope(called(node), tuple(self.sure(one) for one in arguments))
        pairs = zip(callee.arguments, arguments, strict=True)
        return {
            argument.id
            for parameter, argument in pairs
            if parameter in callee.written and isinstance(argument, ast.Name)
        }


def _statements(body: Sequence[ast.stmt]) -> Iterator[ast.stmt]:
    for statement in body:
        yield statement
        for field in ("body", "orelse"):
            yield from _statements(getattr(statement, field, ()))


def _as_value(target: ast.expr) -> ast.expr:
    return ast.parse(ast.unparse(target), mode="eval").body
