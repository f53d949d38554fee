"""Results of studies: scores for each participant and pooled, exclusions, and the tidy tables."""

from __future__ import annotations

import math
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from functools import cached_property
from typing import Any

import numpy as np

from asperity.core.display import Reportable, TableFiles
from asperity.core.errors import ParameterError
from asperity.core.files import attributes_to_dict, to_plain_data
from asperity.core.units import count_text, format_quantity
from asperity.studies.design import StudyDesign, TrialRecord, describe_source
from asperity.studies.methods import EXCLUSIONS, METHODS
from asperity.studies.scores import Interval, Score

SCHEMA = 1
POOLED = "pooled"
_END = ("estimate", "lower", "upper")
_DESIGN = ("kind", "factors", "options", "question", "seed")


@dataclass(frozen=True)
class TrialTable(TableFiles):
    """The trials of a study, one in a row.

    Attributes:
        design: the study with all options.
        trials: the trials.
        excluded: why participants were excluded.
    """

    design: StudyDesign
    trials: Sequence[TrialRecord]
    excluded: Mapping[str, str]

    def iterate_rows(self) -> Iterator[dict[str, Any]]:
        """Yield a row for each trial; ``used`` tells whether the statistics use it.

        The columns of the factors hold what was presented, such as the pair of laws ``A / C``.
        """
        for trial in self.trials:
            presentation = trial.presentation
            intervals: dict[str, Any] = {}
            for number, interval in enumerate(presentation.intervals, 1):
                intervals |= {f"interval {number} {key}": x for key, x in interval.items()}
            values = {
                key: " / ".join(dict.fromkeys([str(part[key]) for part in presentation.intervals]))
                for key in self.design.factors
            }
            is_correct = trial.is_correct if presentation.correct else None
            yield {
                "participant": trial.participant,
                "run": trial.run,
                "trial": trial.trial,
                **values,
                **intervals,
                "answer": trial.answer,
                "correct": is_correct,
                "response time [s]": float(trial.response_time),
                "started": trial.started,
                "simulated": trial.simulated,
                "used": is_used(self.design, trial) and trial.participant not in self.excluded,
            }


@dataclass(frozen=True, eq=False)
class StudyResult(Reportable, TableFiles):
    """What a study says.

    Attributes:
        design: the study with all options.
        trials: the trials with their answers.
        answered: the answers of each participant that the statistics use.
        omitted: number of trials of each participant that were left out.
        consistency: share of repeated questions that each participant answered alike.
        excluded: why participants were excluded, by the rules of the design.
        content: sections of the study file, with those of the scene.
    """

    design: StudyDesign
    trials: Sequence[TrialRecord]
    answered: Mapping[str, Sequence[TrialRecord]]
    omitted: Mapping[str, int]
    consistency: Mapping[str, float | None]
    excluded: Mapping[str, str]
    content: Mapping[str, Any] = field(default_factory=dict)

    def __repr__(self) -> str:
        return (
            f"<StudyResult of {self.design.kind}, {count_text(len(self.answered), 'participant')}>"
        )

    @property
    def simulated(self) -> str:
        """What was simulated, see :attr:`~asperity.studies.design.TrialRecord.simulated`."""
        return self.trials[0].simulated

    @property
    def labels(self) -> Sequence[dict[str, Any]]:
        """What is estimated: conditions or pairs of conditions."""
        return METHODS[self.design.kind].label(self.design)

    @property
    def trial_table(self) -> TrialTable:
        """The trials, one in a row."""
        return TrialTable(self.design, self.trials, self.excluded)

    @property
    def included(self) -> dict[str, Sequence[TrialRecord]]:
        """The answers of participants who are not excluded."""
        return {name: trials for name, trials in self.answered.items() if name not in self.excluded}

    @cached_property
    def score(self) -> Score:
        """The estimates of all participants, also of those who are excluded."""
        return METHODS[self.design.kind].score(self.design, self.answered)

    @cached_property
    def included_score(self) -> Score:
        """The estimates of the participants who are not excluded."""
        return METHODS[self.design.kind].score(self.design, self.included)

    @cached_property
    def pooled(self) -> list[Interval]:
        """Mean over the participants and its interval, for each label."""
        return self.included_score.pool(self.design.seed)

    @cached_property
    def differences(self) -> list[Interval]:
        """Differences of each label from the first (or from chance), with intervals."""
        return self.included_score.differences(self.design.seed)

    def iterate_rows(self) -> Iterator[dict[str, Any]]:
        """Yield a row for each participant and label, then the pooled ones, then differences.

        Differences of a logarithmic quantity are ratios. An estimate that is unknown states why in
        ``outside levels``: above or below them, or not bounded.
        """
        score = self.score
        labels = self.labels
        for row, name in enumerate(score.participants):
            for column, label in enumerate(labels):
                yield {
                    "participant": name,
                    **label,
                    "quantity": score.quantity,
                    "unit": score.unit,
                    **self._numbers(score.estimates[:, row, column].tolist(), score.limits),
                    "answers": int(score.counts[row, column]),
                    "interval": score.interval,
                    "excluded": self.excluded.get(name, ""),
                    "simulated": self.simulated,
                }
        word = "ratio to the first" if score.is_logarithmic else "difference from the first"
        compared = f"{score.quantity}, {word}", "", None, self.differences, labels[1:]
        if score.chance is not None:
            title = f"{score.quantity}, difference from chance"
            compared = title, "", None, self.differences, labels
        pooled = score.quantity, score.unit, score.limits, self.pooled, labels
        for title, unit, limits, values, value_labels in (pooled, compared):
            for value, label in zip(values, value_labels, strict=True):
                yield {
                    "participant": POOLED,
                    **label,
                    "quantity": title,
                    "unit": unit,
                    **self._numbers(value, limits),
                    "interval": self.included_score.pooled_interval,
                    "simulated": self.simulated,
                }

    def _numbers(
        self, values: Sequence[float], limits: tuple[float, float] | None
    ) -> dict[str, Any]:
        """Return estimate and ends; what is unknown is ``None``, with what limits say of it."""
        scaled = self.score.to_scale(np.array(values)).tolist()
        pairs = zip(_END, scaled, values, strict=True)
        numbers = {name: number if math.isfinite(raw) else None for name, number, raw in pairs}
        return {**numbers, "outside levels": self._outside_text(values[0], limits)}

    def _outside_text(self, estimate: float, limits: tuple[float, float] | None) -> str:
        """Return where an estimate lies that the levels do not bound; empty for others."""
        if limits is None or math.isfinite(estimate):
            return ""
        if math.isnan(estimate):  # outside for some participants
            return "not bounded"
        low, high = self.score.to_scale(np.array(limits)).tolist()
        if estimate > 0.0:
            return f"above {format_quantity(high, self.score.unit)}"
        return f"below {format_quantity(low, self.score.unit)}"

    def to_dict(self) -> dict[str, Any]:
        """Return plain data with a schema number."""
        people = attributes_to_dict(self, "excluded", "omitted", "consistency")
        rows = to_plain_data(self.table_rows())
        study = attributes_to_dict(self.design, *_DESIGN) | {"simulated": self.simulated}
        return {"schema": SCHEMA, "study": study, "rows": rows, **people}


