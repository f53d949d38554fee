"""A linked text of compiled functions as C functions.

The text is the one that Numba compiles (:mod:`asperity.kernels.fuse`). From a function at the root
every function that it calls is printed, once for each combination of kinds of arguments, before
those that call it.
"""

from __future__ import annotations

import ast
import importlib
import re
from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property

from asperity.export.expressions import real_literal
from asperity.export.known import Helper
from asperity.export.scope import Scope
from asperity.export.statements import Statements
from asperity.export.subset import (
    BOOL,
    INT,
    NOTHING,
    SINGLE,
    Group,
    Kind,
    NotExportableError,
    Number,
    number_type,
)

_ROUNDINGS = {"EPS": 2.0**-23, "ROOT_EPS": 2.0**-11.5}
"""What :mod:`asperity.compiled` says of double precision, in single precision."""


@dataclass(frozen=True)
class Linked:
    """A linked text, taken apart.

    Attributes:
        text: the text.
    """

    text: str

    @cached_property
    def functions(self) -> dict[str, ast.FunctionDef]:
        """Its functions by name."""
        nodes = ast.parse(self.text).body
        return {node.name: node for node in nodes if isinstance(node, ast.FunctionDef)}

    @cached_property
    def numbers(self) -> dict[str, float]:
        """The numbers of modules that its functions use."""
        found = {}
        for node in ast.parse(self.text).body:
            if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name):
                found[node.targets[0].id] = ast.literal_eval(node.value)
        return found

    @cached_property
    def records(self) -> dict[str, tuple[str, ...]]:
        """The names of the items of the records that its functions use."""
        found = {}
        for node in ast.parse(self.text).body:
            if isinstance(node, ast.ImportFrom) and node.module is not None:
                module = importlib.import_module(node.module)
                for alias in node.names:
                    found[alias.name] = tuple(getattr(module, alias.name)._fields)
        return found


