"""What the tests of commands share: the program as it is called, in this process."""

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
    """Return a function that runs the program and returns exit code, output and errors.

    A module whose tests are all of one command names it, COMMAND = "limits", and one whose tests
    need a terminal of another width than usual says so: WIDTH = 120.
    """
    usual = getattr(request.module, "WIDTH", None)
    command = [request.module.COMMAND] if hasattr(request.module, "COMMAND") else []

    def run(*arguments: str, width: int | None = usual) -> tuple[int, str, str]:
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
