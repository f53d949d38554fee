"""What the README shows is what the program does."""

from __future__ import annotations

import io
import re
from pathlib import Path

from rich.console import Console

from asperity.analysis import compare
from asperity.report import print_comparison
from asperity.scene import load_scene

README = (Path(__file__).parents[1] / "README.md").read_text("utf-8")


def test_the_table_is_the_one_that_the_command_prints() -> None:
    shown = re.search(r"asperity compare (sinusoid:\S+)\n(.*?)\n```", README, re.S)
    assert shown is not None
    console = Console(width=88, file=io.StringIO(), force_terminal=False)
    print_comparison(compare(load_scene(shown[1]).texture), console)
    printed = console.file.getvalue()
    printed_lines = [line.rstrip() for line in printed.splitlines()]
    for line in shown[2].splitlines():
        assert line in printed_lines


def test_the_python_example_runs() -> None:
    for block in re.findall(r"```python\n(.*?)```", README, re.S):
        exec(block, {})
