"""Varied keys: ranges, lists, designs, and what cannot be used."""

from __future__ import annotations

import math
from pathlib import Path

import numpy as np
import pytest
from tests.sweeps.conftest import SCENE

from asperity.core.errors import ParameterError
from asperity.sweeps.sweep_plan import SweepPlan, make_plan

PRESS = str(Path(__file__).parents[2] / "examples" / "press.toml")


def plan(
    vary: dict[str, str], scene: str = SCENE, run: str = "compare", design: str = ""
) -> SweepPlan:
    return make_plan(scene, vary, run, design=design)


def column(made: SweepPlan, name: str) -> list[object]:
    return [made.numbers(i)[name] for i in range(len(made))]


def test_linear_and_logarithmic_ranges() -> None:
    assert column(plan({"texture.period": "1mm:2mm:5"}), "texture.period [m]") == [
        1e-3, 1.25e-3, 1.5e-3, 1.75e-3, 2e-3,
    ]  # fmt: skip
    periods = column(plan({"texture.period": "0.05mm:20mm:11log"}), "texture.period [m]")
    assert (periods[0], periods[-1]) == (5e-5, 20e-3)
    np.testing.assert_allclose(np.diff(np.log(np.array(periods, float))), math.log(400) / 10)


def test_values_that_are_no_text_are_refused() -> None:
    with pytest.raises(ParameterError, match=r"texture\.period must be a text, such as"):
        plan({"texture.period": [1e-3, 2e-3]})  # type: ignore[dict-item]  # the error under test


def test_the_last_key_changes_fastest() -> None:
    made = plan({"device": "touch,omega.3", "texture.period": "1mm,3mm,2 mm"})
    assert len(made) == 6
    assert [tuple(made.numbers(i).values()) for i in (0, 1, 2, 3)] == [
        ("touch", 1e-3), ("touch", 3e-3), ("touch", 2e-3), ("omega.3", 1e-3),
    ]  # fmt: skip


def test_integers_units_and_vectors() -> None:
    made = plan({"device.delay_samples": "0:6:4", "device.update_rate": "1kHz,4 kHz"}, PRESS)
    assert column(made, "device.delay_samples")[::2] == [0, 2, 4, 6]
    assert column(made, "device.update_rate [Hz]")[:2] == [1000.0, 4000.0]
    start = plan({"run.start": "0mm;0mm;4mm,0mm;0mm;5mm"}, PRESS)
    assert column(start, "run.start [m]") == ["0.0; 0.0; 0.004", "0.0; 0.0; 0.005"]


def test_a_text_of_a_value_does_not_matter_but_the_value_does() -> None:
    texts = [
        made.template.case_text(made.values(0))
        for made in (plan({"texture.period": text}) for text in ("0.5mm,1mm", "500um,2mm", "501um"))
    ]
    assert texts[0] == texts[1] != texts[2]


def test_sobol_points_fill_the_ranges_and_lists_are_combined_with_them() -> None:
    vary = {
        "texture.period": "1mm:4mm:log", "device": "touch,omega.3", "texture.amplitude": "0mm:1mm",
    }  # fmt: skip
    made = plan(vary, "sinusoid:phase=0deg", design="sobol:64")
    assert len(made) == 128
    periods, heights = (
        np.array(column(made, f"texture.{name} [m]"), float)[::2]
        for name in ("period", "amplitude")
    )
    # Each half, quarter, ... 64th of a range has one point as often as any other.
    shares = np.log(periods / 1e-3) / math.log(4)
    for values in (shares, heights / 1e-3):
        np.testing.assert_array_equal(np.sort(np.floor(64 * values + 1e-9)), np.arange(64))
    assert not np.array_equal(np.argsort(periods), np.argsort(heights))
    assert column(made, "device.id")[:4] == ["touch", "omega.3"] * 2


@pytest.mark.parametrize(
    ("vary", "design", "words"),
    [
        ({"texture.perod": "1mm,2mm"}, "", "did you mean 'texture.period'"),
        ({"txture.period": "1mm,2mm"}, "", "did you mean 'texture.period'"),
        ({"stiffness": "1N/m,2N/m"}, "", "did you mean 'surface.stiffness'"),
        ({"texture.period": "1,2"}, "", "texture.period needs a unit: write 1mm or 1um"),
        ({"texture.period": "1N,2N"}, "", "texture.period must be a quantity such as '1.5 m'"),
        ({"texture.period": "1mm:2N:4"}, "", "the unit is of another dimension"),
        ({"texture.period": "2mm:1mm:4"}, "", "START must be less than STOP: it is empty"),
        ({"texture.period": "1mm:1mm:4"}, "", "START must be less than STOP: it is empty"),
        ({"texture.period": "1mm:2mm"}, "", "must be START:STOP:COUNT"),
        ({"texture.period": "1mm:2mm:0"}, "", "must be START:STOP:COUNT"),
        ({"texture.period": "1mm:2mm:1"}, "", "and two values or more"),
        ({"texture.period": "1mm:2mm:3lin"}, "", "must be START:STOP:COUNT"),
        ({"texture.amplitude": "0mm:2mm:3log"}, "", "START must be positive for equal ratios"),
        ({"texture.period": "-1mm:2mm:3"}, "", "must not be negative"),
        ({"texture.period": ""}, "", "texture.period needs values"),
        ({"texture.period": "1mm,0.001m"}, "", "texture.period names a value twice"),
        ({"device": "touch", "device.id": "omega.3"}, "", "names a key twice"),
        ({"device": "tuch,omega.3"}, "", "did you mean 'touch'"),
        ({"surface.law": "A,Q"}, "", "is unknown: 'Q'"),
        ({"device.delay_samples": "0:1:3"}, "", "must be a whole number"),
        ({"texture.period": "1mm:2mm:4"}, "sobol:8", "or START:STOP:log in a design"),
        ({"texture.period": "1mm:2mm"}, "sobol:100", "N a power of two, such as sobol:128"),
        ({"texture.period": "1mm:2mm"}, "halton:8", "must be sobol:N"),
        ({"texture.period": "1mm,2mm"}, "sobol:8", "needs a range"),
        ({}, "", "vary is missing"),
    ],
)  # fmt: skip
def test_bad_values_are_one_line(vary: dict[str, str], design: str, words: str) -> None:
    with pytest.raises(ParameterError) as caught:
        plan(vary, design=design)
    assert words in str(caught.value)
    assert "\n" not in str(caught.value)


def test_bad_runs_options_and_laws() -> None:
    vary = {"texture.period": "1mm,2mm"}
    with pytest.raises(ParameterError, match="did you mean 'limits'"):
        make_plan(SCENE, vary, "limit")
    with pytest.raises(ParameterError, match=r"sped is unknown; did you mean 'speed'"):
        make_plan(SCENE, vary, "limits", options={"sped": 1.0})
    with pytest.raises(ParameterError, match="laws do not apply to limits"):
        make_plan(SCENE, vary, "limits", laws="AB")
    with pytest.raises(ParameterError, match=r"laws cannot be given while surface\.law is varied"):
        make_plan(SCENE, {"surface.law": "A,B"}, "compare", laws="AB")
