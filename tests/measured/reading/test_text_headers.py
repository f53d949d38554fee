"""Random text files in the styles of instruments; ``bench.stress.text_headers`` reads 10 000."""

from __future__ import annotations

from collections import Counter

import numpy as np
import pytest
from bench.stress import text_headers

from asperity.measured.reading import RawSurface, text_header

TRIALS = range(20_000, 20_013)


def count_verdicts(read: text_headers.Reading = text_headers.read_plain) -> Counter[str]:
    return Counter(
        what
        for style in text_headers.STYLES
        for _, what in text_headers.verdicts(style, TRIALS, read)
    )


def test_random_text_files_are_right_or_asked() -> None:
    found = count_verdicts()
    assert len(text_headers.STYLES) >= 39
    assert found.total() >= 575
    assert set(found) <= {"right", "asked"}
    assert found["right"] > 0.35 * found.total()


def test_reading_by_any_unit_of_the_header_is_found_wrong() -> None:
    found = count_verdicts(text_headers.read_by_any_unit)
    assert sum(n for what, n in found.items() if what.startswith("WRONG heights")) > 50


@pytest.mark.parametrize(
    ("name", "words", "style", "fault"),
    [
        ("heights", {"lateral", "sampling"}, "matrix without header", "WRONG heights"),
        ("factors", set(), "MountainsMap, factor", "WRONG heights"),
        ("quantities", set(), "Gwyddion, other channel", "WRONG heights"),
    ],
)
def test_a_planted_mistake_is_found(
    monkeypatch: pytest.MonkeyPatch, name: str, words: set[str], style: str, fault: str
) -> None:
    known = text_header.WORDS[name] | words if words else frozenset[str]()
    monkeypatch.setitem(text_header.WORDS, name, known)
    found = [what for _, what in text_headers.verdicts(style, range(30))]
    assert any(what.startswith(fault) for what in found), Counter(found)


def test_judge_finds_each_kind_of_fault() -> None:
    _, sheet = text_headers.make_file("MountainsMap", 3)
    right = RawSurface(sheet.heights, sheet.pitch, "a.txt", ())
    assert text_headers.judge(right, sheet) == "right"
    gaps = np.where(np.arange(sheet.columns) == 2, np.nan, sheet.heights)
    for heights, pitch, fault in (
        (sheet.heights.T, sheet.pitch, "WRONG shape"),
        (1e3 * sheet.heights, sheet.pitch, "WRONG heights"),
        (gaps, sheet.pitch, "WRONG missing points"),
        (sheet.heights, (1e-3, 1e-3), "WRONG pitch"),
        (sheet.heights, None, "asked"),
    ):
        raw = RawSurface(heights, pitch, "a.txt", ())
        assert text_headers.judge(raw, sheet).startswith(fault)
