"""Results of studies: scores for each participant and pooled, exclusions, and the tidy tables."""

from __future__ import annotations

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np

from asperity.core.display import Reportable
from asperity.core.errors import ParameterError
from asperity.core.files import to_plain_data
from asperity.studies.design import Answered, StudyDesign
from asperity.studies.methods import EXCLUSIONS, METHODS
from asperity.studies.statistics.scores import RESAMPLES, Score
from asperity.sweeps.table_files import TableFiles

if TYPE_CHECKING:
    from asperity.studies.study_store import TrialRecord

SCHEMA = 1
POOLED = "pooled"
_END = ("estimate", "lower", "upper")


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

    @property
    def metadata(self) -> dict[str, Any]:
        """The design."""
        return describe_design(self.design)

    def iterate_rows(self) -> Iterator[dict[str, Any]]:
        """Yield a row for each trial; ``used`` tells whether the statistics use it.

        The columns of the factors hold what differs, such as the pair of laws ``A / C``.
        """
        kind = METHODS[self.design.kind]
        labels = kind.label(self.design)
        for one in self.trials:
            shown = one.presentation
            parts = enumerate(shown.intervals, 1)
            intervals = {f"interval {i} {key}": x for i, part in parts for key, x in part.items()}
            is_right = one.answer == shown.correct if shown.correct else None
            used = is_used(self.design, one) and one.participant not in self.excluded
            yield {
                "participant": one.participant, "run": one.run, "trial": one.trial,
                **(labels[shown.condition] if shown.condition < len(labels) else {}), **intervals,
                "answer": one.answer, "correct": is_right,
                "response time [s]": float(one.response_time), "started": one.started, "used": used,
            }  # fmt: skip


@dataclass(frozen=True, eq=False)
class StudyResult(Reportable, TableFiles):
    """What a study says.

    Attributes:
        design: the study with all options.
        trials: the trials with their answers.
        score: estimates of all participants, also of those who are excluded.
        excluded: why participants were excluded, by the rules of the design.
        omitted: number of trials of each participant that were left out.
        consistency: share of repeated questions that each participant answered alike.
        resamples: number of bootstrap samples.
    """

    design: StudyDesign
    trials: Sequence[TrialRecord]
    score: Score
    excluded: Mapping[str, str]
    omitted: Mapping[str, int]
    consistency: Mapping[str, float | None]
    resamples: int

    def __repr__(self) -> str:
        count = len(self.score.participants)
        return f"<StudyResult of {self.design.kind}, {count} participants>"

    @property
    def labels(self) -> Sequence[dict[str, Any]]:
        """What is estimated: conditions or pairs of conditions."""
        return METHODS[self.design.kind].label(self.design)

    @property
    def trial_table(self) -> TrialTable:
        """The trials, one in a row."""
        return TrialTable(self.design, self.trials, self.excluded)

    @property
    def included(self) -> tuple[str, ...]:
        """Participants who are not excluded."""
        return tuple(one for one in self.score.participants if one not in self.excluded)

    @cached_property
    def included_score(self) -> Score:
        """The estimates of the participants who are not excluded."""
        used = {one: answers for one, answers in self.answered.items() if one not in self.excluded}
        return METHODS[self.design.kind].score(self.design, used, 0)

    @cached_property
    def answered(self) -> dict[str, list[Answered]]:
        """The answers of each participant that the statistics use."""
        return group_answers(self.design, self.trials)

    @cached_property
    def pooled(self) -> list[tuple[float, float, float]]:
        """Mean over the participants and its interval, for each label."""
        return self.included_score.pool(self.resamples, self.design.seed)

    @cached_property
    def differences(self) -> list[tuple[float, float, float]]:
        """Differences of each label from the first (or from chance), with intervals."""
        return self.included_score.differences(self.resamples, self.design.seed)

    @property
    def metadata(self) -> dict[str, Any]:
        """The design."""
        return describe_design(self.design)

    def iterate_rows(self) -> Iterator[dict[str, Any]]:
        """Yield a row for each participant and label, then the pooled ones, then differences.

        Differences of a logarithmic quantity are ratios.
        """
        score, labels = self.score, self.labels
        for row, name in enumerate(score.participants):
            for column, label in enumerate(labels):
                head = {"participant": name, **label, "quantity": score.quantity}
                numbers = self._numbers(score.estimates[:, row, column].tolist())
                count = int(score.counts[row, column])
                yield {**head, **numbers, "answers": count, "interval": score.interval,
                       "excluded": self.excluded.get(name, "")}  # fmt: skip
        method = self.included_score.pooled_interval(self.resamples)
        compared = labels if score.chance is not None else labels[1:]
        word = "ratio to the first" if score.is_logarithmic else "difference from the first"
        word = word if score.chance is None else "difference from chance"
        for title, values, found in (
            (score.quantity, self.pooled, labels),
            (f"{score.quantity}, {word}", self.differences, compared),
        ):
            for value, label in zip(values, found, strict=False):
                yield {"participant": POOLED, **label, "quantity": title,
                       **self._numbers(value), "interval": method}  # fmt: skip

    def _numbers(self, values: Sequence[float]) -> dict[str, float | None]:
        """Return estimate and ends; what is unknown is ``None``."""
        scaled = self.score.to_scale(np.array(values)).tolist()
        return {
            name: one if np.isfinite(one) and np.isfinite(raw) else None
            for name, one, raw in zip(_END, scaled, values, strict=True)
        }

    def to_dict(self) -> dict[str, Any]:
        """Return plain data with a schema number."""
        rows = to_plain_data(self.table_rows())
        people = {"excluded": dict(self.excluded), "omitted": dict(self.omitted)}
        return {
            "schema": SCHEMA, "study": self.metadata, "rows": rows, **people,
            "consistency": dict(self.consistency),
        }  # fmt: skip


