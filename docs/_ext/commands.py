"""What a page shows is run in this process: Python, and the command ``asperity``."""

from __future__ import annotations

import ast
import contextlib
import io
import os
import re
import shlex
from typing import Any

COLUMNS = "88"  # characters that fit the width of a page


def execute(source: str, names: dict[str, Any], expect_error: bool = False) -> tuple[str, Any]:
    """Run a block; return what it printed and the value of its last line.

    Args:
        source: Python statements, the last of which may be an expression.
        names: variables, which are changed.
        expect_error: whether the block must end with one of asperity's own errors, whose
            message is then printed.

    Raises:
        RuntimeError: if an expected error does not happen.
    """
    from asperity.core.errors import AsperityError

    tree = ast.parse(source)
    last = tree.body.pop() if tree.body and isinstance(tree.body[-1], ast.Expr) else None
    value, printed = None, io.StringIO()
    with contextlib.redirect_stdout(printed):
        try:
            exec(compile(tree, "<page>", "exec"), names)
            if last is not None and isinstance(last, ast.Expr):
                value = eval(compile(ast.Expression(last.value), "<page>", "eval"), names)
        except AsperityError as error:
            if not expect_error:
                raise
            print(f"{type(error).__name__}: {error}")
            return printed.getvalue(), None
    if expect_error:
        raise RuntimeError("the block was expected to be refused, but ran")
    return printed.getvalue(), value


def run_command(command: str, folder: str) -> tuple[int, str]:
    """Run ``asperity ...`` in this process; return its exit code and what it printed."""
    from unittest import mock

    from asperity.cli import main

    words = shlex.split(command)
    if words[0] != "asperity":
        raise ValueError(f"not an asperity command: {command}")
    printed, code = io.StringIO(), 0
    environment = {**os.environ, "COLUMNS": COLUMNS, "NO_COLOR": "1"}
    with (
        contextlib.chdir(folder),
        mock.patch("sys.argv", words),
        mock.patch.dict(os.environ, environment),
        contextlib.redirect_stdout(printed),
        contextlib.redirect_stderr(printed),
    ):
        try:
            main.main()
        except SystemExit as stop:
            code = int(stop.code or 0)
    return code, "\n".join(line.rstrip() for line in printed.getvalue().splitlines())


def first_paragraphs(text: str, count: int | None) -> str:
    """Return the first paragraphs of a text, with "..." for the others; all for None."""
    parts = re.split(r"\n\n+", text)
    return text if count is None else "\n\n".join([*parts[:count], "..."])
