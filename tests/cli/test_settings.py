"""``--set``, repeated options, and surface names without a colon."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path

import click
import pytest

from asperity.cli.main import COMMANDS, check_not_repeated, cli

Call = Callable[..., tuple[int, str, str]]
SPEC = "sinusoid:amplitude=0.2mm,period=2mm"


def test_set_changes_fields_of_the_device(call: Call) -> None:
    options = ["--device", "touch", "--set", "max_stiffness=1.5N/mm", "--set", "delay-samples=3"]
    code, out, err = call("compare", SPEC, "--laws", "W", *options, "--json", "-")
    assert (code, err) == (0, "")
    device = json.loads(out)["device"]
    assert device["id"] == "touch"
    assert device["data"]["max_stiffness"]["value"] == 1500.0
    assert device["data"]["max_stiffness"]["source"] == "given by the user"
    assert device["data"]["delay_samples"]["value"] == 3.0
    assert device["data"]["max_force"]["value"] == 3.3  # of the catalogue


def test_set_applies_to_the_default_device_and_to_that_of_a_scene(
    call: Call, tmp_path: Path
) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text('[texture]\nkind = "tile"\n[device]\nid = "touch"\nmax_force = "2 N"\n')
    for source, device, force in ((SPEC, "omega.3", 12.0), (str(scene), "touch", 2.0)):
        options = ["--law", "W", "--set", "update_rate=2kHz", "--json", "-"]
        result = json.loads(call("limits", source, *options)[1])["device"]
        assert result["id"] == device
        assert result["data"]["update_rate"]["value"] == 2000.0
        assert result["data"]["max_force"]["value"] == force


def test_set_prefers_the_law_for_a_name_shared_with_the_device(call: Call) -> None:
    options = [
        "--law",
        "F",
        "--set",
        "friction=0.5",
        "--set",
        "device.friction=80mN",
        "--json",
        "-",
    ]
    result = json.loads(call("analyze", SPEC, *options)[1])
    assert result["law_parameters"]["friction"] == 0.5
    assert result["device"]["data"]["friction"]["value"] == 0.08


WRONG = [
    (["--set", "max_stiffness=1500"], "device.max_stiffness needs a unit: write 1500N/m"),
    (["--set", "max_stifness=1N/m"], "did you mean 'max_stiffness'"),
    (["--set", "hand.friction=1N"], "set names 'hand.friction', which is a parameter of no law"),
    (["--set", "device.continuity=1"], "set names 'continuity'"),
    (["--set", "max_stiffness"], "must be NAME=VALUE"),
    (
        ["--set", "max_force=1N", "--set", "device.max_force=2N"],
        "set is given twice for max_force: 'max_force=1N' and 'device.max_force=2N'",
    ),
    (
        ["--set", "continuity=1", "--set", "continuity=2"],
        "set is given twice for continuity: 'continuity=1' and 'continuity=2'",
    ),
    (["--friction", "1", "--set", "friction=2"], "given twice: by --friction and by --set"),
    (["--device", "touch", "--set", "continuous_force=9N"], "not be greater than max_force, 3.3 N"),
    (["--stiffness", "500"], "stiffness needs a unit: write 500N/m, got '500'"),
    (["--max-depth", "1"], "max_depth needs a unit: write 1mm or 1um or 1m"),
    (["--stiffness", "1N/m", "--stiffness=2N/m"], "stiffness is given twice: give --"),
    (["--law", "F", "--law", "F"], "law is given twice"),
    (["--json", "-", "--json", "-"], "json is given twice"),
]


@pytest.mark.parametrize(("options", "message"), WRONG, ids=lambda value: " ".join(value)[:50])
def test_contradictory_options_give_a_one_line_error(
    call: Call, options: list[str], message: str
) -> None:
    law = [] if "--law" in options else ["--law", "F"]
    code, out, err = call("analyze", SPEC, *law, *options)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert message in err


def test_repeated_option_is_refused_unless_it_may_be_repeated() -> None:
    """Every option of every command is checked."""
    context = click.Context(cli)
    checked = 0
    for name in COMMANDS:
        command = cli.get_command(context, name)
        assert command is not None

        def check(arguments: list[str], command: click.Command = command) -> None:
            parser = command.make_parser(click.Context(command, parent=context))
            check_not_repeated(parser.parse_args(arguments)[2])

        for option in command.params:
            if not isinstance(option, click.Option):
                continue
            repeated = [option.opts[-1], "1"][: 1 if option.is_flag else 2] * 2
            if option.multiple:
                check(repeated)
                continue
            with pytest.raises(ValueError, match="is given twice"):
                check(repeated)
            check(repeated[: len(repeated) // 2])
            checked += 1
    assert checked > 100


def test_error_for_a_repeated_list_option_shows_how_to_write_it(call: Call) -> None:
    _code, _out, err = call("scan", "x.toml", "--speeds", "1m/s", "--speeds", "2m/s")
    assert "give --speeds once; several values are one text, 'a; b'" in err


def test_surface_name_needs_no_colon_and_files_come_first(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    without_colon, with_colon = (
        call("limits", source, "--law", "W", "--json", "-")[1] for source in ("Knurl", "knurl:")
    )
    assert without_colon == with_colon != ""
    (tmp_path / "knurl").write_text("no heights")  # a file comes first
    code, _out, err = call("limits", "knurl", "--law", "W")
    assert code == 2
    assert "no row of numbers" in err


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("sandpapr", "neither a file nor a named surface: 'sandpapr'; did you mean"),
        ("file", "neither a file nor a named surface"),
        ("sinusoid", "amplitude is missing: a sinusoid needs amplitude, period"),
    ],
)
def test_unknown_surface_names_give_a_one_line_error(call: Call, name: str, words: str) -> None:
    code, _out, err = call("limits", name)
    assert (code, err.count("\n")) == (2, 1)
    assert words in err
