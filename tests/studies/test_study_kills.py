"""Sessions that are killed at random moments; ``bench.stress.study_kills`` does it 500 times."""

from __future__ import annotations

from pathlib import Path

from bench.stress.study_kills import LONGEST, STIFFNESSES, run_kills


def test_kills_lose_nothing_and_unblind_nothing(tmp_path: Path) -> None:
    outcome = run_kills(5, tmp_path)
    assert LONGEST > 0.0
    assert outcome.kills == 5
    assert not +outcome.wrong
    assert max(outcome.limits.values(), default=0.0) <= max(STIFFNESSES)
