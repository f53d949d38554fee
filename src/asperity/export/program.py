"""Conversion of the linked source of compiled functions to C.

The source is the one that Numba compiles (:mod:`asperity.kernels.fuse`). A root function and all
functions that it calls are converted, once for each combination of argument types; callees come
before their callers.
"""

from __future__ import annotations

import ast
import importlib
import re
from collections.abc import Mapping

from asperity.export import c_language as c
from asperity.export.c_language import NotExportableError, ValueType
from asperity.export.function_analysis import FunctionTypes
from asperity.export.statements import FunctionPrinter

_SINGLE_PRECISION_ROUNDINGS = {"EPS": 2.0**-23, "SQRT_EPS": 2.0**-11.5}
"""Constants of :mod:`asperity.core.compiled` in single precision."""


class LinkedSource:
    """Functions and constants of a linked source.

    Args:
        text: the source.

    Attributes:
        functions: functions by name.
        numbers: numbers of the modules, by name.
        records: field names of the records, by name of the record.
    """

    def __init__(self, text: str) -> None:
        self.functions: dict[str, ast.FunctionDef] = {}
        self.numbers: dict[str, float] = {}
        self.records: dict[str, tuple[str, ...]] = {}
        for node in ast.parse(text).body:
            if isinstance(node, ast.FunctionDef):
                self.functions[node.name] = node
            elif isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                self.numbers[node.targets[0].id] = ast.literal_eval(node.value)
            elif isinstance(node, ast.ImportFrom) and node.module is not None:
                module = importlib.import_module(node.module)
                for alias in node.names:
                    self.records[alias.name] = tuple(getattr(module, alias.name)._fields)


