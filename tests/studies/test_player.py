"""A real loop on the simulated device: ramps, recordings, and what they do not reveal."""

from __future__ import annotations

import time
from contextlib import ExitStack
from pathlib import Path

import numpy as np
import pytest
from tests.studies.study_texts import COMPARISON, make_study

from asperity.core.errors import ParameterError
from asperity.recording.recording import Recording, open_recording
from asperity.studies.live.player import LoopPlayer, Stimuli

STIFFNESSES = (61.5, 97.5)


def render(player: LoopPlayer, stiffness: float | None, interval: int, seconds: float) -> None:
    """Render a stimulus, or the wall, with all of its force for a time."""
    player.render(stiffness and {"surface.stiffness": stiffness}, interval)
    end = time.monotonic() + 60.0
    while player.elapsed() < seconds:
        assert time.monotonic() < end


@pytest.fixture(scope="module")
def trial(tmp_path_factory: pytest.TempPathFactory) -> Recording:
    """A recorded trial with two intervals, each of 0.2 s at least."""
    folder = tmp_path_factory.mktemp("player")
    stimuli = Stimuli(make_study(folder))
    path = folder / "trial.mcap"
    player = LoopPlayer(stimuli, stimuli.check_all())
    with ExitStack() as stack:
        stack.callback(player.stop)
        player.start()
        player.begin_trial(path, 7, {"codes": ["ABCDEF", "GHIJKL"]})
        for number, stiffness in enumerate(STIFFNESSES, start=1):
            render(player, stiffness, number, 0.2)
        render(player, None, 0, 0.01)
        player.end_trial(2.0, 0.5)
    return open_recording(path)


def test_each_interval_is_recorded_with_all_of_its_force(trial: Recording) -> None:
    interval, share = trial["interval"], trial["share"]
    assert trial.is_complete
    assert set(trial["trial"]) == {7.0}
    for number in (1, 2):
        rows = interval == number
        assert np.count_nonzero(rows) >= 200
        assert share[rows].min() > 0.99
    changes = np.flatnonzero(np.diff(interval))
    assert [interval[at + 1] for at in changes] == [1.0, 0.0, 2.0, 0.0]


def test_surfaces_change_by_ramps(trial: Recording) -> None:
    share, interval = trial["share"], trial["interval"]
    between = share[interval == 0.0]
    assert between.min() < 0.01
    ramp, period = 0.25, 1e-3
    assert np.abs(np.diff(share)).max() <= 1.01 * period / ramp


def test_the_force_is_that_of_the_stimulus(trial: Recording) -> None:
    """Law C pushes up by the stiffness times the depth, at the position that the encoder reads."""
    step = 55e-6
    x, z = (step * np.round(trial[name] / step) for name in "xz")
    depth = np.maximum(0.1e-3 * np.sin(2.0 * np.pi * x / 2e-3) - z, 0.0)
    for number, stiffness in enumerate(STIFFNESSES, start=1):
        rows = trial["interval"] == number
        assert np.count_nonzero(depth[rows] > 20e-6) > 20
        np.testing.assert_allclose(trial["commanded z"][rows], stiffness * depth[rows], atol=1e-9)


def test_the_answer_is_the_last_event(trial: Recording) -> None:
    answer, seconds = trial["answer"], trial["response time"]
    assert (answer[-1], seconds[-1]) == (2.0, 0.5)
    assert np.isnan(answer[trial["interval"] > 0]).all()
    assert trial.metadata["codes"] == ["ABCDEF", "GHIJKL"]


def test_a_recording_reveals_no_stimulus(trial: Recording) -> None:
    content = trial.path.read_bytes()
    for secret in (b"sinusoid", b"stiffness", b'law"', b"61.5", b"97.5"):
        assert secret not in content


def test_a_stimulus_above_its_limit_is_not_rendered(tmp_path: Path) -> None:
    stimuli = Stimuli(make_study(tmp_path, COMPARISON))
    player = LoopPlayer(stimuli, stimuli.check_all())
    with ExitStack() as stack:
        stack.callback(player.stop)
        player.start()
        player.begin_trial(tmp_path / "trial.mcap", 1, {})
        with pytest.raises(ParameterError, match="is refused"):
            player.render({"surface.stiffness": 900.0}, 1)
        before = player.elapsed()
        while player.elapsed() < before + 0.05:  # the wall goes on
            pass
    recorded = open_recording(tmp_path / "trial.mcap")
    assert recorded.is_complete
    assert set(recorded["interval"]) == {0.0}
