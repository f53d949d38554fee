"""Twelve tasks of a newcomer, each run as typed in ``examples/twelve_tasks.sh``."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
import time
from pathlib import Path

import click
import pytest

from asperity.cli.main import cli

ROOT = Path(__file__).parents[2]
SCRIPT = ROOT / "examples" / "twelve_tasks.sh"
_PARTS = re.split(r"^# (\d+)\. (.*)\n", SCRIPT.read_text("utf-8"), flags=re.M)
HEADER, TASKS = _PARTS[0], dict(zip(map(int, _PARTS[1::3]), _PARTS[3::3], strict=True))
_STOP = "trap 'kill $(jobs -p) 2> /dev/null || true' EXIT\n"  # of what a failing task leaves
MAX_TIME = 120.0
"""Greatest duration of a task [s]."""


def run(commands: str, folder: Path) -> str:
    """Run commands of the script and return their messages and output; none of them may fail."""
    shell = shutil.which("bash")
    if shell is None:
        pytest.skip("not run: no bash here")
    programs = folder / "bin"
    programs.mkdir()
    start = f'#!/bin/sh\nexec "{sys.executable}"'
    for name, options in (("asperity", " -m asperity"), ("python", "")):
        (programs / name).write_text(f'{start}{options} "$@"\n', encoding="utf-8")
        (programs / name).chmod(0o755)
    names = {
        "PATH": f"{programs}{os.pathsep}{os.environ['PATH']}",
        "EXAMPLES": str(ROOT / "examples"),
        "COLUMNS": "80",
    }
    started = time.monotonic()
    result = subprocess.run(
        [shell, "-euc", _STOP + HEADER + commands],
        cwd=folder,
        env=os.environ | names,
        capture_output=True,
        text=True,
        timeout=2 * MAX_TIME,
        check=False,
    )
    assert result.returncode == 0, result.stderr
    assert time.monotonic() - started < MAX_TIME
    return result.stderr + result.stdout


RECOMMENDATION = r"^(Use law \w|No law)"
EXPECTED: dict[int, tuple[str, dict[str, str]]] = {
    1: (RECOMMENDATION, {}),
    2: (RECOMMENDATION, {"my-arm.toml": "max_stiffness"}),
    3: (r"^S +\d", {}),
    4: (r"500 N/m", {}),
    5: (RECOMMENDATION, {"report.html": "<svg", "result.json": '"schema": 4'}),
    6: (r"texture\.h", {"texture.h": "texture_force", "chai3d_effect.hpp": "texture_force"}),
    7: (r"^1\.\d+ \d{4,}$", {}),
    8: (RECOMMENDATION, {"phone.html": "width=device-width"}),
    9: (r"^Law C at \d", {"print.html": "@media print"}),
    10: (
        r"http://(127\.0\.0\.1|localhost):\d+",
        {"claim.html": "eq-5", "lecture/fig-3.svg": "<svg"},
    ),
    11: (r"did you mean '--device'[\s\S]*^law start at texture", {}),
    12: (r"The recording was not closed", {"run.csv": "x [m]"}),
    13: (
        r"must not be mixed[\s\S]*P01: 1 answer in[\s\S]*Deleted in rough-simulated-device: P01/",
        {"rough-simulated-typical/trials.csv": ",typical"},
    ),
    14: (r"^Use law C [\s\S]*its texture of [\s\S]*RMS is\s+felt\.", {}),
    15: (r"Output written on paper\.pdf|not run: no pdflatex here", {"table.tex": "tabular"}),
}
"""A pattern of stderr and stdout, and words of the files that each task writes."""


def test_script_has_its_tasks() -> None:
    assert list(TASKS) == list(EXPECTED) == list(range(1, 1 + len(EXPECTED)))


@pytest.mark.parametrize("number", EXPECTED)
def test_task_succeeds_within_two_minutes(number: int, tmp_path: Path) -> None:
    pattern, files = EXPECTED[number]
    text = run(TASKS[number], tmp_path)
    assert re.search(pattern, text, re.M), text
    for name, words in files.items():
        assert words in (tmp_path / name).read_text("utf-8")
    if missing := re.search(r"^not run: .*", text, re.M):
        pytest.skip(missing[0])


def test_failing_task_is_detected(tmp_path: Path) -> None:
    with pytest.raises(AssertionError, match="is unknown"):
        run("asperity devices nothing\n", tmp_path)


def _options(words: list[str]) -> set[str]:
    """Return the options in the help of a command, which hides or folds some, as users see it."""
    context, command = click.Context(cli), cli.get_command(click.Context(cli), words[0])
    if isinstance(command, click.Group):
        context = click.Context(command, parent=context)
        command = command.get_command(context, words[1])
    assert command is not None, words
    text = command.get_help(click.Context(command, parent=context))
    return set(re.findall(r"--[a-z][\w-]+|-o\b", text))


@pytest.mark.parametrize("number", sorted(set(TASKS) - {1, 11}))
def test_options_of_a_task_are_in_the_help_of_its_command(number: int) -> None:
    lines = re.findall(r"^(?:timeout .* )?asperity ([^\n&]*)", TASKS[number], re.M)
    assert lines or number == 7
    for line in lines:
        words = line.split()
        options = {word for word in words if re.fullmatch(r"--[a-z][\w-]+|-o", word)}
        assert options <= _options(words), line
