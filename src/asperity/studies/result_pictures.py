"""Figures of a study: scores with intervals, and psychometric functions."""

from __future__ import annotations

import itertools
from collections.abc import Callable, Sequence

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from asperity.core.compiled import FloatArray
from asperity.report.pictures import style
from asperity.studies.design import TrialRecord, describe_source
from asperity.studies.scores import Score
from asperity.studies.study_result import StudyResult, label_text
from asperity.studies.thresholds import level_answers, log_levels

_MAX_GROUPS = 8
_FAINT = "0.6"
_STRONG = "C0"


def scores_figure(result: StudyResult) -> Figure:
    """Return the scores: a grey mark for each participant, and the pooled ones with intervals."""
    labels = [label_text(result, label) or "all" for label in result.labels]
    figure, axes = style.new_axes(7.0, 1.2 + 0.45 * len(labels))
    score = result.included_score
    places = np.arange(len(labels))
    values = _to_axis(score, score.values)
    offsets = np.linspace(-0.3, -0.1, len(values))
    for name, row, offset in zip(score.participants, values, offsets, strict=True):
        axes.plot(row, places + offset, "o", color=_FAINT, markersize=3, label=f"_{name}")
    axes.plot([], [], "o", color=_FAINT, markersize=3, label="a participant")
    axes.plot([], [], "s-", color=_STRONG, label="mean and its 95 % interval")
    for place, interval in enumerate(np.array(result.pooled)):
        value, *ends = _to_axis(score, interval)
        axes.plot(value, place, "s", color=_STRONG, label=f"_mean of {labels[place]}")
        if np.all(np.isfinite(interval)):
            axes.plot(ends, [place, place], color=_STRONG, linewidth=2)
    if score.is_logarithmic:
        axes.set_xscale("log")
    if score.chance is not None:
        axes.axvline(score.chance, color=_FAINT, linestyle=":", label="chance")
    axes.set_yticks(places, labels)
    axes.invert_yaxis()
    style.add_legend(figure, loc="outside lower left", ncols=3)
    unit = f" [{score.unit}]" if score.unit else ""
    style.label_axes(axes, f"{score.quantity}{unit}{_source(result)}", "")
    return figure


def _to_axis(score: Score, values: FloatArray) -> FloatArray:
    """Return values on the scale of the quantity; what is unbounded is not drawn."""
    return score.to_scale(np.where(np.isfinite(values), values, np.nan))


def functions_figure(result: StudyResult) -> Figure:
    """Return the shares of right answers of all used participants, and the function fitted to them.

    Levels are grouped, with as many answers in each.
    """
    levels = log_levels(result.design)
    name = str(result.design.options["level"])
    figure, axes = style.new_axes(7.0, 3.4)
    answered = list(itertools.chain.from_iterable(result.included.values()))
    for column, label in enumerate(result.labels):
        trials = [trial for trial in answered if trial.presentation.condition == column]
        if trials:
            _draw_function(axes, result, trials, f"C{column % 10}", label_text(result, label))
    axes.axhline(levels.guess, color=_FAINT, linestyle=":", label="chance")
    axes.set_xscale("log")
    axes.set_ylim(0.0, 1.03)
    axes.yaxis.set_major_locator(MaxNLocator(5))
    style.add_legend(axes)
    text = f"{name} above {levels.base:.3g}" if levels.base else name
    style.label_axes(axes, f"{text} (SI){_source(result)}", "share of right answers")
    return figure


def _source(result: StudyResult) -> str:
    """Return a second line of a label for answers that are not of people at a device."""
    return f"\n{describe_source(result.simulated)}" if result.simulated else ""


def _draw_function(
    axes: Axes, result: StudyResult, trials: Sequence[TrialRecord], colour: str, label: str
) -> None:
    """Draw the function of the posterior's mean, and the shares of groups of levels."""
    levels = log_levels(result.design)
    x, right = level_answers(result.design, trials)
    thresholds, slopes, share = levels.posterior(x, right)
    at = np.linspace(*levels.ends, 200)
    each: FloatArray = levels.probability(at[:, None, None], thresholds[:, None], slopes)
    axes.plot(np.exp(at), (each * share).sum(axis=(1, 2)), colour, label=label or "all")
    groups = np.array_split(np.argsort(x), min(_MAX_GROUPS, len(x)))
    middles = [np.exp(x[group].mean()) for group in groups]
    axes.plot(
        middles,
        [right[group].mean() for group in groups],
        "o",
        color=colour,
        alpha=0.6,
        label="_shares",
    )


FIGURES: dict[str, Callable[[StudyResult], Figure]] = {
    "Scores": scores_figure,
    "Psychometric functions": functions_figure,
}
"""Figures of the report by the titles of their sections."""
