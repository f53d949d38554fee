"""Figures of a study: scores with intervals, and psychometric functions."""

from __future__ import annotations

import math
from collections.abc import Callable

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.ticker import MaxNLocator

from asperity.report.pictures import style
from asperity.studies.design import Answered
from asperity.studies.kinds.thresholds import log_levels, presented_level
from asperity.studies.statistics.psychometric import LogLevels, count_answers, fit_psychometric
from asperity.studies.study_result import StudyResult

_MAX_GROUPS = 8
_FAINT, _STRONG = "0.6", "C0"


def scores_figure(result: StudyResult) -> Figure:
    """Return the scores: a grey mark for each participant, and the pooled ones with intervals."""
    labels = [", ".join(_text(x) for x in label.values()) or "all" for label in result.labels]
    figure = style.new_figure(7.0, 1.2 + 0.45 * len(labels))
    axes = style.single_axes(figure)
    score, places = result.score, np.arange(len(labels))
    used = [i for i, name in enumerate(score.participants) if name not in result.excluded]
    values = score.to_scale(score.values[used])
    for row, offset in zip(values, np.linspace(-0.3, -0.1, len(used)), strict=True):
        axes.plot(row, places + offset, "o", color=_FAINT, markersize=3)
    pooled = score.to_scale(np.array(result.pooled))
    for place, (value, low, high) in zip(places, pooled, strict=True):
        ends = [end for end in (low, high) if np.isfinite(end) and end > -math.inf]
        axes.plot(value, place, "s", color=_STRONG)
        if len(ends) > 1 and (low > 0.0 or not score.is_logarithmic):
            axes.plot(ends, [place, place], color=_STRONG, linewidth=2)
    if score.is_logarithmic:
        axes.set_xscale("log")
    if score.chance is not None:
        axes.axvline(score.chance, color=_FAINT, linestyle=":")
    axes.set_yticks(places, labels)
    axes.invert_yaxis()
    style.label_axes(axes, score.quantity, "")
    return figure


def _text(value: object) -> str:
    return f"{value:.4g}" if isinstance(value, float) else str(value)


def functions_figure(result: StudyResult) -> Figure:
    """Return the shares of right answers of all used participants, and the function fitted to them.

    Levels are grouped, with as many answers in each.
    """
    design, labels = result.design, result.labels
    levels = log_levels(design)
    figure = style.new_figure(7.0, 3.4)
    axes = style.single_axes(figure)
    answered = [one for name in result.included for one in result.answered[name]]
    for column, label in enumerate(labels):
        found = [one for one in answered if one.presentation.condition == column]
        if found:
            text = ", ".join(_text(x) for x in label.values()) or "all"
            _draw_function(axes, result, levels, found, f"C{column % 10}", text)
    axes.axhline(levels.guess, color=_FAINT, linestyle=":")
    axes.set_xscale("log")
    axes.set_ylim(0.0, 1.03)
    axes.yaxis.set_major_locator(MaxNLocator(5))
    style.add_legend(axes)
    name = str(design.options["level"])
    text = f"{name} above {levels.base:.3g}" if levels.base else name
    style.label_axes(axes, f"{text} (SI)", "share of right answers")
    return figure


def _draw_function(
    axes: Axes,
    result: StudyResult,
    levels: LogLevels,
    found: list[Answered],
    colour: str,
    label: str,
) -> None:
    values = np.array([presented_level(result.design, one.presentation) for one in found])
    right = np.array([one.is_correct for one in found])
    counts = count_answers(np.log(values - levels.base), right)
    x = np.linspace(*levels.ends, 200)
    axes.plot(
        np.exp(x), levels.probability(x, *fit_psychometric(levels, counts)), colour, label=label
    )
    groups = np.array_split(np.argsort(values), min(_MAX_GROUPS, len(values)))
    middles = [np.exp(np.log(values[group] - levels.base).mean()) for group in groups]
    axes.plot(middles, [right[group].mean() for group in groups], "o", color=colour, alpha=0.6)


FIGURES: dict[str, Callable[[StudyResult], Figure]] = {
    "scores": scores_figure,
    "functions": functions_figure,
}
"""Figures of the report by name."""
