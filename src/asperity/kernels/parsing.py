"""Python text as a tree, in any thread.

Python 3.11 counts how deep a tree is for all threads together: two that parse at the same time may
end with SystemError, "AST constructor recursion depth mismatch" (python/cpython issue 106905).
"""

from __future__ import annotations

import ast
from threading import Lock

_PARSING = Lock()


def tree_of(source: str) -> ast.Module:
    """Return the tree of a source text.

    Raises:
        SyntaxError: for a text that is no Python.
    """
    with _PARSING:
        return ast.parse(source)
