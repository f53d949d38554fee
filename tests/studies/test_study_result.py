"""Results of studies: effects that are there, exclusions, tables, reports, plans and observers."""

from __future__ import annotations

import csv
import json
import math
from dataclasses import replace
from pathlib import Path

import pytest
from tests.studies.study_cases import AMPLITUDE, design_of, records

from asperity.core.errors import ParameterError
from asperity.devices import load_device
from asperity.studies.design import TrialRecord
from asperity.studies.methods import METHODS
from asperity.studies.simulated_participants import (
    OBSERVERS,
    find_observer,
    hand_strength,
    plan,
    surface_strength,
)
from asperity.studies.study_report import study_page
from asperity.studies.study_result import analyse
from asperity.surface import Surface
from asperity.textures import Sinusoid

EFFECTS = {"comparison": 4.0 * math.log(2.0), "rating": math.log(2.0), "onset": math.log(0.5)}


@pytest.mark.parametrize("kind", EFFECTS)
def test_effects_come_out(kind: str) -> None:
    result = analyse(design_of(kind), records(design_of(kind), 12))
    assert len(result.differences) == 3
    for estimate, low, high in result.differences:
        assert low < -EFFECTS[kind] < high
        assert high < 0.0 or low > 0.0
        assert estimate == pytest.approx(-EFFECTS[kind], rel=0.5)


def test_matches_of_what_is_equal_are_at_chance() -> None:
    result = analyse(design_of("axb", repeats=8), records(design_of("axb", repeats=8), 12))
    law = [label["surface.law"] for label in result.labels]
    assert law == ["A / C", "A / D", "A / H", "C / D", "C / H", "D / H"]
    for (share, low, high), pair in zip(result.pooled, law, strict=True):
        assert 0.0 <= low <= share <= high <= 1.0
        assert low > 0.5 if pair.startswith("A") else 0.38 < share < 0.62


def test_likert_scales_keep_the_order() -> None:
    design = design_of("rating", scale="likert")
    pooled = [one[0] for one in analyse(design, records(design, 6)).pooled]
    assert pooled[0] > max(pooled[1:])
    assert 1.0 <= min(pooled) <= max(pooled) <= 7.0


def test_magnitudes_do_not_depend_on_the_numbers_that_a_participant_likes() -> None:
    design, trials = design_of("rating"), records(design_of("rating"), 4)
    scaled = [
        replace(one, answer=repr(7.0 * float(one.answer))) if one.participant == "P00" else one
        for one in trials
    ]
    first, second = analyse(design, trials), analyse(design, scaled)
    assert [one[1:] for one in second.differences] == [
        pytest.approx(one[1:], abs=1e-9) for one in first.differences
    ]
    spread = second.score.values.std(axis=0)
    assert spread == pytest.approx(first.score.values.std(axis=0), abs=1e-9)


def test_participants_and_trials_are_excluded_by_the_rules() -> None:
    rules = {"shortest_response": 0.3, "least_correct": 0.6, "largest_omission": 0.3}
    design = design_of("axb", repeats=8, exclusion=rules)
    trials = records(design, 4, threshold=0.1)

    def change(one: TrialRecord) -> TrialRecord:
        is_hasty = one.trial == 4 or (one.participant == "P01" and one.trial % 2)
        answer = "1" if one.participant == "P02" else one.answer
        return replace(one, answer=answer, response_time=0.1 if is_hasty else 1.0)

    changed = [change(one) for one in trials]
    result = analyse(design, changed)
    assert result.excluded.keys() == {"P01", "P02"}
    assert "left out" in result.excluded["P01"]
    assert "answers right" in result.excluded["P02"]
    assert result.omitted["P00"] == 1
    assert result.included_score.participants == ("P00", "P03")
    assert [row["used"] for row in result.trial_table.table_rows()][:5] == [True] * 3 + [
        False,
        True,
    ]
    assert analyse(design_of("axb", repeats=8), changed).excluded == {}


def test_inconsistent_participants_are_excluded() -> None:
    design = design_of("comparison", repeats=4, exclusion={"least_consistency": 0.6})
    steady = records(design, 1, slope=40.0)
    opposite = [
        replace(one, participant="P9", answer="1") for one in steady
    ]  # always the first: of a pair that changes places, each as often
    result = analyse(design, [*steady, *opposite])
    assert result.excluded.keys() == {"P9"}
    assert result.consistency["P9"] == pytest.approx(1.0 / 3.0)


