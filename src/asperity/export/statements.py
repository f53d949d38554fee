"""Statements of compiled functions as C: one function, from its first line to its last."""

from __future__ import annotations

import ast
from collections.abc import Callable, Iterator, Sequence
from typing import Any

from asperity.export.expressions import Expressions, Printing, field
from asperity.export.kinds import called
from asperity.export.names import (
    as_value,
    expressions_in,
    first_values,
    live_names,
    names_in,
    owned_loops,
    sequenced,
    stored_in,
    without_docstring,
)
from asperity.export.scope import Scope
from asperity.export.subset import (
    FLOAT,
    INT,
    Constants,
    Group,
    Kind,
    Number,
    Work,
    is_constant,
)

_SIGNS: dict[type[ast.operator], str] = {
    ast.Add: "+=",
    ast.Sub: "-=",
    ast.Mult: "*=",
    ast.Div: "/=",
}

# Words of C and C++, and names that headers of systems define as macros.
_TAKEN = frozenset(
    word
    for line in (
        "auto break case char const continue default do double else enum extern float for goto if",
        "inline int long register restrict return short signed sizeof static struct switch typedef",
        "union unsigned void volatile while and and_eq asm bitand bitor bool catch class compl",
        "const_cast constexpr delete dynamic_cast explicit export false friend mutable namespace",
        "new noexcept not not_eq nullptr operator or or_eq private protected public",
        "reinterpret_cast static_assert static_cast template this throw true try typeid typename",
        "using virtual wchar_t xor xor_eq far near small huge interface pascal linux unix I IN OUT",
        "min max",
    )
    for word in line.split()
)


def is_taken(name: str) -> bool:
    """Return whether a name is a word of C or C++, or often a macro."""
    return name in _TAKEN


