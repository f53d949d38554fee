"""Figures of results: ``plot(result)`` returns a Matplotlib figure, without global state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial, singledispatch
from typing import Any

from matplotlib.figure import Figure

from asperity.analysis.results.analyze import Analysis
from asperity.analysis.results.check_limits import Limits
from asperity.analysis.results.compare import Comparison
from asperity.core.errors import ParameterError
from asperity.envelopes.envelope import Envelope
from asperity.recording.recording import Recording, open_recording
from asperity.report.pictures import law_pictures, style
from asperity.report.pictures.analysis_pictures import available_pictures
from asperity.report.pictures.device_pictures import (
    envelope_figure,
    hand_figure,
    limits_figure,
    risk_figure,
    spectrum_figure,
)
from asperity.report.pictures.loop_pictures import (
    onset_figure,
    recording_figure,
    run_figure,
    strokes_figure,
)
from asperity.report.pictures.surface_pictures import draw_surface, surface_size
from asperity.report.sentences.comparison_sentences import conservation_remarks
from asperity.scene.sweeps import OnsetSweep, StrokeSweep
from asperity.simulation import Run
from asperity.simulation.trace import MAX_ROWS
from asperity.surface import Surface
from asperity.textures.texture import Texture


@singledispatch
def plot(result: Any, picture: str | None = None) -> Figure:
    """Return a figure of a result.

    Args:
        result: a :class:`~asperity.analysis.results.compare.Comparison` (the surface, the forces
            and the fields of all laws), a :class:`~asperity.surface.Surface` (forces and field of
            its law), a texture (the surface), an
            :class:`~asperity.analysis.results.analyze.Analysis`
            (the field with the worst loop, the loop gain, the singular values), the
            :class:`~asperity.analysis.results.check_limits.Limits` (waves and their forces), an
            :class:`~asperity.Envelope` (the sinusoids that devices render), a
            :class:`~asperity.simulation.Run` or a :class:`~asperity.Recording` (motion, force,
            energy, phase).
        picture: name of one figure of the report: of a comparison "surface", "spectrum", "hand",
            "force", "field", "gain", "merit" or "risk", of an analysis "field", "gain", "depth",
            and for a map "top".

    Returns:
        A figure; ``figure.savefig(path)`` writes it, as PNG or SVG by the path.

    Raises:
        TypeError: for a result without a figure.
        ParameterError: for an unknown name.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> [axes.get_ylabel() for axes in plot(Sinusoid(0.4e-3, 1.5e-3)).axes]
        ['height [mm]']
    """
    if type(result) not in _SINGLE_FIGURES:
        raise TypeError(f"a {type(result).__name__} has no figure")
    _check_picture_name(picture)
    return _SINGLE_FIGURES[type(result)](result)


@plot.register
def _plot_texture(result: Texture, picture: str | None = None) -> Figure:
    _check_picture_name(picture, "surface")
    return _stacked_figure(_texture_drawing(result))


@plot.register
def _plot_surface(result: Surface, picture: str | None = None) -> Figure:
    _check_picture_name(picture)
    return _stacked_figure(_forces_drawing([result]), _fields_drawing([result]))


@plot.register
def _plot_comparison(result: Comparison, picture: str | None = None) -> Figure:
    _check_picture_name(picture, *COMPARISON_PICTURES)
    if picture is not None:
        return COMPARISON_PICTURES[picture](result)
    surfaces = [row.surface for row in result.rows]
    fields = _fields_drawing(surfaces, conservation_remarks(result))
    return _stacked_figure(_texture_drawing(result.texture), _forces_drawing(surfaces), fields)


@plot.register
def _plot_analysis(result: Analysis, picture: str | None = None) -> Figure:
    drawings = available_pictures(result)
    _check_picture_name(picture, *drawings)
    if picture is not None:
        return _stacked_figure(drawings[picture])
    return _stacked_figure(*drawings.values())


@plot.register
def _plot_run(result: Run, picture: str | None = None) -> Figure:
    _check_picture_name(picture)
    traced = open_recording(result.path).to_columns(MAX_ROWS) if result.path else result
    if len(traced.time) < 2:
        raise ParameterError("trace", "must be kept in memory to be drawn")
    return run_figure(traced, result.surface.texture.height)


def _texture_drawing(texture: Texture) -> style.SizedDrawing:
    return surface_size(texture), partial(draw_surface, texture=texture)


def _forces_drawing(surfaces: Sequence[Surface]) -> style.SizedDrawing:
    """Return the forces along the scan, one panel per law, on shared axes."""
    draw = partial(law_pictures.draw_forces, surfaces=surfaces)
    return law_pictures.force_size(len(surfaces)), draw


def _fields_drawing(surfaces: Sequence[Surface], remarks: Sequence[str] = ()) -> style.SizedDrawing:
    """Return the force fields over their curl, one panel per law, on shared scales."""
    draw = partial(law_pictures.draw_fields, surfaces=surfaces, remarks=remarks)
    return law_pictures.field_size(surfaces), draw


def _stacked_figure(*drawings: style.SizedDrawing) -> Figure:
    """Return a figure with one drawing below the other."""
    heights = [height for (_, height), _ in drawings]
    figure = style.new_figure(max([width for (width, _), _ in drawings]), sum(heights))
    if len(drawings) == 1:
        drawings[0][1](figure)
        return figure
    parts: Any = figure.subfigures(len(drawings), 1, height_ratios=heights, squeeze=False)
    for part, (_, draw) in zip(parts.ravel(), drawings, strict=True):
        part.set_facecolor(style.BACKGROUND)
        draw(part)
    return figure


def _check_picture_name(picture: str | None, *names: str) -> None:
    if picture is not None and picture not in names:
        allowed = f"one of {', '.join(names)}" if names else "left out for this result"
        raise ParameterError("picture", f"must be {allowed}", picture)


# Results with one figure.
_SINGLE_FIGURES: dict[type, Callable[[Any], Figure]] = {
    Envelope: envelope_figure,
    Limits: limits_figure,
    OnsetSweep: lambda result: onset_figure(result.onsets),
    Recording: recording_figure,
    StrokeSweep: lambda result: strokes_figure(result.strokes),
}

# The figures of a comparison in its report.
COMPARISON_PICTURES: dict[str, Callable[[Comparison], Figure]] = {
    "surface": lambda result: _stacked_figure(_texture_drawing(result.texture)),
    "spectrum": lambda result: spectrum_figure(result.texture, result.device),
    "hand": hand_figure,
    "force": lambda result: _stacked_figure(_forces_drawing([row.surface for row in result.rows])),
    "field": lambda result: _stacked_figure(
        _fields_drawing([row.surface for row in result.rows], conservation_remarks(result))
    ),
    "gain": law_pictures.gain_figure,
    "merit": law_pictures.merit_figure,
    "risk": risk_figure,
}
