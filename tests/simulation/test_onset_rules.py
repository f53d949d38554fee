"""The rules by which an onset is found, on stand-ins for runs: what cycles is told."""

from __future__ import annotations

import math
import random
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from asperity.checks import FloatArray
from asperity.errors import ParameterError
from asperity.simulation import (
    Cartesian,
    Servo,
    SpringHand,
    Still,
    Strokes,
    find_onset,
    onset,
)
from asperity.simulation.ending import Ending
from asperity.simulation.kernels.body_functions import LANES
from asperity.simulation.onset import Onset, calms_down, cycles, ends_in_cycle, holds_still, offsets
from asperity.simulation.run import Ledger, Run, Stop
from asperity.simulation.trace import COLUMNS
from asperity.surface import Surface
from asperity.textures import Sinusoid

NAMES = [name for name, _unit in COLUMNS]
SURFACE = Surface(Sinusoid(0.2e-3, 2e-3), "A", max_depth=1e-3)


def run_of(velocity: list[float], supplied: list[float], lost: float = 1.0, stop: str = "") -> Run:
    """Return a run with velocities along x, the energy supplied, and what is lost each sample."""
    table = np.zeros((len(velocity), len(COLUMNS)))
    table[:, NAMES.index("vx")] = velocity
    table[:, NAMES.index("supplied x")] = supplied
    table[:, NAMES.index("lost")] = lost * np.arange(len(velocity))
    ledger = Ledger((0.0,) * 3, (0.0,) * 3, 0.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0)
    return Run(table, np.zeros(6), len(velocity), 1e-3, ledger, SURFACE, Stop(stop))


def lively(size: float = 1.0, share: float = 1.0, stop: str = "") -> Run:
    """Return a run that swings to and fro in its last quarter, fed with a share of its loss."""
    swing = [0.0] * 12 + [size, -size, size, -size]
    return run_of(swing, [share * i for i in range(16)], stop=stop)


@pytest.mark.parametrize(
    ("run", "ends"),
    [
        (lively(), True),
        (lively(share=0.0), False),  # restless, but on its own
        (lively(size=0.0), False),  # fed, but at rest
        (lively(size=0.0, share=0.0, stop="diverged"), True),
        (lively(stop="left the workspace"), True),
        (lively(share=0.0, stop="left the workspace"), False),
    ],
)
def test_a_cycle_is_restless_and_fed_or_diverged(run: Run, ends: bool) -> None:
    assert cycles(run, 0.5) is ends


def test_a_cycle_is_above_the_threshold() -> None:
    assert not cycles(lively(size=0.5), 0.5)
    assert cycles(lively(size=math.nextafter(0.5, 1.0)), 0.5)
    assert onset.CYCLE_SPEED == 15e-3


def test_only_the_last_quarter_counts() -> None:
    """What swung before, and what it was fed with before, does not."""
    before = run_of([0.0] * 8 + [1.0, -1.0] * 2 + [0.0] * 4, [float(i) for i in range(16)])
    assert not cycles(before, 0.5)
    supplied = [100.0 * i for i in range(12)] + [1100.0] * 4
    assert not cycles(run_of([0.0] * 12 + [1.0, -1.0] * 2, supplied), 0.5)
    later = [0.0] * 12 + [1.0, 2.0, 3.0, 4.0]
    assert cycles(run_of([0.0] * 12 + [1.0, -1.0] * 2, later), 0.5)


@pytest.mark.parametrize(
    ("quarters", "stop", "calmer"),
    [
        ((1.0, 0.89), "", True),
        ((1.0, 0.91), "", False),
        ((1.0, 1.5), "", False),
        ((1.0, 0.5), "left the workspace", False),
        ((2.0, 1.8), "", False),  # a tenth exactly is not less
    ],
)
def test_what_calms_down(quarters: tuple[float, float], stop: str, calmer: bool) -> None:
    third, last = quarters
    velocity = [9.0, -9.0] * 4 + [third, -third] * 2 + [last, -last] * 2
    assert calms_down(run_of(velocity, [0.0] * 16, stop=stop)) is calmer