@pytest.mark.parametrize("kind", METHODS)
def test_reports_and_tables(kind: str, tmp_path: Path) -> None:
    options = {"trials": 8} if kind in {"detection", "discrimination"} else {}
    design = design_of(kind, **options)
    result = analyse(design, records(design, 3))
    html = result.to_html()
    assert "rougher?" in html
    assert html.count("<svg") >= 1 + METHODS[kind].has_function
    assert json.loads(json.dumps(result.to_dict()))["schema"] == 1
    result.to_csv(tmp_path / "scores.csv")
    result.trial_table.to_csv(tmp_path / "trials.csv")
    with (tmp_path / "trials.csv").open(encoding="utf-8", newline="") as stream:
        rows = list(csv.DictReader(stream))
    assert len(rows) == len(result.trials)
    assert {"participant", "answer", "surface.law", "response time [s]", "used"} <= rows[0].keys()
    shown = {row["surface.law"] for row in rows}
    assert len(shown) == {"comparison": 12, "axb": 12}.get(kind, 4)
    with (tmp_path / "scores.csv").open(encoding="utf-8", newline="") as stream:
        scores = list(csv.DictReader(stream))
    labels = len(result.labels)
    compared = labels if kind == "axb" else labels - 1
    assert len(scores) == 3 * labels + labels + compared


def test_a_study_without_trials_is_refused() -> None:
    with pytest.raises(ParameterError, match="no trials"):
        analyse(design_of("rating"), [])


def test_plans_find_effects_and_nothing_else() -> None:
    design = design_of("comparison", repeats=2)
    strong = plan(design, 2.0, 10, simulations=30)
    none = plan(design, 1.0, 10, simulations=40)
    few = plan(design, 1.3, 4, simulations=30)
    more = plan(design, 1.3, 16, simulations=30)
    assert strong.found >= 27
    assert none.found <= 7  # of 40: 5 % are expected, more than 7 come once in 700 times
    assert few.found < more.found
    assert strong == plan(design, 2.0, 10, simulations=30)
    assert "10 participants of 12 trials each" in strong.text
    assert "With 1 participant of 1 trial each" in replace(strong, participants=1, trials=1).text


def test_plans_do_not_find_effects_below_what_is_felt() -> None:
    design = design_of("detection", trials=30)
    felt = plan(design, 4.0, 4, simulations=5)
    weak = plan(design, 4.0, 4, simulations=5, level_strength=lambda one: one[AMPLITUDE] / 2e-3)
    assert felt.found >= 4
    assert weak.found == 0
    assert felt.reach == pytest.approx(10.0)
    assert "reach 0.05 times what is just felt" in weak.text
    assert "reach" not in plan(design_of("axb"), 4.0, 4, simulations=1).text


def test_observers_who_guess_show_no_effect() -> None:
    found = plan(design_of("axb"), 3.0, 10, simulations=40, observer="guessing")
    assert found.found <= 7
    assert plan(design_of("axb"), 3.0, 10, simulations=10).found >= 8


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"effect": 0.0}, "effect"),
        ({"effect": 2.0, "participants": 2}, "at least 3"),
        ({"effect": 2.0, "observer": "tipical"}, "typical"),
    ],
)
def test_plans_that_cannot_be_made_are_refused(options: dict, words: str) -> None:
    with pytest.raises(ParameterError, match=words):
        plan(design_of("rating"), **{"simulations": 1, **options})


def make_stimulus(values: dict) -> tuple[Surface, object]:
    wave = Sinusoid(amplitude=values[AMPLITUDE], period=1e-3)
    return Surface(wave, values["surface.law"], stiffness=500.0), load_device("touch")


def test_strength_grows_with_the_force_at_the_hand() -> None:
    weak, strong = (
        surface_strength(*make_stimulus({AMPLITUDE: x, "surface.law": "A"})) for x in (2e-6, 1e-5)
    )
    assert 0.0 < weak < 1.0
    assert strong == pytest.approx(5.0 * weak, rel=0.2)


def test_strengths_between_levels_are_interpolated() -> None:
    design = design_of("detection", reference=1e-6)
    strength = hand_strength(design, make_stimulus)
    values = {AMPLITUDE: 7e-6, "surface.law": "C"}
    assert strength(values) == pytest.approx(surface_strength(*make_stimulus(values)), rel=0.02)
    assert strength({**values, AMPLITUDE: 1e-6}) < strength(values)


