"""Fixtures of the command-line tests: the program, run in the test process."""

from __future__ import annotations

import sys
from collections.abc import Callable

import pytest

from asperity.cli.main import main

Call = Callable[..., tuple[int, str, str]]


@pytest.fixture
def call(
    request: pytest.FixtureRequest,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> Call:
    """Return a function that runs the program and returns exit code, stdout and stderr.

    A test module may set COMMAND = "limits" to run one command in every call, and WIDTH = 120
    to set the width of the terminal.
    """
    default_width = getattr(request.module, "WIDTH", None)
    command = [request.module.COMMAND] if hasattr(request.module, "COMMAND") else []

    def run(*arguments: str, width: int | None = default_width) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["asperity", *command, *arguments])
        if width is not None:
            monkeypatch.setenv("COLUMNS", str(width))
        code = 0
        try:
            main()
        except SystemExit as stop:
            code = int(stop.code or 0)
        return code, *capsys.readouterr()

    return run
