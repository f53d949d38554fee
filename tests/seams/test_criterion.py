"""A criterion of a user's own stands in every analysis, and decides nothing."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import asperity as asp
from asperity.analysis.passivity.criteria import CRITERIA

Call = Callable[..., tuple[int, str, str]]
Answer = Callable[..., Any]

MODULE = '''
"""Half of the smooth wall's rule: a margin for hands that are lighter than those tested."""

from asperity.analysis.passivity.criteria import Criterion, register

NAME = "half the wall"


def half(loop):
    if loop.wall is None:
        return Criterion(NAME, "k q <= K0/2", missing=("max_stiffness",))
    limit = float(loop.wall) / 2 / loop.q.upper
    stiffness = loop.surface.stiffness
    return Criterion(NAME, "k q <= K0/2", stiffness <= limit, limit, limit / stiffness)


register(NAME, half)
'''
SPEC = "sinusoid:amplitude=0.2mm,period=1mm"


@pytest.fixture
def module(tmp_path: Path) -> list[str]:
    (tmp_path / "mine.py").write_text(MODULE, encoding="utf-8")
    return ["--law-module", str(tmp_path / "mine.py")]


def _own(data: Any) -> Any:
    return next(one for one in data["passivity"]["criteria"] if one["name"] == "half the wall")


def test_analyze_judges_by_it_too(call: Call, answer: Answer, module: list[str]) -> None:
    asked = ["analyze", SPEC, "--law", "A", "--device", "omega.3"]
    data = answer(*asked, *module)
    own = _own(data)
    assert own["limit"] == pytest.approx(2500.0 / data["q"]["upper"])
    assert own["holds"] == (own["limit"] >= 1000.0)
    code, page, _err = call(*asked, *module, "--html", "-")
    assert (code, "half the wall" in page) == (0, True)
    code, out, _err = call(*asked, *module)
    assert (code, "half the wall" in out) == (0, True)
    without = answer(*asked)
    assert without["passivity"]["decided_by"] == data["passivity"]["decided_by"]
    assert without["answer"] == data["answer"]
    assert "half the wall" not in CRITERIA


def test_what_the_device_lacks_is_said(answer: Answer, module: list[str], tmp_path: Path) -> None:
    (tmp_path / "bare.toml").write_text('name = "Bare"\nmax_force = "3 N"\n')
    asked = ["analyze", SPEC, "--law", "A", "--device", str(tmp_path / "bare.toml")]
    own = _own(answer(*asked, *module))
    assert (own["holds"], own["missing"]) == (None, ["max_stiffness"])


def test_python_gets_it_with_every_analysis() -> None:
    exec(MODULE, {})
    try:
        result = asp.analyze(asp.Surface(asp.Sinusoid(2e-4, 1e-3), "C"), "omega.3")
        criterion = result.passivity.criterion("half the wall")
        assert criterion.limit == pytest.approx(2500.0 / result.q.upper)
    finally:
        del CRITERIA["half the wall"]


def test_a_name_that_is_taken_has_its_line(call: Call, tmp_path: Path) -> None:
    (tmp_path / "mine.py").write_text(MODULE.replace("half the wall", "leak"), encoding="utf-8")
    code, out, err = call("analyze", SPEC, "--law", "A", "--law-module", str(tmp_path / "mine.py"))
    assert (code, out) == (2, "")
    assert "mine.py, line 17: name is the name of another criterion, got 'leak'" in err