def test_observers_have_names() -> None:
    assert find_observer("typical") is OBSERVERS["typical"]
    with pytest.raises(ParameterError, match="typical"):
        find_observer("tipycal")


@pytest.mark.parametrize("kind", METHODS)
def test_studies_whose_participants_are_all_excluded(kind: str) -> None:
    rules = {"shortest_response": 9.0}
    options = {"trials": 5} if METHODS[kind].has_function else {}
    design = design_of(kind, exclusion=rules, **options)
    result = analyse(design, records(design, 3))
    assert len(result.excluded) == 3
    assert "no participant is used" in result.to_html()


@pytest.mark.parametrize(
    ("observer", "words"),
    [({"slope": 0.0, "lapse": 1.0}, "above 100 µm"), ({"threshold": 0.01}, "below 1 µm")],
)
def test_reports_of_thresholds_outside_the_levels(
    observer: dict, words: str, tmp_path: Path
) -> None:
    design = replace(design_of("detection", trials=20), unit="m")
    result = analyse(design, records(design, 4, **observer))
    rows = result.to_dict()["rows"]
    assert sum(row["outside levels"] == words for row in rows) >= 14  # of 16, and pooled ones
    for row in rows:
        assert (row["estimate"] is None) == bool(row["outside levels"]) or "ratio" in row[
            "quantity"
        ]
    pooled = [row for row in rows if row["participant"] == "pooled"]
    assert not any(row["estimate"] for row in pooled)
    assert [row["unit"] for row in pooled] == ["m"] * 4 + [""] * 3
    answer = study_page(result).answer
    assert answer.startswith("threshold of texture.amplitude: A ")
    assert answer.endswith("; 4 participants.")
    assert f"C {words} (" in answer
    assert f"C {words} (" in result.to_html()
    result.to_csv(tmp_path / "table.csv")
    assert f",{words}," in (tmp_path / "table.csv").read_text("utf-8")


def test_thresholds_and_onsets_have_units() -> None:
    for kind, unit, prefix in (("detection", "m", "µm"), ("onset", "N/m", "N/m")):
        design = replace(design_of(kind), unit=unit)
        result = analyse(design, records(design, 4))
        assert f" {prefix} (" in study_page(result).answer
        assert f" {prefix} to " in study_page(result).answer
        assert f"{result.score.quantity} [{unit}]" in result.to_html()


def test_figures_have_data_for_narrow_windows_and_legends() -> None:
    from asperity.report.pictures.panel_data import extract_panels
    from asperity.studies.result_pictures import scores_figure

    result = analyse(design_of("comparison"), records(design_of("comparison"), 3))
    figure = scores_figure(result)
    figure.canvas.draw()
    (panel,) = extract_panels(figure)
    names = [series.name for series in panel.series]
    assert names[:4] == ["P00", "P01", "P02", "mean of A"]
    texts = [text.get_text() for text in figure.legends[0].get_texts()]
    assert texts == ["a participant", "mean and its 95 % interval"]


def test_a_page_states_what_was_presented() -> None:
    design = design_of("comparison")
    content = {
        "study": {"texture_force": "10 mN"},
        "vary": {"surface.law": ["A", "C", "D", "H"]},
        "texture": {"kind": "sinusoid", "period": "2 mm"},
        "surface": {"max_depth": "0.2 mm"},
        "device": {"id": "touch"},
    }
    page = analyse(design, records(design, 3), content).to_html()
    for text in ("surface.law A / C / D / H", "period 2 mm", "id touch", "force of 10 mN RMS"):
        assert text in page


def test_a_plan_tells_how_far_it_is() -> None:
    shares: list[float] = []
    plan(design_of("comparison", repeats=1), 2.0, 3, simulations=4, progress=shares.append)
    assert shares == [0.25, 0.5, 0.75, 1.0]


def test_threshold_of_a_discrimination_is_named_an_increase() -> None:
    """Its levels are counted from the reference: 83 µm above 50 µm, not of 83 µm."""
    names = {}
    for kind in ("detection", "discrimination"):
        design = replace(design_of(kind, trials=20), unit="m")
        result = analyse(design, records(design, 3))
        names[kind] = {row["quantity"] for row in result.to_dict()["rows"]}
    assert "threshold of texture.amplitude" in names["detection"]
    increase = "threshold of the increase of texture.amplitude from the reference"
    assert increase in names["discrimination"]
    assert "threshold of texture.amplitude" not in names["discrimination"]
