"""What README shows is what the program does, and no page names an option that is not there."""

from __future__ import annotations

import importlib.util
import re
import shlex
import sys
from pathlib import Path
from types import ModuleType

import click
import pytest

import asperity
from asperity.cli.main import COMMANDS, check_not_repeated, cli

ROOT = Path(__file__).parents[2]
README = (ROOT / "README.md").read_text("utf-8")
_NOT_WRITTEN = {"_build", "_generated", "gallery"}
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md")),
    *sorted(
        path
        for path in (ROOT / "docs").rglob("*.md")
        if not _NOT_WRITTEN & set(path.relative_to(ROOT).parts)
    ),
]
# "$ asperity ..." in a block, maybe after a variable, "time" or a folder; `asperity ...` in a line.
_SHOWN = re.compile(r"^\$ (?:\w+=\S+ |time )?(?:\.venv/bin/)?asperity (.*)$", re.M)
_NAMED = re.compile(rf"`asperity ((?:{'|'.join(COMMANDS)})\b[^`]*)`")
VERSION = f"asperity, version {asperity.__version__}"
_FLAG = re.compile(r"`(--[a-z][a-z-]+)")


@pytest.fixture(scope="module")
def answers() -> ModuleType:
    """The script that writes the answers."""
    spec = importlib.util.spec_from_file_location("answers", ROOT / "docs" / "answers.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_the_answers_are_those_that_the_commands_print(answers: ModuleType) -> None:
    shown = re.findall(r"^\$ \.venv/bin/asperity .*\n(?!\$|```)", README, re.M)
    assert shown == ["$ .venv/bin/asperity compare sinusoid:amplitude=0.4mm,period=1.5mm\n"]
    assert answers.update_page(README) == README, "python docs/answers.py writes them anew"


def _page(answer: str) -> str:
    return f"Words.\n```console\n$ make demo\n$ asperity --version\n{answer}\n```\n"


@pytest.mark.parametrize("wrong", ["asperity, version 0.1.9", f"{VERSION}\nmore"])
def test_a_changed_digit_is_noticed(answers: ModuleType, wrong: str) -> None:
    assert answers.update_page(_page(wrong)) == _page(VERSION)
    assert answers.update_page(_page(VERSION)) == _page(VERSION)


def test_what_is_left_out_is_not_compared(
    answers: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(answers, "capture_output", lambda _command: "one\ntwo\n\nthree 3\n\nfour")
    for kept in ("one\ntwo\n\n...", "one\ntwo\n\nthree 3\n\n...", "one\ntwo\n\nthree 3\n\nfour"):
        assert answers.update_page(_page(kept)) == _page(kept)
    assert answers.update_page(_page("one\n\nthree 4\n\n...")) == _page(
        "one\ntwo\n\nthree 3\n\n..."
    )


def test_a_command_that_fails_is_no_answer(answers: ModuleType) -> None:
    with pytest.raises(RuntimeError, match="exit code 2"):
        answers.capture_output("asperity devices tuch")


def test_a_block_whose_words_are_wrong_stops_the_build(answers: ModuleType) -> None:
    """What words claim of an output is asserted below it; {run} and {shell} run by these."""
    commands = sys.modules[answers.run_command.__module__]
    names: dict[str, object] = {}
    assert commands.execute("found = 0.61\nprint(found)\nfound", names) == ("0.61\n", 0.61)
    with pytest.raises(AssertionError):
        commands.execute("assert f'{found:.2f}' == '0.62'", names)
    with pytest.raises(RuntimeError, match="expected to be refused"):
        commands.execute("found", names, True)
    assert commands.first_paragraphs("a\n\nb\n\nc", 2) == "a\n\nb\n\n..."


def test_the_python_example_runs() -> None:
    for block in re.findall(r"```python\n(.*?)```", README, re.S):
        exec(block, {})


def _parse(command: str) -> None:
    """Parse a command as click does, without its values: the files of a page may not be there."""
    words = shlex.split(command.partition(" > ")[0], comments=True)
    found = cli.get_command(click.Context(cli), words[0])
    assert found is not None, words[0]
    found.make_parser(click.Context(found)).parse_args(words[1:])
    check_not_repeated(found, words[1:])


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_and_options_that_a_page_names_exist(page: Path) -> None:
    text = page.read_text("utf-8")
    for command in (*_SHOWN.findall(text), *_NAMED.findall(text)):
        _parse(command)
    known = {"--help", "--version"}
    for name in COMMANDS:
        found = cli.get_command(click.Context(cli), name)
        assert found is not None
        known |= {flag for option in found.params for flag in option.opts}
    assert set(_FLAG.findall(text)) - known == set()


@pytest.mark.parametrize("command", ["compare cloth --devise touch", "conpare cloth"])
def test_an_option_that_does_not_exist_is_noticed(command: str) -> None:
    with pytest.raises((click.UsageError, AssertionError)):
        _parse(command)


def test_answers_are_kept_by_readme_alone() -> None:
    """Elsewhere {shell} and {run} print them when the pages are built: nothing is written down."""
    for page in PAGES[2:]:
        for block in re.findall(r"^```console\n(.*?)^```$", page.read_text("utf-8"), re.M | re.S):
            assert all(line.startswith("$ ") for line in block.splitlines()), page
        assert "```text" not in page.read_text("utf-8"), page
