"""No text of a figure is on another one, and axis labels beside each other are apart."""

from __future__ import annotations

from itertools import combinations
from types import SimpleNamespace
from typing import Any

import pytest
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.text import Text
from matplotlib.transforms import Bbox

import asperity as asp
from asperity.report.pictures import style
from asperity.report.pictures.law_pictures import merit_figure
from asperity.report.pictures.plotting import plot
from asperity.textures.catalogue import as_texture

LETTERS = "WABCDEFGH"


def boxes(figure: Figure, labels: list[Any]) -> list[Bbox]:
    figure.canvas.draw()
    return [Text.get_window_extent(label) for label in labels]  # without a line to the point


def gap(one: Bbox, other: Bbox) -> tuple[float, float]:
    across = max(one.x0, other.x0) - min(one.x1, other.x1)
    return across, max(one.y0, other.y0) - min(one.y1, other.y1)


def side_by_side(figure: Figure) -> list[float]:
    """Return the distances of vertical axis labels at one height, in inches."""
    labels = [axes.yaxis.label for axes in figure.findobj(Axes) if axes.get_ylabel()]
    gaps = [gap(*pair) for pair in combinations(boxes(figure, labels), 2)]
    return [across / figure.dpi for across, up in gaps if up < 0.0]


def test_labels_of_map_and_section_are_apart() -> None:
    figure = plot(as_texture("cloth"))
    assert min(side_by_side(figure)) > 0.15
    engine = figure.get_layout_engine()
    assert engine is not None
    engine.set(w_pad=0.04)
    assert min(side_by_side(figure)) < 0.15


def comparison(places: list[tuple[float, float]]) -> Any:
    rows = [
        SimpleNamespace(
            law=SimpleNamespace(letter=letter),
            strength=strength,
            support=support,
            strength_unit="1",
            conservative=True,
            continuous=True,
        )
        for letter, (strength, support) in zip(LETTERS, places, strict=False)
    ]
    return SimpleNamespace(rows=rows, recommended_row=rows[0], texture=asp.Sinusoid(1e-4, 1e-3))


@pytest.mark.parametrize(
    "places",
    [
        [(0.0, 1.0), (0.0167, 0.70), (0.0169, 0.74), (0.0154, 0.45)],  # A and E of knurl
        [(0.06, 0.85), (0.066, 0.9), (0.0685, 0.78), (0.062, 0.71), (0.071, 0.74), (0.079, 0.92)],
        [(0.003, 0.02), (0.0031, 0.02), (0.003, 0.01), (0.0029, 0.0)],  # just above the axis
    ],
)
def test_letters_of_near_points_are_free(
    places: list[tuple[float, float]], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(
        "asperity.report.pictures.law_pictures.strength_has_unit", lambda _comparison: False
    )
    figure = merit_figure(comparison(places))
    (axes,) = figure.axes
    texts: list[Any] = [text for text in axes.texts if text.get_text() in LETTERS]
    assert len(texts) == len(places)
    for text in texts:  # a letter that is not beside its point has a line to it
        assert (abs(text.xyann[1]) > 12.0) == (text.arrow_patch is not None)
    ticks = [*axes.get_xticklabels(), axes.xaxis.label]
    found = boxes(figure, [*texts, *ticks])
    for index, box in enumerate(found[: len(texts)]):
        for other in found[index + 1 :]:
            assert max(gap(box, other)) > 0.0


def test_short_logarithmic_axes_have_more_than_one_number() -> None:
    for low, high, least in ((0.18, 2.5, 4), (1.2, 4.8, 3), (0.01, 100.0, 3)):
        figure = style.new_figure(4.0, 3.0)
        axes = style.single_axes(figure)
        axes.set(xscale="log", xlim=(low, high))
        style.label_log_axes(axes.xaxis)
        figure.canvas.draw()
        texts = [
            label.get_text()
            for label in (*axes.get_xticklabels(), *axes.get_xticklabels(minor=True))
            if label.get_text() and low <= label.get_position()[0] <= high
        ]
        assert len(texts) >= least
        assert all("10^" not in text for text in texts)
