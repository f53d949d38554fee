"""The kinds of methods by name, and the rules by which trials and participants are excluded."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from asperity.core.arguments import read_arguments
from asperity.studies.design import Answered, Method, MethodKind, Presentation, StudyDesign
from asperity.studies.kinds.axb import label_pairs, run_axb, score_axb
from asperity.studies.kinds.comparison import pair_consistency, run_comparison, score_comparison
from asperity.studies.kinds.onset_search import run_onset, score_onset
from asperity.studies.kinds.rating import run_rating, score_rating
from asperity.studies.kinds.thresholds import ThresholdRun, label_conditions, score_thresholds

__all__ = [
    "EXCLUSIONS",
    "METHODS",
    "Answered",
    "Method",
    "MethodKind",
    "Presentation",
    "StudyDesign",
]

_FILE = Path(__file__).with_suffix(".toml")
_DETECTION = read_arguments(_FILE, "detection")
_DISCRIMINATION = {
    **_DETECTION,
    "reference": replace(_DETECTION["reference"], default_description="", required=True),
    "intervals": replace(_DETECTION["intervals"], default=3),
    "scale": replace(_DETECTION["scale"], default="difference"),
}

_KINDS = (
    MethodKind("detection", "level from which one interval is told from others",
               tuple(_DETECTION.values()), ThresholdRun, label_conditions, score_thresholds,
               has_function=True),
    MethodKind("discrimination", "difference from which one interval is told from others",
               tuple(_DISCRIMINATION.values()), ThresholdRun, label_conditions, score_thresholds,
               has_function=True),
    MethodKind("comparison", "which of two feels more so; Bradley–Terry scores",
               tuple(read_arguments(_FILE, "comparison").values()),
               run_comparison, label_conditions, score_comparison, pair_consistency),
    MethodKind("rating", "magnitude estimation or a Likert scale",
               tuple(read_arguments(_FILE, "rating").values()),
               run_rating, label_conditions, score_rating),
    MethodKind("axb", "which of two the one between them equals",
               tuple(read_arguments(_FILE, "axb").values()), run_axb, label_pairs, score_axb),
    MethodKind("onset", "a value is raised until it begins, and lowered until it ends",
               tuple(read_arguments(_FILE, "onset").values()),
               run_onset, label_conditions, score_onset),
)  # fmt: skip
METHODS: dict[str, MethodKind] = {one.name: one for one in _KINDS}
"""The kinds of methods by name."""
EXCLUSIONS = tuple(read_arguments(_FILE, "exclusion").values())
"""Rules by which trials and participants are excluded; they are stated before the study."""
