"""Short studies for tests, and a screen whose keys are scripted."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from asperity.studies.live.player import LoopPlayer
from asperity.studies.live.screens import GO_ON, View
from asperity.studies.study_file import Study, load_study

SCENE = """
[texture]
kind = "sinusoid"
amplitude = "0.1 mm"
period = "2 mm"
[surface]
law = "C"
stiffness = "100 N/m"
[device]
id = "touch"
"""
HEAD = """
[study]
kind = "comparison"
question = "Which one is rougher?"
interval = "0.2 s"
"""
FACTORS = '\n[vary]\n"surface.stiffness" = ["61.5 N/m", "83.5 N/m", "97.5 N/m"]\n'
ONCE = "\n[method]\nrepeats = 1\n"
COMPARISON = HEAD + FACTORS + ONCE + SCENE
RATING = COMPARISON.replace("comparison", "rating")
ONSET = f"""
[study]
kind = "onset"
question = "Raise it until it buzzes."
{FACTORS.replace("surface.stiffness", "texture.amplitude").replace("N/m", "um")}
[method]
level = "surface.stiffness"
range = ["20 N/m", "80 N/m"]
series = 2
{SCENE}
"""


def make_study(folder: Path, text: str = COMPARISON) -> Study:
    path = folder / "study.toml"
    path.write_text(text)
    return load_study(path)


class FakePlayer(LoopPlayer):
    """A player without a loop, which notes what is rendered."""

    def __init__(self) -> None:
        self.calls: list[Any] = []
        self._time = 0.0

    def start(self) -> None:
        self.calls.append("start")

    def stop(self) -> None:
        self.calls.append("stop")

    def begin_trial(self, path: Path, trial: int, metadata: Mapping[str, Any]) -> None:
        self.calls.append(("begin", trial))
        self.metadata, self.path = dict(metadata), path

    def render(self, values: Mapping[str, Any] | None, interval: int) -> None:
        self.calls.append(("render", values and dict(values), interval))
        self._time = 0.0

    def elapsed(self) -> float:
        self._time += 0.06  # a part of the interval
        return self._time

    def end_trial(self, answer: float, response_time: float) -> None:
        self.calls.append(("end", answer))
        assert response_time >= 0.0


class ScriptedScreen:
    """A screen whose keys follow from the view; what is shown is kept."""

    def __init__(self, press: Callable[[View, int], str | None]) -> None:
        self.views: list[View] = []
        self._press = press

    def show(self, view: View) -> None:
        self.views.append(view)

    def read_key(self, _timeout: float) -> str | None:
        return self._press(self.views[-1], len(self.views))


def answer_with(key: str) -> Callable[[View, int], str | None]:
    """Return a script that goes on where it can, and presses a key at each question."""

    def press(view: View, _count: int) -> str | None:
        known = dict(view.keys)
        return key if key in known else GO_ON if GO_ON in known else None

    return press
