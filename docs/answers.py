"""Update the output of commands in README: ``python docs/answers.py``.

The pages of the documentation run their blocks when they are built; README contains its output as
text. In a ``console`` block, a line ``$ asperity ...`` (or ``$ .venv/bin/asperity ...``) that is
followed by output is run, 88 columns wide. A last line ``...`` stands for omitted paragraphs.
tests/docs/test_readme.py compares.
"""

from __future__ import annotations

import re
import sys
import tempfile
from pathlib import Path

HERE = Path(__file__).parent
sys.path.insert(0, str(HERE / "_ext"))
from commands import first_paragraphs, run_command  # noqa: E402 - after the path is set

PAGE = HERE.parent / "README.md"
_CONSOLE = re.compile(r"(?<=^```console\n)(.*?)(?=^```$)", re.M | re.S)
_COMMAND = re.compile(r"\$ (?:\.venv/bin/)?(asperity .*)")


def update_page(page: str) -> str:
    """Return a page with the answers that its commands give now.

    Raises:
        RuntimeError: if one of the commands ends with an exit code.
    """
    return _CONSOLE.sub(lambda block: _update_block(block[1]), page)


def _update_block(block: str) -> str:
    parts = re.split(r"^(?=\$ )", block, flags=re.M)
    return "".join(_update_command(part) for part in parts)


def _update_command(part: str) -> str:
    line, _, output = part.partition("\n")
    command = _COMMAND.fullmatch(line)
    if command is None or not output.strip():
        return part
    paragraphs = output.strip().split("\n\n")
    count = len(paragraphs) - 1 if paragraphs[-1] == "..." else None
    return f"{line}\n{first_paragraphs(capture_output(command[1]), count)}\n"


def capture_output(command: str) -> str:
    """Return what ``asperity ...`` prints, run in an empty folder.

    Raises:
        RuntimeError: if it ends with an exit code.
    """
    with tempfile.TemporaryDirectory() as folder:
        code, text = run_command(command, folder)
    if code:
        raise RuntimeError(f"{command}: exit code {code}: {text}")
    return text.strip()


if __name__ == "__main__":
    PAGE.write_text(update_page(PAGE.read_text("utf-8")), encoding="utf-8")
