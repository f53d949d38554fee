"""Small studies for the tests."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from asperity.studies.design import Answered, Presentation, StudyDesign, Values
from asperity.studies.methods import METHODS
from asperity.studies.observers import Observer, simulate_run

LAWS = {"surface.law": ("A", "C", "D", "H")}
AMPLITUDE = "texture.amplitude"
LEVEL = {"level": AMPLITUDE, "range": [1e-6, 1e-4], "reference": 1e-12}
OPTIONS: dict[str, dict[str, Any]] = {
    "detection": LEVEL,
    "discrimination": {"level": AMPLITUDE, "range": [1.1e-5, 1e-4], "reference": 1e-5},
    "comparison": {},
    "rating": {},
    "axb": {},
    "onset": {"level": "surface.stiffness", "range": [100.0, 1000.0]},
}


@dataclass(frozen=True)
class Record:
    """A trial as a session records it."""

    participant: str
    run: int
    trial: int
    presentation: Presentation
    answer: str
    response_time: float = 1.0
    started: str = "2025-01-01T00:00:00"


def design_of(kind: str, seed: int = 1, **options: Any) -> StudyDesign:
    """Return a study of four laws with all options."""
    design = StudyDesign(kind, LAWS, {**OPTIONS[kind], **options}, "rougher?", seed, 4)
    return METHODS[kind].complete(design)


def strength(values: Values) -> float:
    """Return 1 in the middle of the levels, and twice that with law A."""
    level = float(values.get(AMPLITUDE, 1e-5)) / 1e-5 * values.get("surface.stiffness", 316.0) / 316
    return level * (2.0 if values["surface.law"] == "A" else 1.0)


def answers(
    design: StudyDesign, number: int = 0, seed: int = 5, **observer: float
) -> list[Answered]:
    """Return the answers of a simulated participant."""
    return simulate_run(design, number, Observer(**observer), strength, seed)


def records(design: StudyDesign, count: int, **observer: float) -> list[Record]:
    """Return the trials of simulated participants."""
    return [
        Record(f"P{number:02}", 1, i, one.presentation, one.answer)
        for number in range(count)
        for i, one in enumerate(answers(design, number, **observer))
    ]
