"""The pictures that ``plot`` draws of each result."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import asperity as asp
from asperity.core.errors import ParameterError
from asperity.report import plot
from asperity.report.pictures.device_pictures import spectrum_figure
from asperity.report.pictures.law_pictures import gain_figure, merit_figure
from asperity.surface import Surface

TEXTURE = asp.Sinusoid(amplitude=0.2e-3, period=2e-3)


@pytest.fixture(scope="module")
def result() -> asp.Comparison:
    return asp.compare(TEXTURE, device="omega.3", laws="WACD", max_depth=0.3e-3)


def test_every_picture_has_axes_with_units(result: asp.Comparison) -> None:
    surface = Surface(TEXTURE, "A", max_depth=0.3e-3)
    for figure in (
        plot(result),
        plot(surface),
        plot(TEXTURE),
        merit_figure(result),
        gain_figure(result),
        spectrum_figure(TEXTURE, result.device),
    ):
        labels = [axes.get_xlabel() + axes.get_ylabel() for axes in figure.axes]
        labels += [axes.get_ylabel() for part in figure.subfigs for axes in part.axes]
        assert any("[" in label or "strength" in label for label in labels)


def test_every_picture_of_the_report_can_be_plotted_alone(
    result: asp.Comparison, tmp_path: Path
) -> None:
    for name in ("surface", "spectrum", "force", "field", "gain", "merit"):
        figure = plot(result, picture=name)
        for ending in ("png", "svg"):
            path = tmp_path / f"{name}.{ending}"
            figure.savefig(path)
            assert path.stat().st_size > 3000
    with pytest.raises(ParameterError, match="one of surface, spectrum"):
        plot(result, picture="curl")


def test_plot_of_an_unsupported_object_is_a_type_error() -> None:
    with pytest.raises(TypeError, match="has no figure"):
        plot(3)


def test_filled_points_are_pale_in_the_picture() -> None:
    heights = 1e-4 * np.random.default_rng(0).normal(size=(40, 60))
    filled = np.zeros((40, 60), dtype=bool)
    filled[:, 30:] = True
    pictures = [
        plot(asp.HeightMap(heights, 1e-4, filled_mask=mask)).axes[0].images[-1].get_array()
        for mask in (None, filled)
    ]
    change = np.abs(np.asarray(pictures[1]) - np.asarray(pictures[0])).max(axis=2)
    middle = change.shape[1] // 2
    assert change[:, : middle - 2].max() == 0.0
    assert change[:, middle + 2 :].mean() > 0.1