class Statements:
    """The lines of one function.

    Args:
        scope: the kinds of its names.
        program: the program that it is printed into.
    """

    def __init__(self, scope: Scope, program: Printing) -> None:
        self.scope, self.program = scope, program
        self.names = {name: f"{name}_" if name in _TAKEN else name for name in scope.kinds}
        self.say = Expressions(scope, program, self.names)
        self._temporaries = 0
        self._live = live_names(scope)
        self._owned = dict(owned_loops(scope.node))
        # Where each variable is declared: with its first value, or at the top.
        self._first = first_values(scope, self._live, set(self._owned.values()))

    def lines(self, head: str) -> list[str]:
        """Return the function."""
        unused = [
            f"(void){self.names[name]};"
            for name in self.scope.arguments
            if name not in self._live and not is_constant(self.scope.kinds[name])
        ]
        body = without_docstring(self.scope.node.body)
        inside = [*self._copies(), *self._declarations(), *unused, *self._block(body)]
        return [f"{head}", "{", *_indented(inside), "}"]

    def parameters(self) -> list[str]:
        """Return the parameters: constants are none, work arrays are handed down by address."""
        result = []
        for name in self.scope.arguments:
            kind = self.scope.given[name]
            if not is_constant(kind):
                suffix = "_given" if kind != self.scope.kinds[name] else ""
                result.append(self._declared(kind, self.names[name] + suffix))
        return result

    def _declared(self, kind: Kind, name: str) -> str:
        if isinstance(kind, Work):
            lengths = "".join(f"[{length}]" for length in kind.shape)
            return f"{self.program.type_of(FLOAT)} {name}{lengths}"
        return f"{self.program.type_of(kind)} {name}"

    def _copies(self) -> Iterator[str]:
        """Yield the lines of arguments that become variables of another kind."""
        for name in self.scope.arguments:
            given, kind = self.scope.given[name], self.scope.kinds[name]
            if given != kind and isinstance(kind, Number):
                cname, kind_name = self.names[name], self.program.type_of(kind)
                yield f"{kind_name} {cname} = ({kind_name}){cname}_given;"

    def _declarations(self) -> Iterator[str]:
        inside = set(self._owned.values())
        for name, kind in self.scope.kinds.items():
            elsewhere = name in self.scope.arguments or name in self._first or name in inside
            if elsewhere or name not in self._live or is_constant(kind):
                continue
            value = " = 0" if isinstance(kind, Number) else ""
            yield f"{self._declared(kind, self.names[name])}{value};"

    # --- statements ------------------------------------------------------------------------------

    def _block(self, body: Sequence[ast.stmt]) -> list[str]:
        return [line for statement in body for line in self._statement(statement)]

    def _statement(self, node: ast.stmt) -> list[str]:
        self._check_order(node)
        return _PRINTERS[type(node)](self, node)

    def _expression(self, node: ast.Expr) -> list[str]:
        return [] if isinstance(node.value, ast.Constant) else [f"{self.say.text(node.value)};"]

    def _word(self, node: ast.stmt) -> list[str]:
        return {ast.Break: ["break;"], ast.Continue: ["continue;"]}.get(type(node), [])

    def _while(self, node: ast.While) -> list[str]:
        inside = _indented(self._block(node.body))
        return [f"while ({self.say.truth(node.test)}) {{", *inside, "}"]

    def _return(self, node: ast.Return) -> list[str]:
        if node.value is None:
            return ["return;"]
        return [f"return {self.say.as_kind(node.value, self.scope.result)};"]

    def _if(self, node: ast.If) -> list[str]:
        test = self.say.truth(node.test)
        if _gives_zeros(node.body[0]):
            test = f"{self.program.prefix.upper()}_RARE({test})"
        lines = [f"if ({test}) {{", *_indented(self._block(node.body))]
        if len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If):
            first, *rest = self._if(node.orelse[0])
            return [*lines, f"}} else {first}", *rest]
        if node.orelse:
            lines += ["} else {", *_indented(self._block(node.orelse))]
        return [*lines, "}"]

    def _for(self, node: ast.For) -> list[str]:
        assert isinstance(node.iter, ast.Call)  # the scope let nothing else through
        assert isinstance(node.target, ast.Name)
        given = node.iter.args
        start = self.say.as_kind(given[0], INT) if len(given) > 1 else "0"
        step = self.scope.length(given[2]) if len(given) > 2 else 1
        if not step:
            raise self.scope.refuse("loops in steps that are no literal", node.iter)
        end, before = self._end(node, given[1] if len(given) > 1 else given[0])
        owned = node in self._owned
        name = self.names[node.target.id] if owned else self._temporary("turn")
        if node.target.id.startswith("_"):
            name = self._temporary("turn")
        sign, change = ("<", f"{name} += {step}") if step > 0 else (">", f"{name} -= {-step}")
        change = {1: f"{name}++", -1: f"{name}--"}.get(step, change)
        inside = [] if owned else [f"{self.names[node.target.id]} = {name};"]
        inside = [] if node.target.id not in self._live else inside
        head = f"for (int64_t {name} = {start}; {name} {sign} {end}; {change}) {{"
        return [*before, head, *_indented([*inside, *self._block(node.body)]), "}"]

    def _end(self, node: ast.For, end: ast.expr) -> tuple[str, list[str]]:
        """Return the end of a loop: what may change meanwhile is looked at once, before it."""
        text = self.say.as_kind(end, INT, 8)
        changed = set(stored_in(node))
        read = {part.id for part in ast.walk(end) if isinstance(part, ast.Name)}
        calls = any(isinstance(part, (ast.Call, ast.Subscript)) for part in ast.walk(end))
        if self.scope.length(end) is not None or not (read & changed or calls):
            return text, []
        name = self._temporary("end")
        return name, [f"const int64_t {name} = {text};"]

    def _change(self, node: ast.AugAssign) -> list[str]:
        if isinstance(node.target, ast.Name) and node.target.id not in self._live:
            return []
        value = ast.BinOp(as_value(node.target), node.op, node.value)
        kind = self.scope.sure(node.target)
        if type(node.op) in _SIGNS and self.scope.sure(value) == kind:
            place = self.say.text(as_value(node.target))
            return [f"{place} {_SIGNS[type(node.op)]} {self.say.as_kind(node.value, kind)};"]
        return self._assign(node, [node.target], value)

    # --- assignments -----------------------------------------------------------------------------

    def _assignment(self, node: ast.Assign) -> list[str]:
        return self._assign(node, node.targets, node.value)

    def _annotated(self, node: ast.AnnAssign) -> list[str]:
        return [] if node.value is None else self._assign(node, [node.target], node.value)

    def _assign(self, node: ast.stmt, targets: Sequence[ast.expr], value: ast.expr) -> list[str]:
        if isinstance(value, ast.Call) and called(value) == "local_array":
            return self._array(targets, value)
        alone = isinstance(targets[0], ast.Tuple)
        if alone and isinstance(value, ast.Tuple):
            assert isinstance(targets[0], ast.Tuple)  # as was just asked
            return self._each(node, targets[0].elts, value.elts)
        if alone:
            assert isinstance(targets[0], ast.Tuple)  # as was just asked
            return self._unpack(node, targets[0].elts, value)
        if len(targets) > 1 and not isinstance(value, ast.Constant):
            first, *others = targets
            lines = self._store(node, first, value)
            return lines + [li for one in others for li in self._store(node, one, as_value(first))]
        return [line for target in targets for line in self._store(node, target, value)]

    def _array(self, targets: Sequence[ast.expr], value: ast.Call) -> list[str]:
        if len(targets) != 1 or not isinstance(targets[0], ast.Name):
            raise self.scope.refuse("gives a work array more than one name", value)
        name = targets[0].id
        if name not in self._live:
            return []
        if name in self._first:
            return [f"{self._declared(self.scope.kinds[name], self.names[name])};"]
        raise self.scope.refuse("makes a work array inside a loop or a branch", value)

    def _store(self, node: ast.stmt, target: ast.expr, value: ast.expr) -> list[str]:
        kind = self.scope.sure(as_value(target))
        if is_constant(kind):
            return []
        if isinstance(target, ast.Name) and target.id not in self._live:
            return [f"(void){self.say.text(value)};"] if self._acts(value) else []
        return [self._given(node, target, self.say.as_kind(value, kind))]

    def _given(self, node: ast.stmt, target: ast.expr, text: str) -> str:
        """Return the line that gives a variable or an item of an array its value."""
        if isinstance(target, ast.Name) and self._first.get(target.id) is node:
            kind = self.scope.kinds[target.id]
            return f"{self._declared(kind, self.names[target.id])} = {text};"
        return f"{self.say.text(as_value(target))} = {text};"

    def _each(
        self, node: ast.stmt, targets: Sequence[ast.expr], values: Sequence[ast.expr]
    ) -> list[str]:
        """Assign several values at once: none of them sees what the others change."""
        stored: set[str] = set()
        clash = False
        for target, value in zip(targets, values, strict=True):
            read = {part.id for part in ast.walk(value) if isinstance(part, ast.Name)}
            clash = clash or bool(read & stored) or self._acts(value)
            stored |= set(names_in(target))
        if not clash:
            pairs = zip(targets, values, strict=True)
            return [line for one, value in pairs for line in self._store(node, one, value)]
        lines, later = [], []
        for target, value in zip(targets, values, strict=True):
            if isinstance(target, ast.Name) and target.id not in self._live:
                continue
            kind = self.scope.sure(as_value(target))
            name = self._temporary("new")
            lines.append(f"const {self._declared(kind, name)} = {self.say.as_kind(value, kind)};")
            later.append(self._given(node, target, name))
        return lines + later

    def _unpack(self, node: ast.stmt, targets: Sequence[ast.expr], value: ast.expr) -> list[str]:
        kind = self.scope.sure(value)
        pairs = list(enumerate(targets))
        if isinstance(kind, Constants):
            places = [kind.read(name) for name, _item in kind.fields]
            items: Sequence[Kind] = [item for _name, item in kind.fields]
        else:
            assert isinstance(kind, Group)  # the scope let nothing else through
            items = kind.items
        wanted = [
            (index, target)
            for index, target in pairs
            if (not isinstance(target, ast.Name) or target.id in self._live)
            and not is_constant(items[index])
        ]
        lines = []
        if isinstance(kind, Group):
            if not wanted:
                return [f"(void){self.say.text(value)};"] if self._acts(value) else []
            name = self._temporary("values")
            lines.append(f"const {self.program.type_of(kind)} {name} = {self.say.text(value)};")
            places = [f"{name}{field(kind, index)}" for index, _target in pairs]
        for index, target in wanted:
            lines += self._take(node, target, items[index], places[index])
        return lines

    def _take(self, node: ast.stmt, target: ast.expr, kind: Kind, place: str) -> list[str]:
        """Return the lines that give a target, or the parts of one, what lies at a place."""
        if isinstance(target, ast.Tuple) and isinstance(kind, Group):
            parts = enumerate(zip(target.elts, kind.items, strict=True))
            return [
                line
                for index, (part, item) in parts
                if not isinstance(part, ast.Name) or part.id in self._live
                for line in self._take(node, part, item, f"{place}{field(kind, index)}")
            ]
        own = self.scope.sure(as_value(target))
        if own != kind and isinstance(own, Number):
            place = f"({self.program.type_of(own)}){place}"
        return [self._given(node, target, place)]

    def _temporary(self, word: str) -> str:
        self._temporaries += 1
        name = f"{word}_{self._temporaries}"
        return name if name not in self.names.values() else self._temporary(word)

    # --- order of evaluation ---------------------------------------------------------------------

    def _acts(self, node: ast.expr) -> bool:
        """Return whether an expression writes to a work array."""
        return any(
            bool(self.scope.effects(part)) for part in ast.walk(node) if isinstance(part, ast.Call)
        )

    def _check_order(self, node: ast.stmt) -> None:
        """Refuse a statement whose value depends on an order that C leaves open."""
        for value in expressions_in(node):
            for piece in sequenced(value):
                calls = [part for part in ast.walk(piece) if isinstance(part, ast.Call)]
                acting = [call for call in calls if self.scope.effects(call)]
                written = {name for call in acting for name in self.scope.effects(call)}
                inside = {id(part) for call in acting for part in ast.walk(call)}
                read = {
                    part.value.id
                    for part in ast.walk(piece)
                    if isinstance(part, ast.Subscript)
                    and isinstance(part.value, ast.Name)
                    and id(part) not in inside
                }
                if len(acting) > 1 or read & written:
                    raise self.scope.refuse("depends on an order that C leaves open", value)


_PRINTERS: dict[type[ast.stmt], Callable[[Statements, Any], list[str]]] = {
    ast.AnnAssign: Statements._annotated,
    ast.Assign: Statements._assignment,
    ast.AugAssign: Statements._change,
    ast.Break: Statements._word,
    ast.Continue: Statements._word,
    ast.Expr: Statements._expression,
    ast.For: Statements._for,
    ast.If: Statements._if,
    ast.Pass: Statements._word,
    ast.Return: Statements._return,
    ast.While: Statements._while,
}


def _gives_zeros(node: ast.stmt) -> bool:
    """Return whether a statement returns zeros, as where nothing is touched."""
    given = node.value if isinstance(node, ast.Return) else None
    return isinstance(given, ast.Tuple) and all(
        isinstance(item, ast.Constant) and item.value == 0.0 for item in given.elts
    )


def _indented(lines: Sequence[str]) -> list[str]:
    return [f"    {line}" for line in lines]
