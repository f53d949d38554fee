"""Grips: impedance, thresholds, files."""

from __future__ import annotations

import math
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.perception.grip import Grip, load_grip, parse_grip

PEN = load_grip()


def test_example_of_the_theory() -> None:
    """MATH section 11: behind 45 g, 200 N/m and 2 N s/m leave 1.0 of 14 mN at 100 Hz."""
    frequency = np.array([100.0])
    motion = 14e-3 * PEN.compliance(frequency, 0.045)
    assert motion == pytest.approx([0.8e-6], rel=0.02)
    assert motion / PEN.compliance(frequency) == pytest.approx([1.0e-3], rel=0.03)


def test_compliance_is_that_of_the_differential_equation() -> None:
    """The steady state of (M + m) x'' + (B + b) x' + (K + k) x = sin ωt, integrated."""
    from scipy.integrate import solve_ivp

    grip = Grip("test", 300.0, 3.0, 0.02, (10.0, 100.0), (1e-7, 1e-8), (1e-6, 1e-7), {})
    mass, damping, wall, f = 0.08, 1.5, 900.0, 37.0
    omega = 2.0 * math.pi * f

    def rate(t: float, state: np.ndarray) -> list[float]:
        x, v = state
        force = math.sin(omega * t) - (damping + 3.0) * v - (wall + 300.0) * x
        return [v, force / (mass + 0.02)]

    end = 1.0 + 2.0 / f
    times = np.linspace(1.0, end, 4001)
    found = solve_ivp(rate, (0.0, end), [0.0, 0.0], t_eval=times, rtol=1e-10, atol=1e-14)
    expected = grip.compliance(np.array([f]), mass, damping, wall)[0]
    assert np.ptp(found.y[0]) / 2.0 == pytest.approx(expected, rel=1e-5)


def test_thresholds_pass_through_their_points_and_are_straight_in_logarithms() -> None:
    lower, upper = PEN.threshold(np.array(PEN.frequency))
    np.testing.assert_allclose(lower, PEN.unnoticed, rtol=1e-12)
    np.testing.assert_allclose(upper, PEN.felt, rtol=1e-12)
    low, high = PEN.threshold(math.sqrt(40.0 * 200.0))
    assert low == pytest.approx(math.sqrt(0.25e-6 * 0.01e-6))
    assert high == pytest.approx(10.0 * low)
    assert PEN.threshold(1.0)[1] == pytest.approx(PEN.felt[0])
    known = PEN.is_known(np.array([10.0, 39.9, 40.0, 200.0, 500.0, 501.0]))
    assert known.tolist() == [False, False, True, True, True, False]


TABLE = {
    "stiffness": "100 N/m",
    "damping": "1 N*s/m",
    "mass": "5 g",
    "thresholds": {
        "points": [
            {"frequency": "10 Hz", "unnoticed": "1 um", "felt": "2 um"},
            {"frequency": "100 Hz", "unnoticed": "0.1 um", "felt": "0.1 um"},
        ]
    },
}


def test_grip_of_a_file(tmp_path: Path) -> None:
    path = tmp_path / "mine.toml"
    text = PEN_FILE.read_text("utf-8").replace('"200 N/m"', '"350 N/m"')
    path.write_text(text, "utf-8")
    assert load_grip(path).stiffness == 350.0
    assert parse_grip(TABLE, "mine").mass == pytest.approx(5e-3)


PEN_FILE = Path(__file__).parents[2] / "src/asperity/perception/grips/pen_grip.toml"


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stiffness": "0 N/m"}, "stiffness must be positive"),
        ({"damping": "-1 N*s/m"}, "damping must be at least 0"),
        ({"mass": None}, r"needs mass \[kg\]"),
        ({"stifness": "1 N/m"}, "unknown keys: stifness"),
        ({"thresholds": {}}, "two or more ascending frequencies"),
        ({"thresholds": {"points": [{"frequency": "1 Hz"}]}}, "each threshold needs"),
        (
            {
                "thresholds": {
                    "points": [
                        {"frequency": "0 Hz", "unnoticed": "1 um", "felt": "1 um"},
                        {"frequency": "2 Hz", "unnoticed": "1 um", "felt": "1 um"},
                    ]
                }
            },
            "ascending frequencies",
        ),
        ({"thresholds": {"points": TABLE["thresholds"]["points"][::-1]}}, "ascending frequencies"),
        (
            {
                "thresholds": {
                    "points": [
                        {"frequency": "1 Hz", "unnoticed": "2 um", "felt": "1 um"},
                        {"frequency": "2 Hz", "unnoticed": "1 um", "felt": "1 um"},
                    ]
                }
            },
            "0 < unnoticed <= felt",
        ),
    ],
)
def test_wrong_grips_are_refused(change: dict[str, object], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        parse_grip(TABLE | change, "mine.toml")


@pytest.mark.parametrize(
    ("change", "message"),
    [
        ({"stiffness": 0.0}, r"grip mine: stiffness must be positive \[N/m\], got 0.0"),
        ({"stiffness": math.inf}, "stiffness must be positive"),
        ({"damping": math.nan}, "damping must be at least 0"),
        ({"mass": -1e-9}, r"mass must be at least 0 \[kg\]"),
        ({"frequency": (math.nan, 100.0)}, "ascending frequencies"),
        ({"frequency": (10.0, 100.0, 200.0)}, "0 < unnoticed <= felt"),
        ({"felt": (1e-6, math.nan)}, "0 < unnoticed <= felt"),
    ],
)
def test_grip_of_zero_stiffness_is_refused_in_python_too(
    change: dict[str, Any], message: str
) -> None:
    """A slow force would move such a hand without end, and NaN would read as "not felt"."""
    levels = {"frequency": (10.0, 100.0), "unnoticed": (1e-7, 1e-8), "felt": (1e-7, 1e-7)}
    numbers: dict[str, Any] = {"stiffness": 5e-324, "damping": 0.0, "mass": 0.0, **levels}
    Grip("mine", **numbers, sources={})
    with pytest.raises(ParameterError, match=message):
        Grip("mine", **(numbers | change), sources={})


def test_unknown_grip_is_refused_with_the_nearest() -> None:
    with pytest.raises(ParameterError, match="did you mean 'pen-grip'"):
        load_grip("pen_grip")
