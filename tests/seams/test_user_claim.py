"""A user-defined claim is computed, judged and reported like those of the paper."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import pytest
from tests.helpers.pages import page_example

from asperity.core.errors import ParameterError
from asperity.core.processes import limit_processes
from asperity.paper import get_claim, reproduce_claims
from asperity.paper.claim import Claim
from asperity.paper.claims import CLAIMS, register

Call = Callable[..., tuple[int, str, str]]
Answer = Callable[..., Any]

MODULE = page_example("howto/extend.md", "A claim")


@pytest.fixture
def module(tmp_path: Path) -> str:
    (tmp_path / "mine.py").write_text(MODULE, encoding="utf-8")
    return str(tmp_path / "mine.py")


@pytest.fixture
def claim() -> Iterator[Claim]:
    names: dict[str, Any] = {}
    exec(MODULE, names)
    yield register(names["WALL"])
    del CLAIMS["own-wall"]


def test_command_line_reports_it(call: Call, read_json: Answer, module: str) -> None:
    options = ["--plugin", module, "--claim", "own-wall", "--claim", "eq-12"]
    data = read_json("reproduce", *options)
    assert [item["id"] for item in data["claims"]] == ["eq-12", "own-wall"]
    result = data["claims"][1]
    assert result["verdict"] == "holds"
    assert result["evidence"]["numbers"]["force"] == pytest.approx(0.7)
    code, out, err = call("reproduce", *options)
    assert (code, err) == (0, "")
    assert "0.7 N at 1 mm" in out
    code, page, _err = call("reproduce", *options, "--html", "-")
    assert (code, "The smooth wall is a linear spring." in page) == (0, True)
    assert "own-wall" not in CLAIMS


def test_reproduce_claims_computes_it(claim: Claim) -> None:
    assert get_claim("own-wall") is claim
    (result,) = reproduce_claims(["own-wall"])
    assert (result.verdict, result.evidence.summary) == ("holds", "0.7 N at 1 mm")


@pytest.mark.usefixtures("claim")
def test_it_is_computed_with_worker_processes() -> None:
    with limit_processes(2):
        results = reproduce_claims(["own-wall", "eq-12", "eq-10"])
    assert [result.id for result in results] == ["eq-10", "eq-12", "own-wall"]
    assert results[-1].verdict == "holds"


def test_registering_an_existing_id_is_refused(claim: Claim) -> None:
    with pytest.raises(ParameterError, match="'own-wall' is taken"):
        register(claim)