class Told:
    """Runs that are restless as told, in the order of their durations."""

    def __init__(self, monkeypatch: pytest.MonkeyPatch, *speeds: float, stop: str = "") -> None:
        self.spans: list[float] = []
        self.speeds, self.stop = list(speeds), stop
        monkeypatch.setattr(onset, "restlessness", lambda run, quarter=3: run.speeds[quarter - 2])
        monkeypatch.setattr(onset, "cycles", lambda run, threshold: run.speeds[1] > threshold)

    def __call__(self, span: float) -> Any:
        self.spans.append(span)
        now = self.speeds[len(self.spans) - 1]
        before = self.speeds[max(len(self.spans) - 2, 0)]
        return SimpleNamespace(speeds=(before, now), stop=self.stop)


@pytest.mark.parametrize(
    ("speeds", "stop", "spans", "ends"),
    [
        ((1.0,), "", (0.5,), False),  # at the threshold: at rest
        ((1.1, 1.0), "", (0.5, 2.0), False),
        ((1.1, 1.1), "", (0.5, 2.0), True),  # steady: it need not go on
        ((2.0, 1.5, 1.2), "", (0.5, 2.0, 8.0), True),  # calmer each time, to the last
        ((2.0, 1.5, 0.9), "", (0.5, 2.0, 8.0), False),
        ((9.0,), "diverged", (0.5,), True),
    ],
)
def test_a_restless_run_is_made_longer(
    monkeypatch: pytest.MonkeyPatch, speeds: tuple[float, ...], stop: str,
    spans: tuple[float, ...], ends: bool,
) -> None:  # fmt: skip
    told = Told(monkeypatch, *speeds, stop=stop)
    found, _run = ends_in_cycle(told, 0.5, 1.0)
    assert (found, tuple(told.spans)) == (ends, spans)


def test_the_value_of_a_bracket() -> None:
    def value(quiet: float, cycling: float) -> float:
        return Onset("A", 0, quiet, cycling, 1, 1, (0.0,) * 3, (0.0,) * 3).value

    assert value(4.0, 9.0) == 6.0
    assert value(0.0, 9.0) == 9.0
    assert value(4.0, math.inf) == math.inf


def bracket(onset_at: float, low: float, high: float, width: float) -> tuple[Any, list[float]]:
    tried: list[float] = []

    def cycling_at(stiffness: float) -> bool:
        tried.append(stiffness)
        return stiffness >= onset_at

    return onset._bracket(cycling_at, low, high, width), tried


def test_the_search_goes_up_in_doubles_and_halves_the_ratio() -> None:
    found, tried = bracket(9.0, 1.0, 1000.0, 0.5)
    assert tried == pytest.approx([1.0, 2.0, 4.0, 8.0, 16.0, math.sqrt(128.0)])
    assert found == (8.0, pytest.approx(math.sqrt(128.0)))
    quiet, cycling = bracket(9.0, 1.0, 1000.0, 1e-6)[0]
    assert quiet < 9.0 <= cycling <= quiet * (1.0 + 1e-6)


def test_a_bracket_as_wide_as_asked_is_narrow_enough() -> None:
    found, tried = bracket(9.0, 1.0, 1000.0, 1.0)
    assert (found, len(tried)) == ((8.0, 16.0), 5)


def test_the_highest_stiffness_is_tried_and_none_above() -> None:
    assert bracket(1e9, 1.0, 10.0, 0.1) == ((10.0, math.inf), [1.0, 2.0, 4.0, 8.0, 10.0])
    assert bracket(1e9, 1.0, 8.0, 0.1) == ((8.0, math.inf), [1.0, 2.0, 4.0, 8.0])
    found, tried = bracket(9.5, 1.0, 10.0, 2.0)
    assert (found, tried[-1]) == ((8.0, 10.0), 10.0)


def test_what_cycles_at_once_has_no_quiet_end() -> None:
    assert bracket(0.5, 1.0, 10.0, 0.1) == ((0.0, 1.0), [1.0])


