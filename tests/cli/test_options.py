"""Options follow from the declared arguments; commands are imported on demand."""

from __future__ import annotations

import inspect
import io
import os
import re
import subprocess
import sys
import time
from pathlib import Path

import click
import pytest
from click.testing import CliRunner

import asperity as asp
from asperity.analysis.limits.limit_rules import DEFAULT_SAMPLES, DEFAULT_SPEED
from asperity.analysis.results.compare import DEFAULT_DEVICE
from asperity.cli import analysis_commands as analyze
from asperity.cli import analysis_commands as compare
from asperity.cli import analysis_commands as limits
from asperity.cli import simulation_commands as onset
from asperity.cli.main import COMMANDS, GROUPS, cli
from asperity.cli.options import LAW_OPTIONS, SPEED, option_help
from asperity.cli.output import progress_bar, step_bar
from asperity.core.arguments import MAX_DEPTH, Argument
from asperity.core.processes import PROGRESS_CALLBACKS, Part, report_fraction, report_part
from asperity.core.units import format_quantity
from asperity.lab.scene_state import START_LAW, START_STIFFNESS
from asperity.laws import LAWS
from asperity.laws.friction import FRICTION_ARGUMENTS
from asperity.measured.file_arguments import FILE_ARGUMENTS

READ_A_SURFACE = ["analyze", "compare", "limits", "onset", "scan", "simulate"]


@pytest.mark.parametrize("command", READ_A_SURFACE)
def test_every_declared_argument_is_an_option_with_its_help(command: str) -> None:
    result = CliRunner().invoke(cli, [command, "--help-surface"], env={"COLUMNS": "100"})
    assert result.exit_code == 0
    text = " ".join(result.output.split())
    depths = [compare._MAX_DEPTHS] if command == "compare" else [MAX_DEPTH]  # several there
    for argument in (*depths, *LAW_OPTIONS[2:], *FILE_ARGUMENTS):
        assert f"--{argument.name.replace('_', '-')} " in text
        # Lines are broken at hyphens, too.
        assert "".join(option_help(argument).split()) in text.replace(" ", "")
    for option in ("--set", "--plugin, --law-module", "--device"):
        assert f"{option} " in text
    assert ("--stiffness " in text) is (command != "onset")  # which finds it
    assert ("--law " in text) is (command not in {"compare", "onset", "scan"})  # several there


def test_every_parameter_of_a_shipped_law_is_an_option() -> None:
    declared = {name for law in LAWS.values() for name in law.arguments}
    declared |= FRICTION_ARGUMENTS.keys()
    assert {argument.name for argument in LAW_OPTIONS} == declared | {
        "stiffness",
        "max_depth",
        "rendering",
    }


def test_default_values_in_help_equal_those_of_the_functions() -> None:
    for command, function in ((limits, asp.limits), (onset, asp.onset), (analyze, asp.analyze)):
        parameters = inspect.signature(function).parameters
        options = [item for item in vars(command).values() if isinstance(item, tuple) and item]
        arguments = [item for group in options for item in group if isinstance(item, Argument)]
        assert arguments
        for argument in arguments:
            name = argument.keyword or argument.name
            default = parameters[name].default if name in parameters else None
            if argument.default is not None and default is not None:
                assert argument.default == default, argument.name
    assert {item.default for item in limits._SAMPLING} == {DEFAULT_SAMPLES}
    assert SPEED.default_description == f"{DEFAULT_SPEED:g} m/s"


def test_help_of_all_commands_in_one_process_imports_no_heavy_package() -> None:
    code = (
        "import sys\n"
        "from click.testing import CliRunner\n"
        "from asperity.cli.main import COMMANDS, cli\n"
        "for name in COMMANDS:\n"
        "    said = CliRunner().invoke(cli, [name, '--help'])\n"
        "    assert said.exit_code == 0 and said.output.startswith(f'Usage: cli {name}'), name\n"
        "heavy = {'scipy', 'sympy', 'numba', 'matplotlib', 'pint', 'rich', 'jinja2'}\n"
        "sys.exit(str(sorted(heavy & set(sys.modules))) if heavy & set(sys.modules) else 0)"
    )
    process = subprocess.run(
        [sys.executable, "-c", code], capture_output=True, text=True, check=False, env=os.environ
    )
    assert process.returncode == 0, process.stderr


def test_help_lists_every_command_with_its_summary_by_group() -> None:
    text = CliRunner().invoke(cli, ["--help"], env={"COLUMNS": "100"}).output
    for name, (_module, summary, _example) in COMMANDS.items():
        assert f"  {name} " in text
        assert summary in text
    titles = [line[:-1] for line in text.splitlines() if line and not line.startswith(" ")]
    assert [one for one in titles if one in GROUPS] == list(GROUPS)
    assert text.index("Answer:") < text.index("  compare ") < text.index("Surface:")
    for command in ("compare", "recording"):
        short = CliRunner().invoke(cli, [command, "-h"])
        assert (short.exit_code, short.output.split()[2]) == (0, command)


