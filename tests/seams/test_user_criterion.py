"""A user-defined criterion appears in every analysis and does not change the verdict."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from fractions import Fraction
from pathlib import Path
from types import ModuleType
from typing import Any

import pytest
from tests.helpers.pages import page_example

import asperity as asp
from asperity.analysis.passivity.criteria import CRITERIA, LEAK, Criterion, register_criterion
from asperity.core.errors import ParameterError
from asperity.core.units import round_down
from asperity.devices import parse_device
from asperity.report import html_text

Call = Callable[..., tuple[int, str, str]]

MODULE = page_example("howto/extend.md", "A passivity criterion")
RIG = {"damping": "2 N*s/m", "update_rate": "4 kHz", "delay_samples": 0, "max_force": "0.5 N"}
SURFACE = asp.Surface(asp.Sinusoid(amplitude=0.1e-3, period=2e-3), "C", 1500.0)
NAMES = ("half the loss", "clipping")


@pytest.fixture
def criteria() -> Iterator[None]:
    """Register the criteria of a user-defined module during a test."""
    exec(compile(MODULE, "own", "exec"), ModuleType("own").__dict__)
    yield
    for name in NAMES:
        del CRITERIA[name]


@pytest.mark.usefixtures("criteria")
def test_it_is_evaluated_and_reported() -> None:
    result = asp.analyze(SURFACE, parse_device(RIG, "mine"))
    half, clips = (result.passivity.criterion(name) for name in NAMES)
    limit = Fraction(4000) / Fraction(result.one_sided.upper)  # 2 · 4000 / 2 over q⁺
    assert half.limit == pytest.approx(float(limit), rel=1e-15)
    assert half.limit <= limit
    assert half.conclusion == f"holds: the limit is {round_down(half.limit):.10g} N/m"
    assert half.assumptions.startswith("the amplifier is linear; no deeper than 200 µm; ")
    assert (clips.holds, clips.conclusion) == (True, "holds: the limit is 2500 N/m")
    assert clips.assumptions == "static; no deeper than 200 µm; max_force 500 mN (not verified)"
    rows = result.to_dict()["passivity"]["criteria"]
    assert [row["name"] for row in rows][-2:] == list(NAMES)
    assert set(rows[-1]) == set(rows[0])
    json.dumps(rows, allow_nan=False)
    page = html_text(result)
    for text in (*NAMES, clips.conclusion, "the amplifier is linear"):
        assert text in page


@pytest.mark.usefixtures("criteria")
def test_missing_device_data_are_listed() -> None:
    device = parse_device({"max_stiffness": "2 N/mm"}, "bare")
    passivity = asp.analyze(SURFACE, device).passivity
    half, clips = (passivity.criterion(name) for name in NAMES)
    assert half.conclusion == "not decidable: needs update_rate, damping"
    assert (half.holds, half.limit, clips.missing) == (None, None, ("max_force",))
    assert clips.conclusion == "not decidable: needs max_force"
    stiff = asp.analyze(SURFACE.to_stiffness(1e4), parse_device(RIG, "mine")).passivity
    assert stiff.criterion("clipping").conclusion == "does not hold: the limit is 2500 N/m"


def test_it_does_not_change_the_verdict(monkeypatch: pytest.MonkeyPatch) -> None:
    """Even a criterion with the name of the leak criterion does not."""
    device = parse_device(RIG, "mine")
    before = asp.analyze(SURFACE, device).passivity

    def imitation(_loop: Any) -> Criterion:
        return Criterion(LEAK, "nothing is allowed", holds=False, limit=0.0, margin=0.0)

    monkeypatch.setitem(CRITERIA, "liar", imitation)
    after = asp.analyze(SURFACE, device).passivity
    assert after.criteria[:-1] == before.criteria
    assert after.criteria[-1].name == "liar"
    for name in ("verdict", "decided_by", "reason", "stability_limit"):
        assert getattr(after, name) == getattr(before, name)


def test_registering_an_existing_name_is_refused() -> None:
    with pytest.raises(ParameterError, match="name is the name of another criterion"):
        register_criterion(LEAK, lambda _loop: Criterion("mine", "0 < 1", holds=True))


def test_command_line_loads_it_as_a_plugin(call: Call, tmp_path: Path) -> None:
    module, page = tmp_path / "own.py", tmp_path / "page.html"
    module.write_text(MODULE, encoding="utf-8")
    arguments = (
        "analyze",
        "sinusoid:amplitude=0.1mm,period=2mm",
        "--law",
        "C",
        "--device",
        "touch",
    )
    outputs = ("--plugin", str(module), "--html", str(page))
    code, out, err = call(*arguments, *outputs)
    assert (code, err) == (0, "")
    for name in NAMES:
        assert name in out
        assert name in page.read_text("utf-8")
    code, out, _err = call(*arguments, "--plugin", str(module), "--json", "-")
    names = [criterion["name"] for criterion in json.loads(out)["passivity"]["criteria"]]
    assert names[-2:] == list(NAMES)
    assert not set(NAMES) & set(CRITERIA)  # until the command ends