class Program:
    """C functions, as they are printed.

    Args:
        linked: the compiled functions.
        prefix: of every name, such as ``texture``.
        single: whether real numbers are of single precision.
        taken: names after the prefix that functions must not have.

    Attributes:
        types: C types of tuples, with the functions that make them.
        helpers: small functions.
        functions: the compiled ones.
    """

    def __init__(
        self, linked: Linked, prefix: str, *, single: bool, taken: frozenset[str] = frozenset()
    ) -> None:
        self.linked, self.prefix, self.single = linked, prefix, single
        # What ends at rounding ends at that of the precision.
        own = _ROUNDINGS if single else {}
        self.numbers: Mapping[str, float] = linked.numbers | own
        self.records: Mapping[str, tuple[str, ...]] = linked.records
        self.types: list[str] = []
        self.helpers: list[str] = []
        self.functions: list[str] = []
        self._taken = set(taken)
        self._names: dict[object, str] = {}
        self._scopes: dict[tuple[str, tuple[Kind, ...]], Scope] = {}
        self._open: list[str] = []

    @property
    def real_type(self) -> str:
        """``float`` or ``double``."""
        return "float" if self.single else "double"

    # --- what scopes ask ----------------------------------------------------------------------

    def parameters(self, name: str) -> tuple[str, ...] | None:
        """See :class:`asperity.export.scope.Callees`."""
        node = self.linked.functions.get(name)
        return None if node is None else tuple(argument.arg for argument in node.args.args)

    def scope(self, name: str, kinds: tuple[Kind, ...]) -> Scope:
        """See :class:`asperity.export.scope.Callees`.

        Raises:
            NotExportableError: for a function that calls itself, and for what C does not know.
        """
        key = (name, kinds)
        if key not in self._scopes:
            if name in self._open:
                raise NotExportableError(name, "calls itself")
            self._open.append(name)
            self._scopes[key] = Scope(self.linked.functions[name], kinds, self)
            self._open.pop()
        return self._scopes[key]

    # --- what printers ask --------------------------------------------------------------------

    def real(self, value: float) -> str:
        """Return a real number as a literal."""
        return real_literal(value, self.single)

    def library(self, name: str) -> str:
        """Return the name of a function of C's library in the precision of the program."""
        return f"{name}f" if self.single else name

    def helper(self, helper: Helper) -> str:
        """Return the name of a small function, which is printed the first time."""
        if helper not in self._names:
            self._names[helper] = self._free(helper.name)
            text = helper.text.replace(f"@{helper.name}", self._names[helper])
            text = re.sub(r"\breal\b", self.real_type, text)
            # Functions of the library are marked by the sign that C has no use for there.
            text = text.replace("!(", "f(" if self.single else "(")
            self.helpers.append(text)
        return self._names[helper]

    def function(self, name: str, kinds: tuple[Kind, ...]) -> str:
        """Return the name of a compiled function, which is printed the first time."""
        scope = self.scope(name, kinds)
        if scope not in self._names:
            self._names[scope] = self._free(name)
            self.functions.append(self._printed(scope, self._names[scope]))
        return self._names[scope]

    def _printed(self, scope: Scope, name: str) -> str:
        statements = Statements(scope, self)
        given = ", ".join(statements.parameters()) or "void"
        result = "void" if scope.result == NOTHING else self.type_of(scope.result)
        inlined = any(getattr(word, "id", "") == "inlined" for word in scope.node.decorator_list)
        inline = f"{self.prefix.upper()}_INLINE" if inlined else "static inline"
        lines = statements.lines(f"{inline} {result} {name}({given})")
        return comment(ast.get_docstring(scope.node) or "") + "\n".join(lines) + "\n"

    def _free(self, name: str) -> str:
        """Return a name with the prefix that nothing else has."""
        whole, number = name, 1
        while whole in self._taken:
            number += 1
            whole = f"{name}_{number}"
        self._taken.add(whole)
        return f"{self.prefix}_{whole}"

    # --- tuples -------------------------------------------------------------------------------

    def type_of(self, kind: Kind) -> str:
        """Return the C type of a number or a tuple."""
        if isinstance(kind, Group):
            return self._tuple_type(kind)
        return number_type(kind, self.real_type)

    def _tuple_type(self, kind: Group) -> str:
        if kind not in self._names:
            codes = [self._code(item) for item in kind.items]
            name = f"{codes[0]}{len(codes)}" if kind.alike else "_".join(codes)
            self._names[kind] = name = self._free(name)
            self.types.append(self._tuple_text(kind, name))
        return self._names[kind]

    def _code(self, kind: Kind) -> str:
        if isinstance(kind, Number):
            return {BOOL: "flag", INT: "int", SINGLE: "single"}.get(kind, "real")
        return self.type_of(kind).removeprefix(f"{self.prefix}_")

    def _tuple_text(self, kind: Group, name: str) -> str:
        types = [self.type_of(item) for item in kind.items]
        fields = [f"f{i}" for i in range(len(types))]
        given = ", ".join(f"{one} {letter}" for one, letter in zip(types, fields, strict=True))
        if kind.alike:
            inside = [f"    {types[0]} v[{len(types)}];"]
            places = [f"v[{i}]" for i in range(len(types))]
        else:
            inside = [f"    {one} {letter};" for one, letter in zip(types, fields, strict=True)]
            places = fields
        lines = ["typedef struct {", *inside, f"}} {name};", ""]
        head = f"static inline {name} {self.make(kind)}({given})"
        lines += [head, "{", f"    {name} made;"]
        lines += [f"    made.{at} = {one};" for at, one in zip(places, fields, strict=True)]
        return "\n".join([*lines, "    return made;", "}", ""])

    def make(self, kind: Group) -> str:
        """Return the name of the C function that makes a tuple."""
        return f"{self.prefix}_make_{self.type_of(kind).removeprefix(f'{self.prefix}_')}"


def comment(text: str) -> str:
    """Return the first paragraph of a documentation as a C comment; empty if there is none.

    Example:
        >>> print(comment("Return h [m]."), end="")
        /* Return h [m]. */
    """
    first = (
        " ".join(text.split("\n\n", maxsplit=1)[0].split())
        .replace("*/", "* /")
        .replace("/*", "/ *")
    )
    return f"/* {first} */\n" if first else ""


def block_comment(text: str) -> str:
    """Return a text as a C comment, line by line; empty for no text.

    Example:
        >>> print(block_comment("f = k d w"), end="")
        /*
         * f = k d w
         */
    """
    safe = text.strip().replace("*/", "* /").replace("/*", "/ *")
    if not safe:
        return ""
    lines = "".join(f" * {line}".rstrip() + "\n" for line in safe.splitlines())
    return f"/*\n{lines} */\n"
