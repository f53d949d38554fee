"""Fixtures of the tests of user-defined extensions: the program, run in the test process."""

from __future__ import annotations

import json
from collections.abc import Callable
from typing import Any

import pytest

from asperity.cli.main import main

Call = Callable[..., tuple[int, str, str]]


@pytest.fixture
def call(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Call:
    """Return a function: ``call("compare", ...)`` gives exit code, stdout and stderr."""

    def run(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr("sys.argv", ["asperity", *arguments])
        code = 0
        try:
            main()
        except SystemExit as stop:
            code = int(stop.code or 0)
        out, err = capsys.readouterr()
        return code, out, err

    return run


@pytest.fixture
def read_json(call: Call) -> Callable[..., Any]:
    """Return a function: ``read_json("compare", ...)`` gives the JSON that the command writes."""

    def run(*arguments: str) -> Any:
        code, out, err = call(*arguments, "--json", "-")
        assert (code, err) == (0, "")
        return json.loads(out)

    return run
