"""lab on the command line: what cannot be is said before anything starts."""

from __future__ import annotations

import pytest
from click.testing import CliRunner

from asperity.cli.main import cli
from asperity.errors import ParameterError, SurfaceFileError


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nothing.png"], "nothing.png"), (["velvet"], "velvet"), (["--law", "Q"], "law"),
        (["--device", "none"], "none"), (["--port", "-1"], "port"), (["--port", "x"], "port"),
        (["--stiffness=-1N/m"], "stiffness"), (["--port", "70000"], "port"),
    ],
)  # fmt: skip
def test_bad_input_is_named(arguments: list[str], words: str) -> None:
    done = CliRunner().invoke(cli, ["lab", "--no-browser", *arguments])
    assert isinstance(done.exception, ParameterError | SurfaceFileError)
    assert words in str(done.exception)
