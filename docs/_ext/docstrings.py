"""Docstrings are plain text with |absolute values| and t_i: no accidental reStructuredText."""

from __future__ import annotations

import re
from typing import Any

from sphinx.application import Sphinx

# Literals and roles stay as they are; everything between them is escaped.
_VERBATIM = re.compile(r"(``.*?``|:[\w:]+:`.*?`|`[^`]+`_?)")
_ALIAS = re.compile(r"TypeAliasForwardRef\('(\w+)'\)")
_TRAILING = re.compile(r"(?<=\w)_(?=\W|$)")


def escape_markup(line: str) -> str:
    """Return a line of a docstring without accidental markup."""
    parts = _VERBATIM.split(line)
    for index in range(0, len(parts), 2):
        part = parts[index].replace("|", r"\|")
        part = re.sub(r"(?<!\\)\*(?=\S)", r"\*", part)
        parts[index] = _TRAILING.sub(r"\_", part)
    return "".join(parts)


def _process(
    _app: Sphinx, _what: str, _name: str, _obj: Any, _options: Any, lines: list[str]
) -> None:
    inside = False
    for index, line in enumerate(lines):
        prompt = line.lstrip().startswith(">>>")
        inside = prompt or (inside and bool(line.strip()))
        if not inside and not line.lstrip().startswith((".. ", ":")):
            lines[index] = escape_markup(line)


def _short_types(
    _app: Sphinx, _what: str, _name: str, _obj: Any, _options: Any, arguments: Any, returned: Any
) -> tuple[Any, Any]:
    """Return a signature in which aliases of array types are written as in the source."""
    return tuple(text and _ALIAS.sub(r"\1", text) for text in (arguments, returned))


def setup(app: Sphinx) -> dict[str, Any]:
    """Run before napoleon turns the sections into reStructuredText."""
    app.connect("autodoc-process-docstring", _process, priority=400)
    app.connect("autodoc-process-signature", _short_types)
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