def label_text(result: StudyResult, row: Mapping[str, Any]) -> str:
    """Return the condition of a row."""
    values = [row[key] for key in result.design.factors]
    return ", ".join(f"{x:.4g}" if isinstance(x, float) else str(x) for x in values)


def exclusion_rules(design: StudyDesign) -> dict[str, float]:
    """Return the rules of a design, with their defaults; a rule without a limit is infinite."""
    rules = {rule.name: rule.default for rule in EXCLUSIONS if rule.default is not None}
    unlimited = {rule.name: math.inf for rule in EXCLUSIONS}
    return {**unlimited, **rules, **design.options.get("exclusion", {})}


def is_used(design: StudyDesign, trial: TrialRecord) -> bool:
    """Return whether a trial was answered neither too fast nor too slowly."""
    rules = exclusion_rules(design)
    return rules["shortest_response"] <= trial.response_time <= rules["longest_response"]


def analyse(
    design: StudyDesign, trials: Sequence[TrialRecord], content: Mapping[str, Any] | None = None
) -> StudyResult:
    """Return what the trials of a study say.

    Args:
        design: the study.
        trials: all trials of all participants.
        content: sections of the study file, for the report.

    Raises:
        ParameterError: without trials, or for answers of people and simulated ones together.
    """
    if not trials:
        raise ParameterError("study", "has no trials yet")
    codes = {trial.simulated: trial.participant for trial in trials}
    if len(codes) > 1:
        sources = [f"{describe_source(source)}, such as {code}" for source, code in codes.items()]
        raise ParameterError("study", f"must not mix answers of {', and of '.join(sources)}")
    kind = METHODS[design.kind]
    design = kind.complete(design)
    answered: dict[str, list[TrialRecord]] = {trial.participant: [] for trial in trials}
    omitted = dict.fromkeys(answered, 0)
    for trial in trials:
        if is_used(design, trial):
            answered[trial.participant].append(trial)
        else:
            omitted[trial.participant] += 1
    consistency = {name: kind.consistency(records) for name, records in answered.items()}
    reasons = {
        name: _exclude(exclusion_rules(design), records, omitted[name], consistency[name])
        for name, records in answered.items()
    }
    excluded = {name: reason for name, reason in reasons.items() if reason}
    return StudyResult(design, trials, answered, omitted, consistency, excluded, content or {})


def _exclude(
    rules: Mapping[str, float], answered: Sequence[TrialRecord], omitted: int, share: float | None
) -> str:
    """Return why a participant is excluded; empty if not."""
    total = len(answered) + omitted
    if omitted > rules["largest_omission"] * total:
        return f"{omitted} of {total} trials left out"
    right = [trial.is_correct for trial in answered if trial.presentation.correct]
    if sum(right) < rules["least_correct"] * len(right):
        return f"{sum(right)} of {len(right)} answers right"
    if share is not None and share < rules["least_consistency"]:
        return f"{100.0 * share:.0f} % of repeated questions answered alike"
    return ""
