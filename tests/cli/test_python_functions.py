"""Python functions that do what a command does, and the tables of results."""

from __future__ import annotations

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
from tests.cli.conftest import Call

import asperity as asp
from asperity.core.errors import ParameterError

ROOT = Path(__file__).parents[2]
STROKE, PRESS = (str(ROOT / "examples" / name) for name in ("stroke.toml", "press.toml"))


def read_json(path: Path) -> Any:
    return json.loads(path.read_text("utf-8"))


def as_json(result: Any) -> Any:
    return json.loads(json.dumps(result.to_dict()))


def test_simulate_is_the_command(call: Call, tmp_path: Path) -> None:
    output = tmp_path / "run.json"
    options = ("--law", "C", "--duration", "50ms", "--json", str(output))
    assert call("simulate", STROKE, *options)[0] == 0
    run = asp.simulate(STROKE, law="C", duration=0.05)
    assert read_json(output)["run"] == as_json(run)
    other = asp.simulate(STROKE, law="A", duration=0.05)
    assert other.ledger.total != run.ledger.total


def test_onset_is_the_command(call: Call, tmp_path: Path) -> None:
    output = tmp_path / "onset.json"
    options = ("--laws", "WC", "--delays", "1", "--starts", "2", "--json", str(output))
    assert call("onset", PRESS, *options)[0] == 0
    result = asp.onset(PRESS, "WC", [1], n_phases=2)
    assert read_json(output) == as_json(result)
    rows = result.table_rows()
    assert [row["law"] for row in rows] == ["W", "C"]
    assert rows[1]["cycling [N/m]"] == result.onsets[1].onset.cycling
    assert result.to_html().startswith("<!DOCTYPE html>")


def test_scan_is_the_command(call: Call, tmp_path: Path) -> None:
    output = tmp_path / "scan.json"
    options = ("--speeds", "0.1m/s", "--strokes", "3", "--json", str(output))
    assert call("scan", STROKE, "--laws", "A", *options)[0] == 0
    result = asp.scan(STROKE, "A", speeds=[0.1], strokes=3)
    assert read_json(output) == as_json(result)
    assert result.table_rows()[0]["gains energy"]
    assert "Energy per stroke" in result.to_html()


def test_tables_name_units() -> None:
    pandas = pytest.importorskip("pandas", reason="not run: no pandas here")
    result = asp.compare("sinusoid:amplitude=0.8mm,period=1mm", laws="WA")
    frame = result.to_dataframe()
    assert isinstance(frame, pandas.DataFrame)
    assert list(frame["law"]) == ["W", "A"]
    limit = result["A"].stability_limit.stiffness
    assert frame["stability limit [N/m]"][1] == limit
    several = asp.compare_devices("sinusoid:amplitude=0.1mm,period=1mm", ["touch", "omega.3"])
    assert list(several.to_dataframe()["device"].unique()) == ["touch", "omega.3"]


@pytest.mark.parametrize(
    ("mistake", "words"),
    [
        (lambda: asp.compare("cloth", devices="touch"), "devices is unknown; did you mean"),
        (lambda: asp.compare("cloth", law="C"), "law is unknown; did you mean 'laws'"),
        (lambda: asp.limits("cloth", stifness=3.0), "stifness is unknown; did you mean"),
        (lambda: asp.analyze("cloth", depth=1e-4), "depth is unknown; did you mean 'max_depth'"),
        (lambda: asp.onset(PRESS, starts=3), "starts is unknown"),
        (lambda: asp.scan(STROKE, speed=[0.1]), "speed is unknown; did you mean 'speeds'"),
        (lambda: asp.simulate(STROKE, lw="C"), "lw"),
        (lambda: asp.simulate("cloth", law="C"), r"needs a section \[hand\]"),
        (lambda: asp.replay("missing.mcap"), "missing.mcap"),
    ],
)
def test_mistakes_are_named(mistake: Callable[[], Any], words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        mistake()
