"""Conversion of compiled functions to C, statement by statement."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence

from asperity.export import c_language as c
from asperity.export import function_analysis
from asperity.export.c_language import ValueType
from asperity.export.expression_types import ProgramContext, called_name
from asperity.export.expressions import BINARY_OPERATORS, ExpressionPrinter
from asperity.export.function_analysis import FunctionTypes

_RESERVED_TEXT = """
    auto break case char const continue default do double else enum extern float for goto if
    inline int long register restrict return short signed sizeof static struct switch typedef
    union unsigned void volatile while and and_eq asm bitand bitor bool catch class compl
    const_cast constexpr delete dynamic_cast explicit export false friend mutable namespace
    new noexcept not not_eq nullptr operator or or_eq private protected public
    reinterpret_cast static_assert static_cast template this throw true try typeid typename
    using virtual wchar_t xor xor_eq far near small huge interface pascal linux unix I IN OUT
    min max
"""
RESERVED_WORDS = frozenset(_RESERVED_TEXT.split())
"""Keywords of C and C++, and names that system headers define as macros."""


class FunctionPrinter(ast.NodeVisitor):
    """Converter of one function.

    Args:
        types: types of the variables.
        program: the program.
    """

    def __init__(self, types: FunctionTypes, program: ProgramContext) -> None:
        self.types = types
        self.program = program
        self.names = {name: _c_name(name, kind) for name, kind in types.types.items()}
        self.expressions = ExpressionPrinter(types, program, self.names)
        self._temporaries = 0
        self._live = function_analysis.live_names(types)
        self._loop_variables = dict(function_analysis.self_declaring_loops(types.node))
        self._declaring = function_analysis.declaring_statements(
            types, self._live, set(self._loop_variables.values())
        )

    def lines(self, signature: str) -> list[str]:
        """Return the lines of the function."""
        unused = [
            f"(void){self.names[name]};"
            for name in self.types.argument_names
            if name not in self._live and not c.is_constant(self.types.types[name])
        ]
        body = function_analysis.without_docstring(self.types.node.body)
        inside = [*self._argument_conversions(), *self._declarations(), *unused, *self._block(body)]
        return [signature, "{", *_indent(inside), "}"]

    def parameter_declarations(self) -> list[str]:
        """Return the parameters; constants are not passed."""
        result = []
        for name in self.types.argument_names:
            kind = self.types.argument_types[name]
            if c.is_constant(kind):
                continue
            parameter = self.names[name]
            if kind != self.types.types[name]:
                parameter += "_given"
            result.append(self._declaration(kind, parameter))
        return result

    def _declaration(self, value_type: ValueType, name: str) -> str:
        if isinstance(value_type, c.ArrayType):
            lengths = "".join([f"[{length}]" for length in value_type.shape])
            return f"{self.program.c_type(c.FLOAT)} {name}{lengths}"
        return f"{self.program.c_type(value_type)} {name}"

    def _argument_conversions(self) -> Iterator[str]:
        """Yield the conversions of arguments to variables of another type."""
        for name in self.types.argument_names:
            kind = self.types.types[name]
            if self.types.argument_types[name] != kind and isinstance(kind, c.ScalarType):
                cname = self.names[name]
                kind_name = self.program.c_type(kind)
                yield f"{kind_name} {cname} = ({kind_name}){cname}_given;"

    def _declarations(self) -> Iterator[str]:
        inside = set(self._loop_variables.values())
        for name, kind in self.types.types.items():
            elsewhere = (
                name in self.types.argument_names or name in self._declaring or name in inside
            )
            if elsewhere or name not in self._live or c.is_constant(kind):
                continue
            declaration = self._declaration(kind, self.names[name])
            if isinstance(kind, c.ScalarType):
                declaration += " = 0"
            yield f"{declaration};"

    # --- statements ------------------------------------------------------------------------------

    def _block(self, body: Sequence[ast.stmt]) -> list[str]:
        return [line for statement in body for line in self._statement(statement)]

    def _statement(self, node: ast.stmt) -> list[str]:
        self._check_evaluation_order(node)
        lines: list[str] = self.visit(node)
        return lines

    def visit_Expr(self, node: ast.Expr) -> list[str]:
        """Return the lines of a call without a result."""
        if isinstance(node.value, ast.Constant):
            return []
        return [f"{self.expressions.text(node.value)};"]

    def generic_visit(self, node: ast.AST) -> list[str]:
        """Return the line of ``break`` or ``continue``; ``pass`` has none."""
        if isinstance(node, ast.Break):
            return ["break;"]
        if isinstance(node, ast.Continue):
            return ["continue;"]
        return []

    def visit_While(self, node: ast.While) -> list[str]:
        """Return the lines of a loop with a condition."""
        inside = _indent(self._block(node.body))
        return [f"while ({self.expressions.condition(node.test)}) {{", *inside, "}"]

    def visit_Return(self, node: ast.Return) -> list[str]:
        """Return the lines of a return."""
        if node.value is None:
            return ["return;"]
        return [f"return {self.expressions.as_type(node.value, self.types.result_type)};"]

    def visit_If(self, node: ast.If) -> list[str]:
        """Return the lines of a branch, of the one that is taken where the test is constant."""
        taken = self._constant_test(node.test)
        if taken is not None:
            return self._block(node.body if taken else node.orelse)
        test = self.expressions.condition(node.test)
        if _returns_zeros(node.body[0]):
            test = f"{self.program.prefix.upper()}_RARE({test})"
        lines = [f"if ({test}) {{", *_indent(self._block(node.body))]
        if len(node.orelse) == 1 and isinstance(node.orelse[0], ast.If):
            first, *rest = self.visit_If(node.orelse[0])
            return [*lines, f"}} else {first}", *rest]
        if node.orelse:
            lines += ["} else {", *_indent(self._block(node.orelse))]
        return [*lines, "}"]

    def _constant_test(self, node: ast.expr) -> bool | None:
        """Return whether a number of the program is greater than another; None for other tests."""
        if not isinstance(node, ast.Compare) or not isinstance(node.ops[0], ast.Gt):
            return None
        left, right = map(self.types.constant_integer, (node.left, node.comparators[0]))
        if left is None or right is None:
            return None
        return left > right

    def visit_For(self, node: ast.For) -> list[str]:
        """Return the lines of a loop over a range."""
        assert isinstance(node.iter, ast.Call)  # checked by the type inference
        assert isinstance(node.target, ast.Name)
        start_node, end_node, step_node = _range_arguments(node.iter)
        start = self.expressions.as_type(start_node, c.INT)
        step = self.types.constant_integer(step_node)
        if not step:
            raise self.types.not_exportable("loops with a step that is not a literal", node.iter)
        end, before = self._loop_end(node, end_node)
        variable = self.names[node.target.id]
        owned = node in self._loop_variables
        name = variable
        if not owned or node.target.id.startswith("_"):
            name = self._temporary("turn")
        body = self._block(node.body)
        if not owned and node.target.id in self._live:
            body.insert(0, f"{variable} = {name};")
        head = f"for (int64_t {name} = {start}; {_loop_control(name, end, step)}) {{"
        return [*before, head, *_indent(body), "}"]

    def _loop_end(self, node: ast.For, end: ast.expr) -> tuple[str, list[str]]:
        """Return the end of a loop, and the line that stores it if the loop may change it."""
        text = self.expressions.as_type(end, c.INT, 8)
        changed = set(function_analysis.stored_names(node))
        read = {part.id for part in ast.walk(end) if isinstance(part, ast.Name)}
        calls = [part for part in ast.walk(end) if isinstance(part, (ast.Call, ast.Subscript))]
        if self.types.constant_integer(end) is not None or not (read & changed or calls):
            return text, []
        name = self._temporary("end")
        return name, [f"const int64_t {name} = {text};"]

    def visit_AugAssign(self, node: ast.AugAssign) -> list[str]:
        """Return the lines of an augmented assignment."""
        if isinstance(node.target, ast.Name) and node.target.id not in self._live:
            return []
        value = ast.BinOp(node.target, node.op, node.value)
        kind = self.types.infer(node.target)
        if type(node.op) in BINARY_OPERATORS and self.types.infer(value) == kind:
            place = self.expressions.text(node.target)
            change = self.expressions.as_type(node.value, kind)
            return [f"{place} {BINARY_OPERATORS[type(node.op)][0]}= {change};"]
        return self._assign(node, [node.target], value)

    # --- assignments -----------------------------------------------------------------------------

    def visit_Assign(self, node: ast.Assign) -> list[str]:
        """Return the lines of an assignment."""
        return self._assign(node, node.targets, node.value)

    def visit_AnnAssign(self, node: ast.AnnAssign) -> list[str]:
        """Return the lines of an annotated assignment."""
        if node.value is None:
            return []
        return self._assign(node, [node.target], node.value)

    def _assign(self, node: ast.stmt, targets: Sequence[ast.expr], value: ast.expr) -> list[str]:
        if isinstance(value, ast.Call) and called_name(value) == "local_array":
            return self._array(targets, value)
        first, *others = targets
        if isinstance(first, ast.Tuple):
            if others:
                raise self.types.not_exportable("assigns a tuple to several targets", value)
            return self._unpack(node, first.elts, value)
        if len(targets) > 1 and not isinstance(value, ast.Constant):
            lines = self._store(node, first, value)
            for other in others:
                lines += self._store(node, other, first)
            return lines
        return [line for target in targets for line in self._store(node, target, value)]

    def _array(self, targets: Sequence[ast.expr], value: ast.Call) -> list[str]:
        if len(targets) != 1 or not isinstance(targets[0], ast.Name):
            raise self.types.not_exportable("gives a work array more than one name", value)
        name = targets[0].id
        if name not in self._live:
            return []
        if name in self._declaring:
            return [f"{self._declaration(self.types.types[name], self.names[name])};"]
        raise self.types.not_exportable("makes a work array inside a loop or a branch", value)

    def _store(self, node: ast.stmt, target: ast.expr, value: ast.expr) -> list[str]:
        kind = self.types.infer(target)
        if c.is_constant(kind):
            return []
        if isinstance(target, ast.Name) and target.id not in self._live:
            return self._discard(value)
        return [self._assignment_line(node, target, self.expressions.as_type(value, kind))]

    def _discard(self, value: ast.expr) -> list[str]:
        """Return the line that evaluates an unused value, if it has side effects."""
        text = self.expressions.text(value)
        if self.types.writes_arrays(value):
            return [f"(void){text};"]
        return []

    def _assignment_line(self, node: ast.stmt, target: ast.expr, text: str) -> str:
        """Return the line that assigns to a variable or an array element."""
        if isinstance(target, ast.Name) and self._declaring.get(target.id) is node:
            kind = self.types.types[target.id]
            return f"{self._declaration(kind, self.names[target.id])} = {text};"
        return f"{self.expressions.text(target)} = {text};"

    def _unpack(self, node: ast.stmt, targets: Sequence[ast.expr], value: ast.expr) -> list[str]:
        kind = self.types.infer_tuple(value)
        if c.is_constant(kind):
            return self._unpack_items(node, targets, kind, self.expressions.text(value))
        if not self._wanted_items(targets, kind):
            return self._discard(value)
        name = self._temporary("values")
        line = f"const {self.program.c_type(kind)} {name} = {self.expressions.text(value)};"
        return [line, *self._unpack_items(node, targets, kind, name)]

    def _wanted_items(
        self, targets: Sequence[ast.expr], tuple_type: c.TupleType
    ) -> list[tuple[int, ast.expr]]:
        """Return the targets that need an assignment, with the indices of their items."""
        return [
            (index, target)
            for index, target in enumerate(targets)
            if (not isinstance(target, ast.Name) or target.id in self._live)
            and not c.is_constant(tuple_type.items[index])
        ]

    def _unpack_items(
        self, node: ast.stmt, targets: Sequence[ast.expr], tuple_type: c.TupleType, source: str
    ) -> list[str]:
        """Return the lines that assign the items of a tuple to targets or their parts."""
        lines = []
        for index, target in self._wanted_items(targets, tuple_type):
            item = tuple_type.items[index]
            place = tuple_type.item_expression(source, index)
            if isinstance(target, ast.Tuple) and isinstance(item, c.TupleType):
                lines += self._unpack_items(node, target.elts, item, place)
                continue
            own = self.types.infer(target)
            if own != item and isinstance(own, c.ScalarType):
                place = f"({self.program.c_type(own)}){place}"
            lines.append(self._assignment_line(node, target, place))
        return lines

    def _temporary(self, prefix: str) -> str:
        self._temporaries += 1
        name = f"{prefix}_{self._temporaries}"
        if name in self.names.values():
            return self._temporary(prefix)
        return name

    # --- order of evaluation ---------------------------------------------------------------------

    def _check_evaluation_order(self, node: ast.stmt) -> None:
        """Check that the value does not depend on an evaluation order that C leaves open."""
        for value in function_analysis.expressions_in(node):
            for piece in function_analysis.sequenced_parts(value):
                calls = [part for part in ast.walk(piece) if isinstance(part, ast.Call)]
                acting = [call for call in calls if self.types.written_arrays(call)]
                written = {name for call in acting for name in self.types.written_arrays(call)}
                if len(acting) > 1 or _arrays_read_beside(piece, acting) & written:
                    raise self.types.not_exportable(
                        "depends on an evaluation order that C leaves open", value
                    )


def _arrays_read_beside(piece: ast.AST, calls: Sequence[ast.Call]) -> set[str]:
    """Return the names of the arrays that an expression reads outside of some of its calls."""
    inside = {id(part) for call in calls for part in ast.walk(call)}
    names = set()
    for part in ast.walk(piece):
        if id(part) in inside or not isinstance(part, ast.Subscript):
            continue
        if isinstance(part.value, ast.Name):
            names.add(part.value.id)
    return names


def _returns_zeros(node: ast.stmt) -> bool:
    """Return whether a statement returns zeros, as outside of contact."""
    if not isinstance(node, ast.Return) or not isinstance(node.value, ast.Tuple):
        return False
    return {getattr(item, "value", None) for item in node.value.elts} == {0.0}


def _range_arguments(call: ast.Call) -> tuple[ast.expr, ast.expr, ast.expr]:
    """Return start, end and step of ``range(...)``."""
    start: ast.expr = ast.Constant(0)
    step: ast.expr = ast.Constant(1)
    if len(call.args) == 1:
        return start, call.args[0], step
    start, end, *rest = call.args
    return start, end, [*rest, step][0]


def _loop_control(name: str, end: str, step: int) -> str:
    """Return the condition and the step of a loop over integers in C."""
    if step > 0:
        condition = f"{name} < {end}"
        change = f"{name} += {step}"
    else:
        condition = f"{name} > {end}"
        change = f"{name} -= {-step}"
    change = {1: f"{name}++", -1: f"{name}--"}.get(step, change)
    return f"{condition}; {change}"


def _c_name(name: str, kind: ValueType) -> str:
    """Return the name of a variable in C."""
    if name in RESERVED_WORDS:
        name = f"{name}_"
    return c.constant_name(kind) or name


def _indent(lines: Sequence[str]) -> list[str]:
    return [f"    {line}" for line in lines]