def describe_design(design: StudyDesign) -> dict[str, Any]:
    """Return a design as plain data."""
    content = {"kind": design.kind, "factors": design.factors, "options": design.options}
    plain = to_plain_data({**content, "question": design.question, "seed": design.seed})
    return dict(plain)


def exclusion_rules(design: StudyDesign) -> dict[str, float]:
    """Return the rules of a design, with their defaults."""
    rules = {one.name: one.default for one in EXCLUSIONS}
    given = {**rules, **design.options.get("exclusion", {})}
    return {name: float(value) for name, value in given.items() if value is not None}


def is_used(design: StudyDesign, trial: TrialRecord) -> bool:
    """Return whether a trial was answered neither too fast nor too slowly."""
    rules = exclusion_rules(design)
    longest = rules.get("longest_response", float("inf"))
    return rules["shortest_response"] <= trial.response_time <= longest


def group_answers(design: StudyDesign, trials: Sequence[TrialRecord]) -> dict[str, list[Answered]]:
    """Return the used answers of each participant, in the order of the first trials."""
    found: dict[str, list[Answered]] = {one.participant: [] for one in trials}
    for one in trials:
        if is_used(design, one):
            found[one.participant].append(Answered(one.presentation, one.answer))
    return found


def analyse(
    design: StudyDesign, trials: Sequence[TrialRecord], resamples: int = RESAMPLES
) -> StudyResult:
    """Return what the trials of a study say.

    Args:
        design: the study.
        trials: all trials of all participants.
        resamples: number of bootstrap samples.

    Raises:
        ParameterError: without trials.
    """
    if not trials:
        raise ParameterError("study", "has no trials yet")
    kind = METHODS[design.kind]
    design = kind.complete(design)
    answered = group_answers(design, trials)
    omitted = {one.participant: 0 for one in trials}
    for one in trials:
        omitted[one.participant] += not is_used(design, one)
    consistency = {name: kind.consistency(found) for name, found in answered.items()}
    excluded = {
        name: reason
        for name, found in answered.items()
        if (reason := _exclude(design, found, omitted[name], consistency[name]))
    }
    score = kind.score(design, answered, resamples)
    return StudyResult(design, trials, score, excluded, omitted, consistency, resamples)


def _exclude(
    design: StudyDesign, answered: Sequence[Answered], omitted: int, consistency: float | None
) -> str:
    """Return why a participant is excluded; empty if not."""
    rules = exclusion_rules(design)
    total = len(answered) + omitted
    if omitted > rules["largest_omission"] * total:
        return f"{omitted} of {total} trials left out"
    right = [one.is_correct for one in answered if one.presentation.correct]
    if right and sum(right) < rules["least_correct"] * len(right):
        return f"{sum(right)} of {len(right)} answers right"
    if consistency is not None and consistency < rules["least_consistency"]:
        return f"{consistency:.0%} of repeated questions answered alike"
    return ""
