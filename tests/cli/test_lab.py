"""lab on the command line: what cannot be is said before anything starts."""

from __future__ import annotations

from collections.abc import Callable
from socket import socket

import pytest
from click.testing import CliRunner

from asperity.cli.main import cli
from asperity.core.errors import ParameterError, SurfaceFileError


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


@pytest.mark.parametrize("name", ["real", "replay:other.mcap"])
def test_a_recording_is_shown_on_the_simulated_device_alone(name: str) -> None:
    done = CliRunner().invoke(cli, ["lab", "--no-browser", "run.mcap", "--driver", name])
    assert isinstance(done.exception, ParameterError)
    assert "driver cannot play back the recording run.mcap: leave it out" in str(done.exception)


def test_without_a_browser_the_address_is_said(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    def run_lab(
        _stage: object,
        bound: socket,
        ready: Callable[[str], None],
        *_others: object,
        **_more: object,
    ) -> None:
        bound.close()
        ready("http://127.0.0.1:1/token/")

    monkeypatch.setattr("asperity.lab.launch.run_lab", run_lab)
    monkeypatch.setattr("webbrowser.open", lambda _address: False)
    done = CliRunner().invoke(cli, ["lab", "--port", "0"])
    assert done.exit_code == 0
    assert "the lab is at http://127.0.0.1:1/token/" in done.output + capfd.readouterr().err
    assert "no browser was found: open the address in a browser of this machine" in done.output
