"""Outputs in README equal those of the program; commands and options that pages name exist."""

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
_GENERATED = {"_build", "_generated", "gallery"}
PAGES = [
    *(ROOT / name for name in ("README.md", "CONTRIBUTING.md")),
    *sorted(
        path
        for path in (ROOT / "docs").rglob("*.md")
        if not _GENERATED & set(path.relative_to(ROOT).parts)
    ),
]
# "$ asperity ..." in a block, perhaps after a variable, "time" or a path; `asperity ...` inline.
_CONSOLE_COMMAND = re.compile(r"^\$ (?:\w+=\S+ |time )?(?:\.venv/bin/)?asperity (.*)$", re.M)
_INLINE_COMMAND = re.compile(rf"`asperity ((?:{'|'.join(COMMANDS)})\b[^`]*)`")
VERSION = f"asperity, version {asperity.__version__}"
_FLAG = re.compile(r"`(--[a-z][a-z-]+)")


@pytest.fixture(scope="module")
def answers_script() -> ModuleType:
    """Return the module of the script that writes command outputs into README."""
    spec = importlib.util.spec_from_file_location("answers", ROOT / "docs" / "answers.py")
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


def test_outputs_in_readme_equal_those_of_the_commands(answers_script: ModuleType) -> None:
    commands = re.findall(r"^\$ \.venv/bin/asperity .*\n(?!\$|```)", README, re.M)
    assert commands == ["$ .venv/bin/asperity compare sinusoid:amplitude=0.4mm,period=1.5mm\n"]
    assert answers_script.update_page(README) == README, "python docs/answers.py writes them anew"


def _page(answer: str) -> str:
    return f"Words.\n```console\n$ make demo\n$ asperity --version\n{answer}\n```\n"


@pytest.mark.parametrize("wrong", ["asperity, version 0.1.9", f"{VERSION}\nmore"])
def test_wrong_output_is_replaced(answers_script: ModuleType, wrong: str) -> None:
    assert answers_script.update_page(_page(wrong)) == _page(VERSION)
    assert answers_script.update_page(_page(VERSION)) == _page(VERSION)


def test_omitted_part_of_an_output_is_not_compared(
    answers_script: ModuleType, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        answers_script, "capture_output", lambda _command: "one\ntwo\n\nthree 3\n\nfour"
    )
    for output in ("one\ntwo\n\n...", "one\ntwo\n\nthree 3\n\n...", "one\ntwo\n\nthree 3\n\nfour"):
        assert answers_script.update_page(_page(output)) == _page(output)
    assert answers_script.update_page(_page("one\n\nthree 4\n\n...")) == _page(
        "one\ntwo\n\nthree 3\n\n..."
    )


def test_failing_command_is_an_error(answers_script: ModuleType) -> None:
    with pytest.raises(RuntimeError, match="exit code 2"):
        answers_script.capture_output("asperity devices tuch")


def test_failed_assertion_in_a_block_stops_the_build(answers_script: ModuleType) -> None:
    """Statements of a page about an output are asserted below it, in {run} and {shell} blocks."""
    commands = sys.modules[answers_script.run_command.__module__]
    names: dict[str, object] = {}
    assert commands.execute("found = 0.61\nprint(found)\nfound", names) == ("0.61\n", 0.61)
    with pytest.raises(AssertionError):
        commands.execute("assert f'{found:.2f}' == '0.62'", names)
    with pytest.raises(RuntimeError, match="expected to be refused"):
        commands.execute("found", names, True)
    assert commands.first_paragraphs("a\n\nb\n\nc", 2) == "a\n\nb\n\n..."


def test_python_examples_of_readme_run() -> None:
    for block in re.findall(r"```python\n(.*?)```", README, re.S):
        exec(block, {})


def test_plugin_that_readme_names_is_in_the_repository() -> None:
    (file, law) = re.findall(r"--plugin (\S+) --laws C(\w)`", README)[0]
    assert f'letter="{law}"' in (ROOT / file).read_text("utf-8")


def _parse(command: str) -> None:
    """Parse a command as click does, without its values: files that a page names may not exist."""
    words = shlex.split(command.partition(" > ")[0], comments=True)
    # Without the settings of the group, click would cache a help option without "-h".
    group = click.Context(cli, **cli.context_settings)
    parsed_command = cli.get_command(group, words[0])
    assert parsed_command is not None, words[0]
    context = click.Context(parsed_command, parent=group)
    _values, _rest, parsed = parsed_command.make_parser(context).parse_args(words[1:])
    check_not_repeated(parsed)


@pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)
def test_commands_and_options_that_a_page_names_exist(page: Path) -> None:
    text = page.read_text("utf-8")
    for command in (*_CONSOLE_COMMAND.findall(text), *_INLINE_COMMAND.findall(text)):
        _parse(command)
    flags = {"--help", "--version"}
    for name in COMMANDS:
        group = cli.get_command(click.Context(cli), name)
        assert group is not None
        for command in (group, *getattr(group, "commands", {}).values()):
            flags |= {flag for option in command.params for flag in option.opts}
    assert set(_FLAG.findall(text)) - flags == set()


@pytest.mark.parametrize("command", ["compare cloth --devise touch", "conpare cloth"])
def test_unknown_command_or_option_is_detected(command: str) -> None:
    with pytest.raises((click.UsageError, AssertionError)):
        _parse(command)


def test_only_readme_contains_written_outputs() -> None:
    """On the other pages {shell} and {run} insert the outputs when the pages are built."""
    for page in PAGES[2:]:
        for block in re.findall(r"^```console\n(.*?)^```$", page.read_text("utf-8"), re.M | re.S):
            assert all(line.startswith("$ ") for line in block.splitlines()), page
        assert "```text" not in page.read_text("utf-8"), page