@pytest.mark.parametrize("seed", range(60))
def test_from_near_the_same_bracket_is_found_with_fewer_questions(seed: int) -> None:
    draw = random.Random(seed)
    onset_at = 10.0 ** draw.uniform(-1.0, 5.5)
    near = onset_at * 2.0 ** draw.uniform(-3.0, 3.0)
    ends = (10.0 ** draw.uniform(0.0, 1.0), 10.0 ** draw.uniform(4.5, 5.0))
    width = 10.0 ** draw.uniform(-3.0, 0.0)
    climbed, all_tried = bracket(onset_at, *ends, width)
    tried: list[float] = []

    def cycling_at(stiffness: float) -> bool:
        tried.append(stiffness)
        return stiffness >= onset_at

    assert onset._bracket(cycling_at, *ends, width, near) == climbed
    assert len(tried) == len(set(tried)) <= len(all_tried) + 3
    assert set(tried) - set(all_tried) <= {k for k in tried if k >= onset_at or k == ends[1]}


def test_from_near_a_window_farther_down_is_passed_over() -> None:
    def cycling_at(stiffness: float) -> bool:
        return 3.0 <= stiffness < 9.0 or stiffness >= 700.0

    assert onset._bracket(cycling_at, 1.0, 1e6, 1.0) == (2.0, 4.0)
    assert onset._bracket(cycling_at, 1.0, 1e6, 1.0, 300.0) == (512.0, 1024.0)
    assert onset._bracket(cycling_at, 1.0, 1e6, 1.0, 8.5) == (2.0, 4.0)


@pytest.mark.parametrize("near", [0.0, -1.0, 1e-9, 1e9])
def test_wherever_it_is_expected_the_onset_is_found(near: float) -> None:
    assert onset._bracket(lambda k: k >= 9.0, 1.0, 1000.0, 1.0, near) == (8.0, 16.0)


# --- the whole search, on runs that are told ------------------------------------------------------


PLANT, SERVO = Cartesian(0.05, 3.0), Servo(1e-3)
HAND = SpringHand((100.0, 100.0, 0.0), 1.0, 0.0, (0.0, 0.0, -1.0))


@pytest.fixture
def told(monkeypatch: pytest.MonkeyPatch) -> list[tuple[float, float]]:
    """Starts cycle from 100 N/m on, and from 200 N/m all; they reach as far as they are stiff."""
    seen: list[tuple[float, float]] = []

    def one(k: float, shift: float) -> tuple[bool, Any]:
        seen.append((k, shift))
        reach = np.array([[-shift, 0.0, -k], [shift, 0.0, k]])
        return k >= (100.0 if shift > 1.4e-3 else 200.0), SimpleNamespace(position=reach)

    def together(surface: Surface, *rest: Any) -> Any:
        return [one(surface.stiffness, float(shift)) for shift in rest[-1][:, 0]]

    def end(told: Any, count: int, _duration: float, _threshold: float) -> Any:
        assert len(told) == count <= LANES
        return told

    monkeypatch.setattr(onset, "together", together)
    monkeypatch.setattr(onset, "end_in_cycles", end)
    return seen


def search(starts: int = 4, **more: Any) -> Onset:
    still = Still((0.0, 0.0, 0.0))
    return find_onset(SURFACE, PLANT, HAND, SERVO, still, starts=starts, **more)


def test_one_start_that_cycles_is_enough(told: list[tuple[float, float]]) -> None:
    found = search(lowest=90.0, tolerance=0.05)
    assert found.quiet < 100.0 <= found.cycling <= 1.05 * found.quiet
    assert (found.starts, found.cycles) == (4, 1)
    # The last stiffness is looked at from every start, once, and where they got is kept.
    assert sorted(shift for k, shift in told if k == found.cycling) == pytest.approx(
        [0.0, 0.5e-3, 1e-3, 1.5e-3]
    )
    assert found.low == pytest.approx((-1.5e-3, 0.0, -found.cycling))
    assert found.high == pytest.approx((1.5e-3, 0.0, found.cycling))