@pytest.mark.parametrize("name", COMMANDS)
def test_help_has_headings_an_example_and_every_option(name: str) -> None:
    """The rarer options of a measured file are shown by ``--help-surface`` alone."""
    command = cli.get_command(click.Context(cli), name)
    assert command is not None
    if isinstance(command, click.Group):
        return
    short = CliRunner().invoke(cli, [name, "--help"], env={"COLUMNS": "100"}).output
    full, takes_files = short, any(one.name == "tip_radius" for one in command.params)
    if takes_files:
        full = CliRunner().invoke(cli, [name, "--help-surface"], env={"COLUMNS": "100"}).output
        assert "--l-cutoff" not in short
        for flag in ("--pitch", "--unit", "--height-range", "--tip-radius", "--green"):
            assert f"  {flag} " in short.split("Measured surface:\n")[1]
    for option in command.params:
        if isinstance(option, click.Option) and not option.hidden:
            assert f"{max(option.opts, key=len)}" in full
    if {"json_path", "output"} & {str(one.name) for one in command.params}:
        assert "\nOutput:\n" in short
    example = short.split("Example:\n")[1].split()
    assert example[:2] == ["asperity", name]
    _, rest, _ = command.make_parser(click.Context(command)).parse_args(example[2:])
    assert len(rest) <= len([one for one in command.params if isinstance(one, click.Argument)]) + 1


def test_metavar_of_an_option_with_choices_names_them() -> None:
    text = CliRunner().invoke(cli, ["compare", "--help"]).output
    assert "--rendering field|search" in text


class _Terminal(io.StringIO):
    def isatty(self) -> bool:
        return True


def test_progress_is_shown_only_on_a_terminal(monkeypatch: pytest.MonkeyPatch) -> None:
    for stream, is_terminal in ((_Terminal(), True), (io.StringIO(), False)):
        monkeypatch.setattr(sys, "stderr", stream)
        with step_bar("reading", 2) as step:
            step("first part")
            step("second part")
            time.sleep(1.1)
        with progress_bar("stroking") as report:
            report(0.5)
            report(1.0, "writing")
        assert ("stroking" in stream.getvalue()) == is_terminal
        assert ("left:" in stream.getvalue()) == is_terminal
        assert ("second part (2 of 2)" in stream.getvalue()) == is_terminal
        assert ("1 s" in stream.getvalue()) == is_terminal  # where nothing else changes


def test_progress_has_no_percentage_before_a_part_is_done(monkeypatch: pytest.MonkeyPatch) -> None:
    """A bar that stands at 0 % tells nothing; a field that is baked has a bar of its own."""
    stream = _Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("COLUMNS", "120")
    with step_bar("reading", 2) as step:
        step("law H")
        time.sleep(0.3)
        first = stream.getvalue()
        for fraction in (0.25, 0.75):
            report_fraction(fraction)
            time.sleep(0.3)
        baking = stream.getvalue()[len(first) :]
        step("law W")
        time.sleep(0.3)
        report_part(Part.LEAK)
        time.sleep(0.3)
    assert "law H (1 of 2)" in first
    assert "%" not in first
    assert "law H (1 of 2): baking" in baking
    assert "75%" in baking
    assert re.search(r"law W \(2 of 2\) .*50%", stream.getvalue())
    assert re.search(r"law W \(2 of 2\): leak .*83%", stream.getvalue())
    assert PROGRESS_CALLBACKS == []


@pytest.mark.parametrize("is_cached", [False, True])
def test_progress_reports_compilation_only_when_code_is_not_cached(
    is_cached: bool, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Loops in the cache are not compiled."""
    from asperity.core.compiled import COMPILE_CALLBACKS
    from asperity.kernels.fuse import _HEADER, _load_module, load_fused

    loops = (
        "@loop\ndef first(x):\n    return x + 1.0\n\n\n@loop\ndef other(x):\n    return 2.0 * x\n"
    )
    source = _HEADER.format(title="Two loops.") + loops
    stream = _Terminal()
    monkeypatch.setattr(sys, "stderr", stream)
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path))
    _load_module.cache_clear()
    if is_cached:
        assert load_fused(source).first(1.0) + load_fused(source).other(1.0) == 4.0
    _load_module.cache_clear()
    with progress_bar("comparing") as report:
        assert (load_fused(source).first(1.0), load_fused(source).other(1.0)) == (2.0, 2.0)
        assert len(COMPILE_CALLBACKS) == 1
        output = stream.getvalue()
        report(0.5)
    assert ("comparing: compiling, on a first run only" in output) != is_cached
    assert is_cached or "comparing  " in output.rpartition("first run only")[2]
    assert COMPILE_CALLBACKS == []


@pytest.mark.parametrize("command", [*READ_A_SURFACE, "run", "export", "lab"])
def test_default_device_is_the_same_everywhere(command: str) -> None:
    result = CliRunner().invoke(cli, [command, "--help"], env={"COLUMNS": "200"})
    (words,) = re.findall(
        r"--device ID\|FILE(.*?default:[^\]]*)\]", " ".join(result.output.split())
    )
    assert words.endswith(DEFAULT_DEVICE)


def test_help_of_the_lab_states_its_initial_scene() -> None:
    result = CliRunner().invoke(cli, ["lab", "--help"], env={"COLUMNS": "200"})
    text = " ".join(result.output.split())
    assert f"else the recommended law, or {START_LAW} if there is none" in text
    start = format_quantity(START_STIFFNESS, "N/m")
    assert f"else the recommended stiffness, or {start} if there is none" in text
