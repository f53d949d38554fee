"""A verdict follows from the numbers, and its evidence can be written as JSON."""

from __future__ import annotations

import json
import math

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.paper.claim import (
    VERDICTS,
    Check,
    Claim,
    check_statement,
    check_values,
    combine_checks,
    format_summary,
    relative_error,
)


def test_correct_printed_formula_holds_without_correction() -> None:
    check = check_values(
        "x", printed=[1.0, 2.0], corrected=[5.0, 5.0], reference=[1.0, 2.0], correction="c"
    )
    assert check.verdict == "holds"
    assert check.correction == ""


def test_wrong_formula_with_right_correction_holds_with_correction() -> None:
    check = check_values(
        "x", printed=[1.0, 2.1], corrected=[1.0, 2.0], reference=[1.0, 2.0], correction="c"
    )
    assert (check.verdict, check.correction) == ("holds with correction", "c")
    assert check.numbers["x, error as printed"] == pytest.approx(0.05)


@pytest.mark.parametrize("corrected", [None, [1.0, 2.2]])
def test_wrong_formula_without_right_correction_does_not_hold(
    corrected: list[float] | None,
) -> None:
    check = check_values(
        "x", printed=[1.0, 2.1], corrected=corrected, reference=[1.0, 2.0], correction="c"
    )
    assert check.verdict == "does not hold"
    # A wrong correction is not reported.
    assert check.correction == ("c" if corrected is None else "")


def test_verdict_changes_at_the_tolerance() -> None:
    for error, verdict in ((0.9e-9, "holds"), (1.1e-9, "does not hold")):
        assert (
            check_values("x", printed=[0.0, 2.0 * (1.0 + error)], reference=[0.0, 2.0]).verdict
            == verdict
        )


@pytest.mark.parametrize("reference", [math.nan, [1.0, math.nan], []])
def test_missing_reference_is_undecided(reference: object) -> None:
    assert check_values("x", printed=reference, reference=reference).verdict == "undecided"


@pytest.mark.parametrize(
    ("printed", "truth", "error"),
    [
        (math.inf, math.inf, 0.0),
        (1.0, math.inf, math.inf),
        (math.inf, 1.0, math.inf),
        (math.nan, 1.0, math.inf),
        (None, 1.0, math.inf),
        ([1.0, 1.0], 1.0, math.inf),
        (0.0, 0.0, 0.0),
        (1e-300, 0.0, math.inf),
        ([3.0, -4.0], [3.0, -5.0], 0.2),
    ],
)
def test_errors_are_relative_to_the_largest_entry(
    printed: object, truth: object, error: float
) -> None:
    assert relative_error(printed, truth) == pytest.approx(error)


def test_verdicts_of_statements() -> None:
    assert check_statement("s", printed=True).verdict == "holds"
    assert (
        check_statement("s", printed=np.bool_(False), corrected=True, correction="c").correction
        == "c"
    )
    assert (
        check_statement("s", printed=False, corrected=False, correction="c").verdict
        == "does not hold"
    )
    assert check_statement("s", printed=False, corrected=False, correction="c").correction == ""
    assert check_statement("s", printed=False, correction="c").correction == "c"
    assert check_statement("s", printed=None).verdict == "undecided"
    numbers = check_statement("s", printed=True, numbers={"a b": 1.0}, c_d=2.0).numbers
    assert numbers == {"a b": 1.0, "c d": 2.0}


@pytest.mark.parametrize(
    ("parts", "whole"),
    [
        (("holds", "holds"), "holds"),
        (("holds", "holds with correction"), "holds with correction"),
        (("undecided", "holds with correction"), "undecided"),
        (("undecided", "does not hold", "holds"), "does not hold"),
    ],
)
def test_combined_verdict_is_that_of_the_weakest_part(parts: tuple[str, ...], whole: str) -> None:
    checks = [
        Check(verdict[:1], {str(i): 1.0}, f"c{i}" if "cor" in verdict else "", verdict, verdict)
        for i, verdict in enumerate(parts)
    ]
    combined = combine_checks(*checks)
    assert combined.verdict == whole
    assert len(combined.numbers) == len(parts)
    assert combined.fitted == "; ".join(dict.fromkeys(parts))


def test_json_evidence_has_no_infinity() -> None:
    check = Check(
        "s", {"a": math.inf, "b": [1.0, -math.inf, math.nan], "c": "text"}, verdict="holds"
    )
    result = Claim("x-1", ("(1)",), "I", "words", lambda: check).run()
    data = json.loads(json.dumps(result.to_dict(), allow_nan=False))
    assert list(data) == ["id", "equations", "statement", "verdict", "evidence", "flips_under"]
    assert data["evidence"]["numbers"] == {"a": "inf", "b": [1.0, "-inf", None], "c": "text"}
    assert data["equations"] == ["(1)"]


def test_parameter_error_is_undecided_and_other_errors_propagate() -> None:
    def raise_parameter_error() -> Check:
        raise ParameterError("depth", "must be positive [m]", -1.0)

    def raise_other_error() -> Check:
        raise ZeroDivisionError

    result = Claim("x", (), "I", "", raise_parameter_error).run()
    assert result.verdict == "undecided"
    assert "depth must be positive" in result.evidence.summary
    with pytest.raises(ZeroDivisionError):
        Claim("x", (), "I", "", raise_other_error).run()


NUMBERS = {"net gain of A": 2e-3, "net gain of E": -1e-3, "a.b [J]": [3.0, 1.0, 2.0], "laws": "AB"}


@pytest.mark.parametrize(
    ("template", "sentence"),
    [
        ("{net gain of A:+.1f*1e3} mJ", "+2.0 mJ"),
        ("{net gain of A:.3f J}", "0.002 J"),
        ("{net gain of *:+.0f*1e3 mJ}", "A +2 mJ, E -1 mJ"),
        ("{a.b [J]:.1f}", "1.0 to 3.0"),
        ("{a* [J]:g N}", ".b 1 N to 3 N"),
        ("laws {laws}", "laws AB"),
    ],
)
def test_numbers_are_inserted_into_a_sentence(template: str, sentence: str) -> None:
    assert format_summary(template, NUMBERS) == sentence


def test_sentence_without_its_number_is_an_error() -> None:
    with pytest.raises(KeyError, match="net gain of B"):
        format_summary("{net gain of B}", NUMBERS)


@pytest.mark.parametrize(
    ("is_true", "corrected", "correction"),
    [(True, None, ""), (False, True, "right"), (False, None, "1.0 kg")],
)
def test_texts_of_a_claim_follow_its_verdict(
    is_true: bool, corrected: bool | None, correction: str
) -> None:
    def compute() -> Check:
        part = check_statement("own", printed=True)
        return combine_checks(part, check_statement(printed=is_true, corrected=corrected, m=1.0))

    texts = {"correction": "right", "instead": "{m:.1f kg}", "summary": "{found}; {m} kg"}
    result = Claim("x", (), "I", "", compute, **texts).run()
    assert result.evidence.summary == "own; 1.0 kg"
    assert result.evidence.correction == correction


def test_there_are_four_verdicts() -> None:
    assert VERDICTS == ("holds", "holds with correction", "does not hold", "undecided")
