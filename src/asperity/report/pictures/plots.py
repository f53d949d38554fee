"""Pictures of results: ``plot(result)`` returns a Matplotlib figure; no global state."""

from __future__ import annotations

from collections.abc import Callable
from functools import singledispatch
from typing import Any

from matplotlib.figure import Figure

from asperity.analysis.analysis_result import Analysis
from asperity.analysis.compare import Comparison
from asperity.errors import ParameterError
from asperity.report.pictures import style
from asperity.report.pictures.analysis_pictures import analysis_figure, picture_size, pictures_of
from asperity.report.pictures.field_picture import draw_fields, field_size
from asperity.report.pictures.force_picture import draw_forces, force_size
from asperity.report.pictures.gain_picture import gain_figure
from asperity.report.pictures.merit_picture import merit_figure
from asperity.report.pictures.spectrum_picture import spectrum_figure
from asperity.report.pictures.surface_picture import draw_surface, surface_size
from asperity.report.words.number_words import leak_text
from asperity.surface import Surface
from asperity.textures.texture import Texture


@singledispatch
def plot(result: Any, picture: str | None = None) -> Figure:
    """Return a picture of a result.

    Args:
        result: a :class:`~asperity.analysis.compare.Comparison` (the surface, the forces and
            the fields of all laws), a :class:`~asperity.surface.Surface` (forces and field of its
            law), a texture (the surface) or an :class:`~asperity.analysis.analysis_result.Analysis`
            (the field with the worst loop, the loop gain, the singular values).
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
    return surface_figure(result)


@plot.register
def _surface(result: Surface, picture: str | None = None) -> Figure:
    _known(picture, ())
    sizes = [force_size(1), field_size([result])]
    figure, parts = _stacked(sizes)
    draw_forces(parts[0], [result])
    draw_fields(parts[1], [result])
    return figure


@plot.register
def _comparison(result: Comparison, picture: str | None = None) -> Figure:
    _known(picture, tuple(PICTURES))
    if picture is not None:
        return PICTURES[picture](result)
    surfaces = [row.surface for row in result.rows]
    sizes = [surface_size(result.texture), force_size(len(surfaces)), field_size(surfaces)]
    figure, parts = _stacked(sizes)
    draw_surface(parts[0], result.texture)
    draw_forces(parts[1], surfaces)
    draw_fields(parts[2], surfaces, _remarks(result))
    return figure


@plot.register
def _analysis(result: Analysis, picture: str | None = None) -> Figure:
    drawings = pictures_of(result)
    _known(picture, tuple(drawings))
    if picture is not None:
        return analysis_figure(result, picture)
    figure, parts = _stacked([picture_size(result, name) for name in drawings])
    for (draw, _height), part in zip(drawings.values(), parts, strict=True):
        draw(part, result)
    return figure


def surface_figure(texture: Texture) -> Figure:
    """Return the picture of a surface."""
    figure = style.new_figure(*surface_size(texture))
    draw_surface(figure, texture)
    return figure


def force_figure(comparison: Comparison) -> Figure:
    """Return the forces along the scan, one panel per law, on shared axes."""
    figure = style.new_figure(*force_size(len(comparison.rows)))
    draw_forces(figure, [row.surface for row in comparison.rows])
    return figure


def field_figure(comparison: Comparison) -> Figure:
    """Return the force fields over their curl, one panel per law, on shared scales."""
    surfaces = [row.surface for row in comparison.rows]
    figure = style.new_figure(*field_size(surfaces))
    draw_fields(figure, surfaces, _remarks(comparison))
    return figure


def _remarks(comparison: Comparison) -> list[str]:
    return [
        "conservative" if row.conservative else f"leaks up to {leak_text(row, comparison)} per loop"
        for row in comparison.rows
    ]


def _stacked(sizes: list[tuple[float, float]]) -> tuple[Figure, list[Any]]:
    """Return a figure with one part below the other."""
    heights = [height for _, height in sizes]
    figure = style.new_figure(max(width for width, _ in sizes), sum(heights))
    parts: Any = figure.subfigures(len(sizes), 1, height_ratios=heights, squeeze=False)
    for part in parts.ravel():
        part.set_facecolor(style.CARD)
    return figure, list(parts.ravel())


def _known(picture: str | None, names: tuple[str, ...]) -> None:
    if picture is not None and picture not in names:
        known = f"one of {', '.join(names)}" if names else "left out for this result"
        raise ParameterError("picture", f"must be {known}", picture)


# The pictures of a comparison, as the report shows them.
PICTURES: dict[str, Callable[[Comparison], Figure]] = {
    "surface": lambda result: surface_figure(result.texture),
    "spectrum": lambda result: spectrum_figure(result.texture, result.device),
    "force": force_figure,
    "field": field_figure,
    "gain": gain_figure,
    "merit": merit_figure,
}