def test_a_start_that_cycles_ends_its_stiffness(told: list[tuple[float, float]]) -> None:
    found = search(lowest=300.0)
    assert (found.quiet, found.cycling, found.cycles) == (0.0, 300.0, 4)
    # No start is run twice, not for where the others get to either.
    assert told == [(300.0, pytest.approx(i * 0.5e-3)) for i in range(4)]
    told.clear()
    search(lowest=50.0, near=800.0)
    assert [shift for k, shift in told if k == 800.0] == [0.0]


def test_the_start_that_cycled_last_is_tried_first(told: list[tuple[float, float]]) -> None:
    """Alone, and the others as many at a time as go side by side."""
    search(starts=24, lowest=75.0, near=75.0, tolerance=0.1)
    tried = {k: [round(shift * 12e3) for j, shift in told if j == k] for k, _shift in told}
    assert tried[75.0] == list(range(24))
    assert tried[150.0] == list(range(24))  # the third group cycles: from 17 on
    middle = math.sqrt(75.0 * 150.0)
    first = told.index((middle, pytest.approx(17 / 12e3)))
    assert told[first + 1][0] != middle


@pytest.mark.usefixtures("told")
def test_where_nothing_cycles_the_highest_stiffness_is_looked_at() -> None:
    calls: list[int] = []
    found = search(lowest=10.0, highest=50.0, progress=lambda: calls.append(1))
    assert (found.quiet, found.cycling, found.cycles) == (50.0, math.inf, 0)
    assert found.high[2] == 50.0
    assert len(calls) == 5  # 10, 20, 40, 50, and 50 from every start


@pytest.mark.usefixtures("told")
@pytest.mark.parametrize(
    ("more", "named"),
    [
        ({"lowest": 10.0, "highest": 10.0}, "lowest"),
        ({"tolerance": 0.99e-9}, "tolerance"),
        ({"duration": 15.9e-3}, "duration"),
    ],
)
def test_the_border_of_what_is_refused(more: dict[str, float], named: str) -> None:
    with pytest.raises(ParameterError, match=named):
        search(**more)


@pytest.mark.usefixtures("told")
def test_the_border_of_what_is_taken() -> None:
    search(tolerance=1e-9, lowest=90.0, duration=16e-3)
    still = Still((0.0, 0.0, 0.0))
    assert find_onset(SURFACE, PLANT, HAND, SERVO, still, starts=1).starts == 1
    with pytest.raises(ParameterError, match="starts"):
        find_onset(SURFACE, PLANT, HAND, SERVO, still, starts=10_001)


def test_a_hand_must_be_at_rest_in_the_second_half() -> None:
    way = Strokes((0.0, 0.0, 0.0), (0.1, 0.0, 0.0), 0.1, count=1)  # 1 s
    assert holds_still(way, 2.0)
    assert not holds_still(way, 1.9)


def test_offsets_do_not_reach_the_period_again() -> None:
    shifts: FloatArray = offsets(SURFACE, 5)
    np.testing.assert_allclose(shifts[:, 0], np.arange(5) * 0.4e-3, atol=1e-18)
    assert not shifts[:, 1:].any()


def test_an_ending_is_told_from_rows_as_they_come() -> None:
    """Whatever the parts: as from the last quarter of the whole table, column by its name."""
    rng, answers = np.random.default_rng(48), set()
    for rows in range(4, 64):
        table = rng.normal(size=(rows, len(COLUMNS)))
        ending, seen = Ending(rows), 0
        for part in np.split(table, np.sort(rng.integers(0, rows + 1, 3))):
            ending.see(part)
            seen += len(part)
            assert ending.known == (seen == rows)
        moving = table[rows - rows // 4 :, [NAMES.index(f"v{axis}") for axis in "xyz"]]
        assert ending.restlessness == pytest.approx(np.std(moving, axis=0).sum(), abs=1e-15)
        change = dict(zip(NAMES, table[-1] - table[rows - max(rows // 4, 2)], strict=True))
        supplied = sum(change[f"supplied {axis}"] for axis in "xyz")
        assert ending.fed == (supplied > 0.2 * (change["lost"] - change["friction"]))
        answers.add(ending.fed)
    assert answers == {True, False}
