"""Pictures of results: ``plot(result)`` returns a Matplotlib figure; no global state."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial, singledispatch
from typing import Any

from matplotlib.figure import Figure

from asperity.analysis.analysis_result import Analysis
from asperity.analysis.compare import Comparison
from asperity.analysis.limits.limit_result import Limits
from asperity.errors import ParameterError
from asperity.recording.recording import Recording
from asperity.report.pictures import style
from asperity.report.pictures.analysis_pictures import analysis_figure, picture_size, pictures_of
from asperity.report.pictures.field_picture import draw_fields, field_size
from asperity.report.pictures.force_picture import draw_forces, force_size
from asperity.report.pictures.gain_picture import gain_figure
from asperity.report.pictures.limits_picture import limits_figure
from asperity.report.pictures.merit_picture import merit_figure
from asperity.report.pictures.run_picture import recording_figure, run_figure
from asperity.report.pictures.spectrum_picture import spectrum_figure
from asperity.report.pictures.surface_picture import draw_surface, surface_size
from asperity.report.words.number_words import leak_text
from asperity.simulation import Run
from asperity.surface import Surface
from asperity.textures.texture import Texture


@singledispatch
def plot(result: Any, picture: str | None = None) -> Figure:
    """Return a picture of a result.

    Args:
        result: a :class:`~asperity.analysis.compare.Comparison` (the surface, the forces and
            the fields of all laws), a :class:`~asperity.surface.Surface` (forces and field of its
            law), a texture (the surface), an :class:`~asperity.analysis.analysis_result.Analysis`
            (the field with the worst loop, the loop gain, the singular values), the
            :class:`~asperity.analysis.limits.limit_result.Limits` (waves and their forces), a
            :class:`~asperity.simulation.Run` or a :class:`~asperity.Recording` (motion, force,
            energy, phase).
        picture: one picture of the report alone; of a comparison "surface", "spectrum", "force",
            "field", "gain" or "merit", of an analysis "field", "gain", "depth", for a map also
            "top", and where the force jumps "jumps".

    Returns:
        A figure; ``figure.savefig(path)`` writes it, as PNG or SVG by the path.

    Raises:
        TypeError: for a result without a picture.
        ParameterError: for a picture that the result does not have.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> [axes.get_ylabel() for axes in plot(Sinusoid(0.4e-3, 1.5e-3)).axes]
        ['height [mm]']
    """
    del picture  # the registered functions take it
    raise TypeError(f"no picture is known for a {type(result).__name__}")


@plot.register
def _texture(result: Texture, picture: str | None = None) -> Figure:
    _known(picture, ("surface",))
    return _alone(_of_texture(result))


@plot.register
def _surface(result: Surface, picture: str | None = None) -> Figure:
    _known(picture, ())
    return _stacked([_of_forces([result]), _of_fields([result])])


@plot.register
def _comparison(result: Comparison, picture: str | None = None) -> Figure:
    _known(picture, tuple(PICTURES))
    if picture is not None:
        return PICTURES[picture](result)
    surfaces = [row.surface for row in result.rows]
    fields = _of_fields(surfaces, _remarks(result))
    return _stacked([_of_texture(result.texture), _of_forces(surfaces), fields])


@plot.register
def _analysis(result: Analysis, picture: str | None = None) -> Figure:
    drawings = pictures_of(result)
    _known(picture, tuple(drawings))
    if picture is not None:
        return analysis_figure(result, picture)
    return _stacked([_of_analysis(result, name) for name in drawings])


@plot.register
def _limits(result: Limits, picture: str | None = None) -> Figure:
    _known(picture, ())
    return limits_figure(result)


@plot.register
def _run(result: Run, picture: str | None = None) -> Figure:
    _known(picture, ())
    if len(result.time) < 2:
        raise ParameterError("trace", "must be kept in memory to be drawn")
    return run_figure(result, result.surface.texture.height)


@plot.register
def _recording(result: Recording, picture: str | None = None) -> Figure:
    _known(picture, ())
    return recording_figure(result)


# Width and height [inch], and what draws it into a figure or a part of one.
_Drawing = tuple[tuple[float, float], Callable[[Any], object]]


def _of_texture(texture: Texture) -> _Drawing:
    return surface_size(texture), partial(draw_surface, texture=texture)


def _of_forces(surfaces: Sequence[Surface]) -> _Drawing:
    """The forces along the scan, one panel per law, on shared axes."""
    return force_size(len(surfaces)), partial(draw_forces, surfaces=surfaces)


def _of_fields(surfaces: Sequence[Surface], remarks: Sequence[str] = ()) -> _Drawing:
    """The force fields over their curl, one panel per law, on shared scales."""
    return field_size(surfaces), partial(draw_fields, surfaces=surfaces, remarks=remarks)


def _of_analysis(analysis: Analysis, name: str) -> _Drawing:
    draw = pictures_of(analysis)[name][0]
    return picture_size(analysis, name), lambda part: draw(part, analysis)


def _remarks(comparison: Comparison) -> list[str]:
    return [
        "conservative" if row.conservative else f"leaks up to {leak_text(row, comparison)} per loop"
        for row in comparison.rows
    ]


def _alone(drawing: _Drawing) -> Figure:
    size, draw = drawing
    figure = style.new_figure(*size)
    draw(figure)
    return figure


def _stacked(drawings: Sequence[_Drawing]) -> Figure:
    """Return a figure with one drawing below the other."""
    heights = [height for (_, height), _ in drawings]
    figure = style.new_figure(max(width for (width, _), _ in drawings), sum(heights))
    parts: Any = figure.subfigures(len(drawings), 1, height_ratios=heights, squeeze=False)
    for part, (_, draw) in zip(parts.ravel(), drawings, strict=True):
        part.set_facecolor(style.CARD)
        draw(part)
    return figure


def _known(picture: str | None, names: tuple[str, ...]) -> None:
    if picture is not None and picture not in names:
        known = f"one of {', '.join(names)}" if names else "left out for this result"
        raise ParameterError("picture", f"must be {known}", picture)


# The pictures of a comparison, as the report shows them.
PICTURES: dict[str, Callable[[Comparison], Figure]] = {
    "surface": lambda result: _alone(_of_texture(result.texture)),
    "spectrum": lambda result: spectrum_figure(result.texture, result.device),
    "force": lambda result: _alone(_of_forces([row.surface for row in result.rows])),
    "field": lambda result: _alone(
        _of_fields([row.surface for row in result.rows], _remarks(result))
    ),
    "gain": gain_figure,
    "merit": merit_figure,
}
