"""The kinds of methods by name, and the rules by which trials and participants are excluded."""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from asperity.core.arguments import Argument, read_arguments
from asperity.studies.design import MethodKind
from asperity.studies.kinds import pairs
from asperity.studies.kinds.adjustment import run_onset, score_onset
from asperity.studies.kinds.rating import run_rating, score_rating
from asperity.studies.kinds.thresholds import run_thresholds, score_thresholds

_FILE = Path(__file__).with_suffix(".toml")


def _options(name: str) -> tuple[Argument, ...]:
    return tuple(read_arguments(_FILE, name).values())


_DETECTION = read_arguments(_FILE, "detection")
_DISCRIMINATION = {
    **_DETECTION,
    "reference": replace(_DETECTION["reference"], default_description="", required=True),
    "intervals": replace(_DETECTION["intervals"], default=3),
    "scale": replace(_DETECTION["scale"], default="difference"),
}

_KINDS = (
    MethodKind("detection", "level from which one interval is told from others",
               tuple(_DETECTION.values()), run_thresholds, score_thresholds, has_function=True),
    MethodKind("discrimination", "difference from which one interval is told from others",
               tuple(_DISCRIMINATION.values()), run_thresholds, score_thresholds,
               has_function=True),
    MethodKind("comparison", "which of two feels more so; Bradley–Terry scores",
               _options("comparison"), pairs.run_comparison, pairs.score_comparison,
               consistency=pairs.pair_consistency),
    MethodKind("rating", "magnitude estimation or a Likert scale",
               _options("rating"), run_rating, score_rating),
    MethodKind("axb", "which of two the one between them equals",
               _options("axb"), pairs.run_axb, pairs.score_axb, pairs.label_pairs),
    MethodKind("onset", "a value is raised until it begins, and lowered until it ends",
               _options("onset"), run_onset, score_onset),
)  # fmt: skip
METHODS: dict[str, MethodKind] = {one.name: one for one in _KINDS}
"""The kinds of methods by name."""
EXCLUSIONS = _options("exclusion")
"""Rules by which trials and participants are excluded; they are stated before the study."""
