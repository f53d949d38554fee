"""``asperity lab``: invalid input is refused before the server starts."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from socket import socket

import pytest
from click.testing import CliRunner

from asperity.cli.main import cli
from asperity.core.errors import ParameterError, SurfaceFileError


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["nothing.png"], "nothing.png"),
        (["velvet"], "velvet"),
        (["--law", "Q"], "law"),
        (["--device", "none"], "none"),
        (["--port", "-1"], "port"),
        (["--port", "x"], "port"),
        (["--stiffness=-1N/m"], "stiffness"),
        (["--port", "70000"], "port"),
    ],
)
def test_invalid_input_is_named_in_the_error(arguments: list[str], words: str) -> None:
    result = CliRunner().invoke(cli, ["lab", "--no-browser", *arguments])
    assert isinstance(result.exception, ParameterError | SurfaceFileError)
    assert words in str(result.exception)


def test_address_is_printed_when_no_browser_is_found(
    monkeypatch: pytest.MonkeyPatch, capfd: pytest.CaptureFixture[str]
) -> None:
    async def serve_lab(
        _stage: object,
        server_socket: socket,
        ready: Callable[[str], None],
        *_others: object,
        **_more: object,
    ) -> None:
        server_socket.close()
        ready("http://127.0.0.1:1/token/")

    monkeypatch.setattr("asperity.lab.server.serve_lab", serve_lab)
    opened = []

    def open_browser(address: str) -> bool:
        path = Path(address.removeprefix("file://"))
        opened.append((address, path.read_text(), path.stat().st_mode & 0o777))
        opened.append(path.parent.stat().st_mode & 0o777)
        return False

    monkeypatch.setattr("webbrowser.open", open_browser)
    result = CliRunner().invoke(cli, ["lab", "--port", "0"])
    assert result.exit_code == 0
    messages = result.output + capfd.readouterr().err
    started = messages.index("the address of the lab follows")
    assert started < messages.index("the lab is at http://127.0.0.1:1/token/")
    assert "no browser was found: open the address in a browser of this machine" in result.output
    # The address on the command line of the browser holds no token.
    (address, text, mode), folder_mode = opened
    assert "token" not in address
    assert "url=http://127.0.0.1:1/token/" in text
    assert (mode, folder_mode) == (0o600, 0o700)
