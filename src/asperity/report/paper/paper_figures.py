"""Figures of the reproduction as files, for lectures."""

from __future__ import annotations

import base64
import io
import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import matplotlib
from matplotlib.figure import Figure

from asperity.core.errors import ParameterError
from asperity.core.files import write_bytes
from asperity.core.version import __version__
from asperity.paper.claim_registry import find_claims
from asperity.paper.experiments import Experiments
from asperity.paper.experiments.cycle_counts import passivity_experiment
from asperity.paper.experiments.strokes import bump_experiment, scanning_experiment
from asperity.report.html import template_environment
from asperity.report.page import default_style
from asperity.report.pictures import paper_pictures as pictures
from asperity.report.pictures.loop_pictures import onset_figure
from asperity.report.sentences.texts import slide_texts, table_data

FileFormat = Literal["svg", "png", "slides"]
_DPI = 192  # of a PNG: about 1920 pixels for the 10 inches that all figures are wide
_MARGIN = 0.15  # around the figure [inch]
_HASH_SALT = "asperity"  # of the identifiers in an SVG, which are random without one


@dataclass(frozen=True)
class PaperFigure:
    """A figure of the reproduction.

    Attributes:
        name: of the file, without its suffix.
        texts: name of its texts.
        claim_names: claims that it shows, as names for
            :func:`~asperity.paper.claim_registry.find_claims`.
        draw: returns the figure, from all experiments or from the one that it needs.
        needs_simulation: whether it needs an experiment.
    """

    name: str
    texts: str
    claim_names: Sequence[str]
    draw: Callable[[Experiments | None], Figure]
    needs_simulation: bool = True

    def shows_any(self, names: Iterable[str]) -> bool:
        """Return whether it shows one of the named claims."""
        ours = {claim.id for name in self.claim_names for claim in find_claims(name)}
        return any(claim.id in ours for name in names for claim in find_claims(name))


def _devices_figure(experiments: Experiments | None) -> Figure:
    assert experiments is not None, "no claim needs this figure alone"
    return pictures.devices_figure(experiments)


def _drawing(
    draw: Callable[[Any], Figure], experiment: str, simulate: Callable[[], Any]
) -> Callable[[Experiments | None], Figure]:
    """Return a drawing of one experiment, which is simulated if none have been."""
    return lambda found: draw(getattr(found, experiment) if found else simulate())


_DRAWINGS: dict[str, Callable[[Experiments | None], Figure]] = {
    "fig-2": lambda _found: pictures.figure_two(),
    "fig-3": lambda _found: pictures.figure_three(),
    # Figure 5 needs no onsets, which take minutes.
    "fig-5": _drawing(pictures.cycles_figure, "passivity", lambda: passivity_experiment(delays=())),
    "onsets": _drawing(lambda one: onset_figure(one.onsets), "passivity", passivity_experiment),
    "fig-6": _drawing(pictures.energies_figure, "scanning", scanning_experiment),
    "fig-7": _drawing(pictures.bumps_figure, "bump", bump_experiment),
    "devices": _devices_figure,
}
PAPER_FIGURES = tuple(
    PaperFigure(name, draw=_DRAWINGS[name], **values)
    for name, values in table_data("paper_figures").items()
)
"""In the order of the paper; additional figures follow those that they belong to."""


def find_figures(
    names: Sequence[str] = (), *, include_simulated: bool = True
) -> tuple[PaperFigure, ...]:
    """Return the figures that show claims; all if none is named.

    Args:
        names: of claims, see :func:`~asperity.paper.claim_registry.find_claims`.
        include_simulated: whether all figures include those of experiments.

    Raises:
        ParameterError: if no figure shows a named claim.

    Example:
        >>> [figure.name for figure in find_figures(["eq-12", "fig-5"])]
        ['fig-3', 'fig-5']
    """
    if not names:
        return tuple(one for one in PAPER_FIGURES if include_simulated or not one.needs_simulation)
    found = tuple(one for one in PAPER_FIGURES if one.shows_any(names))
    if not found:
        available = ", ".join(name for one in PAPER_FIGURES for name in one.claim_names)
        reason = f"are not available for {', '.join(names)}, but for {available}"
        raise ParameterError("figures", reason)
    return found


def create_folder(path: str) -> Path:
    """Return a writable folder, created if it is missing.

    Raises:
        ParameterError: if the path is a file, or the folder cannot be created or written.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise ParameterError("figures", "must be a folder, not a file", path) from None
    except (OSError, ValueError) as error:  # ValueError: a path with a null byte
        reason = getattr(error, "strerror", None) or str(error)
        raise ParameterError("figures", f"cannot be created: {reason}", path) from None
    if not os.access(folder, os.W_OK):
        raise ParameterError("figures", "must be a folder that can be written", path)
    return folder


def write_figures(
    figures: Sequence[PaperFigure],
    folder: Path,
    file_format: FileFormat,
    experiments: Experiments | None = None,
    progress: Callable[[str], None] = lambda _name: None,
) -> tuple[Path, ...]:
    """Draw figures and write each to a file, or all on slides; the same bytes for the same numbers.

    Args:
        figures: the figures.
        folder: destination.
        file_format: of the files.
        experiments: their data; by default each figure computes what it needs.
        progress: called with the name of each figure before it is drawn.

    Raises:
        ParameterError: if a file cannot be written.
    """
    ending = "svg" if file_format == "slides" else file_format
    files: dict[Path, bytes] = {}
    with default_style():
        matplotlib.rcParams["svg.hashsalt"] = _HASH_SALT
        for figure in figures:
            progress(figure.name)
            image = _draw_image(figure.draw(experiments), ending)
            files[folder / f"{figure.name}.{ending}"] = image
    if file_format == "slides":
        files = {folder / "slides.html": _slides(figures, files.values()).encode()}
    for path, content in files.items():
        write_bytes("figures", path, content)
    return tuple(files)


def _slides(figures: Sequence[PaperFigure], images: Iterable[bytes]) -> str:
    """Return a page with a slide for each figure: one sentence and the picture."""
    pictures = [base64.b64encode(image).decode("ascii") for image in images]
    slides = [slide_texts(figure.texts) for figure in figures]
    template = template_environment().get_template("slides.html.j2")
    return template.render(slides=[*zip(slides, pictures, strict=True)], version=__version__)


def _draw_image(figure: Figure, file_format: str) -> bytes:
    metadata: dict[str, Any] = {"svg": {"Date": None, "Creator": None}, "png": {"Software": None}}
    options: dict[str, Any] = {"dpi": _DPI, "bbox_inches": "tight", "pad_inches": _MARGIN}
    image = io.BytesIO()
    figure.savefig(image, format=file_format, metadata=metadata[file_format], **options)
    return image.getvalue()
