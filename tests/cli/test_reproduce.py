"""``asperity reproduce``: claims, figures, options and errors."""

from __future__ import annotations

import json
from collections.abc import Callable
from html.parser import HTMLParser
from pathlib import Path

import pytest
from rich.cells import cell_len
from tests.report.report_pages import check_alone, check_alts

from asperity.paper import CLAIMS, VERDICTS, get_claim

Call = Callable[..., tuple[int, str, str]]
FEW = ("eq-12", "eq-44", "table-1-A", "remark-3", "limit-4", "sentence-V.A-qF")


COMMAND = "reproduce"  # what the fixture "call" runs


def claim_options(*names: str) -> list[str]:
    return [text for name in names for text in ("--claim", name)]


def test_one_claim_shows_its_evidence(call: Call) -> None:
    code, out, err = call("--claim", "eq-12")
    assert (code, err) == (0, "")
    result = get_claim("eq-12").run()
    text = " ".join(out.split())
    assert " ".join(result.statement.split()) in text
    assert result.verdict in text
    assert " ".join(result.evidence.summary.split()) in text
    for name in result.evidence.numbers:
        assert name in text


def test_json_follows_the_schema(call: Call) -> None:
    code, out, _err = call(*claim_options(*FEW), "--json", "-")
    assert code == 0
    data = json.loads(out)
    assert set(data) == {"schema", "claims", "experiments"}
    assert data["experiments"] is None
    assert {claim["id"] for claim in data["claims"]} == set(FEW)
    for claim in data["claims"]:
        assert set(claim) == {"id", "equations", "statement", "verdict", "evidence", "flips_under"}
        assert claim["verdict"] in VERDICTS
        assert claim["evidence"]["summary"]


def test_claim_has_the_same_result_alone_and_with_others(call: Call) -> None:
    _code, several, _err = call(*claim_options(*FEW), "--json", "-")
    _code, alone, _err = call("--claim", "limit-4", "--json", "-")
    rows = {claim["id"]: claim for claim in json.loads(several)["claims"]}
    assert json.loads(alone)["claims"] == [rows["limit-4"]]


def test_every_equation_has_a_claim() -> None:
    covered = {number for claim in CLAIMS.values() for number in claim.equations}
    expected = {f"({n})" for n in range(1, 45)} | {"Table I", "Table II"}
    expected |= {f"Remark {n}" for n in range(1, 8)} | {f"Limit {n}" for n in range(1, 7)}
    assert expected <= covered


class _Tags(HTMLParser):
    """Parser that checks that tags are closed in order."""

    VOID = frozenset({"meta", "img", "br"})

    def __init__(self) -> None:
        super().__init__()
        self.open: list[str] = []
        self.ids: list[str] = []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        if tag not in self.VOID:
            self.open.append(tag)
        self.ids += [value for name, value in attrs if name == "id" and value]

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag


def test_html_page_is_self_contained_and_links_to_every_claim(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "claims.html"
    code, _out, _err = call(*claim_options(*FEW), "--html", str(path))
    text = path.read_text(encoding="utf-8")
    assert code == 0
    tags = _Tags()
    tags.feed(text)
    assert tags.open == []
    assert set(FEW) <= set(tags.ids)
    assert len(set(tags.ids)) == len(tags.ids)
    check_alts(check_alone(text), text)
    assert text.count("<svg") == 2  # figures 2 and 3
    for name in FEW:
        assert f"asperity reproduce --claim {name}" in text


def test_figures_are_written_to_a_new_folder(call: Call, tmp_path: Path) -> None:
    folder = tmp_path / "new" / "figures"
    code, out, err = call("--claim", "eq-12", "--figures", str(folder), "--format", "PNG")
    assert (code, err) == (0, "")
    assert out.splitlines()[-1] == f"Figures in {folder}: fig-3.png"
    assert [path.name for path in folder.iterdir()] == ["fig-3.png"]
    code, out, _err = call("--claim", "fig-2", "--figures", str(folder), "--json", "-")
    assert code == 0
    assert json.loads(out)["claims"]  # and nothing else on standard output
    assert {path.name for path in folder.iterdir()} == {"fig-3.png", "fig-2.svg"}


def test_report_path_equal_to_the_figures_folder_is_refused(call: Call, tmp_path: Path) -> None:
    path = str(tmp_path / "same")
    code, _out, err = call("--claim", "eq-12", "--figures", path, "--html", path)
    assert code == 2
    assert "html must be a file, not a folder" in err


BAD = [
    (["--claim", "eq-99"], "did you mean"),
    (["--claim", ""], "claim is unknown"),
    (["--json", "-", "--html", "-"], "cannot both"),
    (["--json", "no/where.json"], "folder that exists"),
    (["--surface", "sinusiod:amplitude=1mm,period=1mm"], "did you mean 'sinusoid'"),
    (["--magnify", "20"], "applies to a measured surface"),
    (["--format", "png"], "give --figures DIR"),
    (["--figures", "new", "--format", "pdf"], "format is unknown: 'pdf'"),
    (
        ["--figures", "new", "--claim", "eq-44"],
        "figures are not available for eq-44, but for fig-2",
    ),
    (["--figures", "new", "--claim", "eq-99"], "did you mean"),
    (["--figures", "/dev/null"], "must be a folder, not a file"),
    (["--figures", "/dev/null/figures"], "must be a folder, not a file"),
    (["--figures", "a\0b"], "figures cannot be created"),
]


@pytest.mark.parametrize(("arguments", "message"), BAD, ids=[" ".join(a) for a, _m in BAD])
def test_invalid_input_gives_a_one_line_error_and_writes_no_file(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], message: str
) -> None:
    monkeypatch.chdir(tmp_path)
    code, out, err = call(*arguments)
    assert (code, out) == (2, "")
    assert message in err
    assert len(err.strip().splitlines()) == 1
    assert list(tmp_path.iterdir()) == []


def test_table_of_all_claims_fits_80_columns(call: Call, monkeypatch: pytest.MonkeyPatch) -> None:
    """Small experiments replace those of the paper, which take minutes."""
    import asperity.paper.experiments as package
    from asperity.paper import experiments as suite
    from asperity.paper.cycle_experiments import DeviceExperiment, passivity_experiment
    from asperity.paper.experiments import bump_experiment, scanning_experiment

    def run_small_experiments(
        measured: object = None, progress: object = None
    ) -> suite.Experiments:
        assert measured is None
        assert progress is not None
        return suite.Experiments(
            passivity_experiment("W", (0,), starts=1),
            scanning_experiment("A"),
            bump_experiment("AD"),
            DeviceExperiment((), ("falcon",)),
        )

    monkeypatch.setattr(package, "run_experiments", run_small_experiments)
    code, out, err = call()
    assert (code, err) == (0, "")
    assert max(map(cell_len, out.splitlines())) <= 80
    for name in CLAIMS:
        assert name in out
    assert f"Of {len(CLAIMS)} claims" in out
    assert "V.C: A " in out
