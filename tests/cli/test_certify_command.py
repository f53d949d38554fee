"""The command certify: libraries, witnesses, baselines, recordings."""

from __future__ import annotations

import json
import sys
from pathlib import Path

import numpy as np
import pytest
from click.testing import CliRunner

from asperity.cli.main import cli

WALL = """
import numpy as np
def force(points):
    x, y, z = points.T
    depth = {stiffness} * np.maximum(-z, 0.0)
    return np.column_stack([{curl} * np.sin(3e3 * x) * depth, 0.0 * x, depth])
"""
REGION = "-1mm:1mm,-1mm:1mm,-1mm:0.1mm"


def run(*arguments: str) -> tuple[int, str]:
    result = CliRunner().invoke(cli, ["certify", *arguments])
    if result.exception is not None and not isinstance(result.exception, SystemExit):
        return result.exit_code, f"{result.output}{result.exception!r}"
    return result.exit_code, result.output


def write_wall(path: Path, stiffness: float = 1000.0, curl: float = 0.0) -> str:
    path.write_text(WALL.format(stiffness=stiffness, curl=curl))
    return f"{path}:force"


@pytest.mark.starts_readers
def test_result_has_the_documented_keys(tmp_path: Path) -> None:
    wall = write_wall(tmp_path / "wall.py")
    output = tmp_path / "result.json"
    page = tmp_path / "page.html"
    code, text = run(
        wall, "--region", REGION, "--seconds", "1s", "--json", str(output), "--html", str(page),
        "--device", "touch",
    )  # fmt: skip
    assert code == 0, text
    data = json.loads(output.read_text())
    expected = (
        "gain one_sided_gain worst_loop jumps history_spread largest_force calls seconds cost"
    )
    assert set(expected.split()) <= data.keys()
    assert data["gain"] == pytest.approx(1000.0, rel=1e-6)
    assert data["worst_loop"] is None
    assert "no closed path was found" in text.replace("\n", "")
    assert "proved" in page.read_text()


def test_witnesses_are_replayed(tmp_path: Path) -> None:
    wall = write_wall(tmp_path / "wall.py", curl=0.1)
    witness = tmp_path / "witness.csv"
    code, text = run(wall, "--region", REGION, "--seconds", "1s", "--witness", str(witness))
    assert code == 0, text
    code, text = run(wall, "--replay", str(witness), "--json", "-")
    assert code == 0, text
    rows = {row["witness"]: row for row in json.loads(text)["witnesses"]}
    assert rows["loop"]["replayed"] == rows["loop"]["recorded"] > 0.0
    assert rows["gain"]["replayed"] == pytest.approx(rows["gain"]["recorded"], rel=1e-12)


def test_baseline_tells_a_change(tmp_path: Path) -> None:
    """Of a wall without a leak, which a longer search would find greater."""
    wall = write_wall(tmp_path / "wall.py")
    baseline = tmp_path / "forces.json"
    common = ("--region", REGION, "--seconds", "1s", "--baseline", str(baseline))
    for _ in range(2):
        code, text = run(wall, *common)
        assert code == 0, text
    changed = write_wall(tmp_path / "changed.py", 1001.0)
    code, text = run(changed, *common)
    assert code == 1
    assert "the force was" in text.replace("\n", " ")
    leaking = write_wall(tmp_path / "leaking.py", curl=1e-3)
    code, text = run(leaking, *common, "--tolerance", "1N")
    assert code == 1
    assert "leak" in text
    baseline.write_text("{")
    _code, text = run(wall, *common)
    assert "forces.json is no file of results: Expecting property name" in text


def test_program_on_a_pipe_is_searched(tmp_path: Path) -> None:
    program = tmp_path / "program.py"
    program.write_text(
        "import sys\n"
        "for line in sys.stdin:\n"
        "    if line.startswith('reset'):\n"
        "        continue\n"
        "    z = float(line.split()[2])\n"
        "    print(0, 0, -700 * min(z, 0.0), flush=True)\n"
    )
    command = f"{sys.executable} {program}"
    code, text = run("--pipe", command, "--region", REGION, "--seconds", "1s", "--json", "-")
    assert code == 0, text
    assert json.loads(text)["gain"] == pytest.approx(700.0, rel=1e-6)


def test_two_recordings_are_compared(tmp_path: Path) -> None:
    paths = []
    for lag in (0, 2):
        heights = -1e-3 + 3e-4 * np.sin(0.1 * np.arange(500))
        force = 1000.0 * np.maximum(-np.roll(heights, lag), 0.0)
        zeros = np.zeros(500)
        columns = (1e-3 * np.arange(500), zeros, zeros, heights, zeros, zeros, force)
        path = tmp_path / f"run{lag}.csv"
        header = "t [s],x [m],y [m],z [m],fx [N],fy [N],fz [N]"
        np.savetxt(path, np.column_stack(columns), delimiter=",", header=header, comments="")
        paths.append(str(path))
    page = tmp_path / "runs.html"
    code, text = run(*paths, "--html", str(page))
    assert code == 0, text
    assert "run0.csv" in text
    assert "run2.csv" in text
    assert "energy to the hand" in page.read_text()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ([], "renderer must be one"),
        (["a.so", "b.so"], "renderer must be one"),
        (["missing.so"], "is no file"),
        (["missing.csv"], "cannot be read"),
        (["--pipe", "no-such-program-here"], "cannot be started"),
    ],
)
def test_bad_input_has_exit_code_2(arguments: list[str], message: str) -> None:
    result = CliRunner().invoke(cli, ["certify", *arguments])
    text = result.output + str(result.exception)
    assert message in text
