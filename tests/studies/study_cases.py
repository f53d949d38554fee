"""Small studies for the tests."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from asperity.studies.design import StudyDesign, TrialRecord, Values
from asperity.studies.methods import METHODS
from asperity.studies.simulated_participants import Observer, simulate_run

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
) -> list[TrialRecord]:
    """Return the answers of a simulated participant."""
    return simulate_run(design, number, Observer(**observer), strength, seed)


def records(design: StudyDesign, count: int, **observer: float) -> list[TrialRecord]:
    """Return the trials of simulated participants."""
    return [
        replace(one, participant=f"P{number:02}", response_time=1.0)
        for number in range(count)
        for one in answers(design, number, **observer)
    ]