class Program:
    """C code that is made function by function.

    Args:
        linked: the compiled functions.
        prefix: prefix of all names, such as ``texture``.
        single: whether real numbers are of single precision.
        reserved: names, after the prefix, that functions must not have.

    Attributes:
        types: C types of tuples, with their constructors.
        helpers: helper functions.
        functions: the compiled functions.
    """

    def __init__(
        self,
        linked: LinkedSource,
        prefix: str,
        *,
        single: bool,
        reserved: frozenset[str] = frozenset(),
    ) -> None:
        self.linked = linked
        self.prefix = prefix
        self.single = single
        self.numbers: Mapping[str, float] = linked.numbers
        if single:
            self.numbers = linked.numbers | _SINGLE_PRECISION_ROUNDINGS
        self.records: Mapping[str, tuple[str, ...]] = linked.records
        self.signatures: Mapping[str, tuple[str, ...]] = {
            name: tuple([argument.arg for argument in node.args.args])
            for name, node in linked.functions.items()
        }
        self.types: list[str] = []
        self.helpers: list[str] = []
        self.functions: list[str] = []
        self._used_names = set(reserved)
        self._names: dict[object, str] = {}
        self._inferred: dict[tuple[str, tuple[ValueType, ...]], FunctionTypes] = {}
        self._in_progress: list[str] = []

    @property
    def real_type(self) -> str:
        """``float`` or ``double``."""
        return "float" if self.single else "double"

    # --- type inference -----------------------------------------------------------------------

    def infer_types(self, name: str, argument_types: tuple[ValueType, ...]) -> FunctionTypes:
        """Return the types of a compiled function for given argument types.

        Raises:
            NotExportableError: for a recursive function, or one that cannot be exported.
        """
        key = (name, argument_types)
        if key not in self._inferred:
            if name in self._in_progress:
                raise NotExportableError(name, "calls itself")
            self._in_progress.append(name)
            try:
                node = self.linked.functions[name]
                self._inferred[key] = FunctionTypes(node, argument_types, self)
            finally:
                self._in_progress.pop()
        return self._inferred[key]

    # --- names --------------------------------------------------------------------------------

    def helper_name(self, helper: c.HelperFunction) -> str:
        """Return the name of a helper function, which is added to the program."""
        if helper not in self._names:
            self._names[helper] = self._unique_name(helper.name)
            text = helper.definition.replace(f"@{helper.name}", self._names[helper])
            text = re.sub(r"\breal\b", self.real_type, text)
            suffix = "f" if self.single else ""
            self.helpers.append(text.replace("!(", f"{suffix}("))
        return self._names[helper]

    def function_name(self, name: str, argument_types: tuple[ValueType, ...]) -> str:
        """Return the name of a compiled function, which is added to the program."""
        types = self.infer_types(name, argument_types)
        if types not in self._names:
            self._names[types] = self._unique_name(name)
            self.functions.append(self._print_function(types, self._names[types]))
        return self._names[types]

    def _print_function(self, types: FunctionTypes, name: str) -> str:
        statements = FunctionPrinter(types, self)
        parameters = ", ".join(statements.parameter_declarations()) or "void"
        result = "void"
        if types.result_type != c.VOID:
            result = self.c_type(types.result_type)
        inline = "static inline"
        if "inlined" in map(ast.unparse, types.node.decorator_list):
            inline = f"{self.prefix.upper()}_INLINE"
        lines = statements.lines(f"{inline} {result} {name}({parameters})")
        return comment(ast.get_docstring(types.node) or "") + "\n".join(lines) + "\n"

    def _unique_name(self, name: str) -> str:
        """Return a unique name with the prefix."""
        unique = name
        number = 1
        while unique in self._used_names:
            number += 1
            unique = f"{name}_{number}"
        self._used_names.add(unique)
        return f"{self.prefix}_{unique}"

    # --- tuples -------------------------------------------------------------------------------

    def c_type(self, value_type: ValueType) -> str:
        """Return the C type of a number or a tuple."""
        if isinstance(value_type, c.TupleType):
            return self._tuple_type(value_type)
        return c.c_scalar_type(value_type, self.real_type)

    def _tuple_type(self, tuple_type: c.TupleType) -> str:
        if tuple_type not in self._names:
            codes = [self._type_code(item) for item in tuple_type.items]
            name = "_".join(codes)
            if tuple_type.is_uniform:
                name = f"{codes[0]}{len(codes)}"
            self._names[tuple_type] = self._unique_name(name)
            self.types.append(self._tuple_definition(tuple_type, self._names[tuple_type]))
        return self._names[tuple_type]

    def _type_code(self, value_type: ValueType) -> str:
        if isinstance(value_type, c.ScalarType):
            return {c.BOOL: "flag", c.INT: "int", c.SINGLE: "single"}.get(value_type, "real")
        return self.c_type(value_type).removeprefix(f"{self.prefix}_")

    def _tuple_definition(self, tuple_type: c.TupleType, name: str) -> str:
        types = [self.c_type(item) for item in tuple_type.items]
        parameters = [f"{item_type} f{index}" for index, item_type in enumerate(types)]
        members = [f"    {parameter};" for parameter in parameters]
        if tuple_type.is_uniform:
            members = [f"    {types[0]} v[{len(types)}];"]
        lines = ["typedef struct {", *members, f"}} {name};", ""]
        head = f"static inline {name} {self.constructor_name(tuple_type)}({', '.join(parameters)})"
        lines += [head, "{", f"    {name} made;"]
        for index in range(len(types)):
            lines.append(f"    {tuple_type.item_expression('made', index)} = f{index};")
        return "\n".join([*lines, "    return made;", "}", ""])

    def constructor_name(self, value_type: c.TupleType) -> str:
        """Return the name of the constructor of a tuple."""
        return f"{self.prefix}_make_{self.c_type(value_type).removeprefix(f'{self.prefix}_')}"


def comment(text: str) -> str:
    """Return the first paragraph of a docstring as a C comment; empty if there is none.

    Example:
        >>> print(comment("Return h [m]."), end="")
        /* Return h [m]. */
    """
    if not text.strip():
        return ""
    first = " ".join(text.split("\n\n", maxsplit=1)[0].split())
    return f"/* {_escape_comment(first)} */\n"


def _escape_comment(text: str) -> str:
    return text.replace("*/", "* /").replace("/*", "/ *")


def block_comment(text: str) -> str:
    """Return a text as a C block comment; empty for an empty text.

    Example:
        >>> print(block_comment("f = k d w"), end="")
        /*
         * f = k d w
         */
    """
    safe = _escape_comment(text.strip())
    if not safe:
        return ""
    lines = [f" * {line}".rstrip() for line in safe.splitlines()]
    return "\n".join(["/*", *lines, " */", ""])
