"""Answers that a page keeps as text are those that its commands print.

The pages of the documentation run their blocks when they are built ({run} and {shell}); README is
read as it is, so its answers are kept. In a ``console`` block a line ``$ asperity ...`` (or with
``.venv/bin/`` before it) that is followed by output is run, 88 columns wide. A last line ``...``
stands for the paragraphs that are left out.

``python docs/answers.py`` writes the answers of README.md anew; tests/test_answers.py compares.
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


def answered(page: str) -> str:
    """Return a page with the answers that its commands give now.

    Raises:
        RuntimeError: if one of the commands ends with an exit code.
    """
    return _CONSOLE.sub(lambda block: _answered_block(block[1]), page)


def _answered_block(block: str) -> str:
    parts = re.split(r"^(?=\$ )", block, flags=re.M)
    return "".join(_answered_command(part) for part in parts)


def _answered_command(part: str) -> str:
    line, _, shown = part.partition("\n")
    command = _COMMAND.fullmatch(line)
    if command is None or not shown.strip():
        return part
    paragraphs = shown.strip().split("\n\n")
    kept = len(paragraphs) - 1 if paragraphs[-1] == "..." else None
    return f"{line}\n{first_paragraphs(printed(command[1]), kept)}\n"


def printed(command: str) -> str:
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
    PAGE.write_text(answered(PAGE.read_text("utf-8")), encoding="utf-8")
