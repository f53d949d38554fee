"""Output, files and errors of ``asperity envelope`` and ``asperity design``."""

from __future__ import annotations

import csv
import json
import shlex
from pathlib import Path

import pytest
from tests.cli.conftest import Call

import asperity as asp

ENVELOPE = ("envelope", "--device", "touch,pantograph", "--laws", "CH")


def test_envelope_writes_what_python_returns(call: Call, tmp_path: Path) -> None:
    names = ("borders.csv", "picture.svg", "picture.pdf", "report.html", "data.json")
    paths = [str(tmp_path / name) for name in names]
    files = ("-o", paths[0], "-o", paths[1], "-o", paths[2], "--html", paths[3], "--json", paths[4])
    code, out, err = call(*ENVELOPE, "--speed", "0.2m/s", "--jobs", "1", *files, width=80)
    assert (code, err) == (0, "")
    assert "3D Systems Touch renders most with law H" in out
    assert max(map(len, out.splitlines())) <= 80 + len(str(tmp_path))
    assert "…" not in out
    result = asp.envelope(["touch", "pantograph"], "CH", speed=0.2)
    with open(paths[0], encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert [row["law"] for row in rows] == [row["law"] for row in result.table_rows()]
    for row, expected in zip(rows, result.table_rows(), strict=True):
        value = expected["rendered from amplitude [m]"]
        assert row["rendered from amplitude [m]"] == ("" if value is None else repr(value))
    assert json.loads(Path(paths[4]).read_text("utf-8")) == json.loads(json.dumps(result.to_dict()))
    assert Path(paths[1]).read_text("utf-8").startswith("<?xml")
    assert Path(paths[2]).read_bytes().startswith(b"%PDF")
    assert "Which sinusoids are rendered" in Path(paths[3]).read_text("utf-8")


WAVE = "sinusoid:period=2mm,amplitude=0.1mm"
DESIGN_H = ("design", WAVE, "--device", "touch", "--laws", "H")
DESIGN = (*DESIGN_H[:-1], "C")


def test_design_writes_what_python_returns(call: Call, tmp_path: Path) -> None:
    paths = [str(tmp_path / name) for name in ("data.json", "report.html")]
    files = ("--json", paths[0], "--html", paths[1])
    code, out, err = call(*DESIGN, "--texture-force", "5mN", *files, width=80)
    assert (code, err) == (0, "")
    unwrapped = ("Report: ", "  asperity ")
    assert max(len(line) for line in out.splitlines() if not line.startswith(unwrapped)) <= 80
    assert "…" not in out
    result = asp.design(WAVE, "touch", "C", texture_force=5e-3)
    data = json.loads(Path(paths[0]).read_text("utf-8"))
    assert data == json.loads(json.dumps(result.to_dict()))
    assert data["is_feasible"] is True
    assert "Margins: by which factor" in Path(paths[1]).read_text("utf-8")


def test_design_ends_with_the_command_that_exports_it(call: Call, tmp_path: Path) -> None:
    """The command describes the surface whose numbers were printed, also magnified before."""
    magnified = ("--magnify-height", "2", "--texture-force", "20mN")
    code, out, _ = call(*DESIGN, *magnified, "--json", str(tmp_path / "design.json"))
    assert code == 0
    command = out.rstrip().splitlines()[-1]
    assert command.startswith(f"  asperity export {WAVE} --law C --stiffness ")
    assert "Asked for: at least 20 mN RMS at the motor." in " ".join(out.split())
    assert "What will go wrong" not in out
    _, _, surface, *options, _o, _header = shlex.split(command)
    options[0] = "--laws"
    code, out, err = call("compare", surface, *options, "--json", "-")
    assert (code, err) == (0, "")
    row = json.loads(out)["laws"][0]
    expected = json.loads((tmp_path / "design.json").read_text("utf-8"))["comparison"]["laws"][0]
    assert row["q"] == expected["q"]
    assert 0.99 * expected["stiffness"] <= row["stiffness"] <= expected["stiffness"]


def test_design_of_a_scene_magnifies_what_it_states(call: Call, tmp_path: Path) -> None:
    scene = tmp_path / "scene.toml"
    scene.write_text(
        '[texture]\nkind = "sinusoid"\namplitude = "0.05 mm"\nperiod = "1 mm"\nmagnify = 2\n'
        '[device]\nid = "touch"\n'
    )
    code, out, err = call("design", str(scene), "--laws", "C", "--texture-force", "20mN")
    assert (code, err) == (0, "")
    _, direct, _ = call(*DESIGN, "--texture-force", "20mN")
    height = float(direct.rpartition("--magnify-height ")[2].split()[0])
    assert f"--magnify-height {2 * height:.10g} -o" in out


def test_design_beyond_reach_is_an_answer(call: Call) -> None:
    code, out, err = call(*DESIGN, "--texture-force=1N")
    assert (code, err) == (0, "")
    assert (
        "Not met. 4.96 % of 1 N RMS at the motor can be reached; stability limits it."
        in " ".join(out.split())
    )


@pytest.mark.parametrize(
    ("options", "words"),
    [
        (("--peak-force", "15mN"), "20 mN RMS of texture, 25 mN peak at the motor, felt."),
        (("--texture-force", "5mN", "--at", "hand"), "RMS of texture, 6.1 mN RMS at the hand,"),
        (
            ("--peak-force", "1N"),
            "Not met. 6.95 % of 1 N peak at the motor can be reached; stability",
        ),
        (
            ("--texture-force", "10mN", "--min-support", "0.9"),
            "RMS of texture, support 0.98, felt.",
        ),
    ],
)
def test_design_states_what_the_target_is_about(
    call: Call, options: tuple[str, ...], words: str
) -> None:
    code, out, err = call(*DESIGN, *options)
    assert (code, err) == (0, "")
    assert words in " ".join(out.split())


def test_design_tries_several_values_of_a_parameter(call: Call) -> None:
    values = ("--texture-force=0.1N", "--at=hand", "--speed=20mm/s", "--continuity=1,1.5")
    surface = ("sinusoid:period=1mm,amplitude=0.2mm", "--device=omega.3", "--laws=H")
    code, out, err = call("design", *surface, *values)
    assert (code, err) == (0, "")
    assert "Given continuity 1.5 for law H" in out
    assert "--continuity 1.5" in out.split("\nNext:\n")[1]


@pytest.mark.parametrize(
    "surface", [(WAVE,), ("grating:height=40um,period=2mm", "--magnify", "1.5")]
)
def test_design_ends_with_commands_of_its_result(call: Call, surface: tuple[str, ...]) -> None:
    """The last one is run: size, law and stiffness are those of the design."""
    code, out, _err = call("design", *surface, "--device=touch", "--laws=C", "--json=-")
    assert code == 0
    found = json.loads(out)
    _code, out, _err = call("design", *surface, "--device=touch", "--laws=C")
    lines = out.split("\nNext:\n")[1].splitlines()
    assert [shlex.split(line)[1] for line in lines] == ["lab", "run", "export"]
    arguments = shlex.split(lines[2])[2:-2]
    code, out, _err = call("analyze", *arguments, "--json=-")
    assert code == 0
    again = json.loads(out)
    (row,) = found["comparison"]["laws"]
    assert ("magnified 8.4351 times" in str(again["texture"])) == ("--magnify" in surface)
    found["comparison"]["texture"].pop("preparation", None)  # in two steps, and in one
    for name, value in found["comparison"]["texture"].items():
        expected = pytest.approx(value, rel=1e-6) if isinstance(value, float) else value
        assert again["texture"][name] == expected
    assert again["stiffness"] == pytest.approx(row["stiffness"], rel=5e-3)
    assert again["law"] == "C"


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (("envelope", "--device", "nope"), "device is unknown"),
        (("envelope", "-o", "borders.txt"), "output must end in .csv"),
        (("envelope", "-o", "a.csv", "-o", "a.csv"), "cannot both"),
        (("envelope", "--min-stiffness", "0N/m"), "min_stiffness must be positive"),
        (("envelope", "--laws", "C", "--friction", "0.5"), "friction"),
        (("envelope", "--surface", "nix.x3p"), "nix.x3p"),
        ((*DESIGN, "--at", "elbow"), "at must be motor or hand"),
        ((*DESIGN, "--texture-force", "3kg"), "texture_force must be a quantity"),
        ((*DESIGN, "--texture-force", "0mN"), "texture_force must be positive"),
        ((*DESIGN, "--peak-force", "3kg"), "peak_force must be a quantity"),
        ((*DESIGN, "--peak-force", "3mN", "--at", "hand"), "peak_force is at the motor"),
        ((*DESIGN, "--min-support", "30"), "min_support must be in [0, 1]"),
        ((*DESIGN_H, "--continuity=1,x"), "continuity must be"),
        (("design", WAVE, "--device", "touch,omega.3"), "single device"),
        (("design", "nix"), "surface is neither"),
    ],
)
def test_bad_input_is_one_line(
    call: Call,
    arguments: tuple[str, ...],
    words: str,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = call(*arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert words in err
    assert list(tmp_path.iterdir()) == []
