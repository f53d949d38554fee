"""The figures of the reproduction, each as a file of its own: for a lecture."""

from __future__ import annotations

import os
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import matplotlib
from matplotlib.figure import Figure

from asperity.errors import ParameterError
from asperity.files import whole_file
from asperity.paper.experiments import Experiments
from asperity.paper.experiments.bump import bump_experiment
from asperity.paper.experiments.passivity import passivity_experiment
from asperity.paper.experiments.scanning import scanning_experiment
from asperity.paper.registry import find_claims
from asperity.report.pictures import experiment_pictures as pictures
from asperity.report.pictures.paper_pictures import figure_three, figure_two
from asperity.report.pictures.sweep_pictures import onset_figure

Ending = Literal["svg", "png"]
_DPI = 192  # of a PNG: about 1920 pixels for the 10 inches that all figures are wide
_MARGIN = 0.15  # around all that is drawn [inch]
_SALT = "asperity"  # of the identifiers in an SVG, which are drawn at random without


@dataclass(frozen=True)
class Drawing:
    """A figure of the reproduction.

    Attributes:
        name: of the file, without its ending.
        about: claims that it shows, each a name for :func:`~asperity.paper.registry.find_claims`.
        draw: returns the figure, from the experiments or, without them, from the one it needs.
        simulated: whether it needs an experiment.
    """

    name: str
    about: tuple[str, ...]
    draw: Callable[[Experiments | None], Figure]
    simulated: bool = True

    def shows(self, names: Iterable[str]) -> bool:
        """Return whether it shows one of the claims that are named."""
        ours = {claim.id for name in self.about for claim in find_claims(name)}
        return any(claim.id in ours for name in names for claim in find_claims(name))


def _devices(found: Experiments | None) -> Figure:
    assert found is not None, "no claim asks for it alone"
    return pictures.devices_figure(found)


def _cycles(found: Experiments | None) -> Figure:
    # Alone it needs no onsets, which take minutes.
    return pictures.cycles_figure(found.passivity if found else passivity_experiment(delays=()))


DRAWINGS = (
    Drawing("fig-2", ("fig-2",), lambda _found: figure_two(), simulated=False),
    Drawing("fig-3", ("fig-3",), lambda _found: figure_three(), simulated=False),
    Drawing("fig-5", ("fig-5",), _cycles),
    Drawing(
        "onsets",
        ("sentence-III.B-reduced",),
        lambda found: onset_figure((found.passivity if found else passivity_experiment()).onsets),
    ),
    Drawing(
        "fig-6",
        ("fig-6",),
        lambda found: pictures.energies_figure(found.scanning if found else scanning_experiment()),
    ),
    Drawing(
        "fig-7",
        ("fig-7",),
        lambda found: pictures.bumps_figure(found.bump if found else bump_experiment()),
    ),
    Drawing("devices", (), _devices),
)
"""In the order of the paper; what it does not show comes after what it belongs to."""


def find_drawings(names: Sequence[str] = (), *, simulated: bool = True) -> tuple[Drawing, ...]:
    """Return the figures that show claims; all if none is named.

    Args:
        names: of claims, see :func:`~asperity.paper.registry.find_claims`.
        simulated: whether those of experiments are among all.

    Raises:
        ParameterError: if no figure shows what is named.

    Example:
        >>> [drawing.name for drawing in find_drawings(["eq-12", "fig-5"])]
        ['fig-3', 'fig-5']
    """
    if not names:
        return tuple(one for one in DRAWINGS if simulated or not one.simulated)
    found = tuple(one for one in DRAWINGS if one.shows(names))
    if not found:
        shown = ", ".join(name for one in DRAWINGS for name in one.about)
        words = f"would be none: nothing is drawn of {', '.join(names)}, but of {shown}"
        raise ParameterError("figures", words)
    return found


def make_folder(path: str) -> Path:
    """Return a folder that can be written, made if it is missing.

    Raises:
        ParameterError: if there is a file in its place, or it cannot be made or written.
    """
    folder = Path(path)
    try:
        folder.mkdir(parents=True, exist_ok=True)
    except (FileExistsError, NotADirectoryError):
        raise ParameterError("figures", "must be a folder, not a file", path) from None
    except (OSError, ValueError) as error:  # a ValueError is of an impossible path
        reason = getattr(error, "strerror", None) or str(error)
        raise ParameterError("figures", f"cannot be made: {reason}", path) from None
    if not os.access(folder, os.W_OK):
        raise ParameterError("figures", "must be a folder that can be written", path)
    return folder


def write_figures(
    drawings: Sequence[Drawing],
    folder: Path,
    ending: Ending,
    experiments: Experiments | None = None,
    progress: Callable[[str], None] = lambda _name: None,
) -> tuple[Path, ...]:
    """Draw figures and write each to a file, the same bytes for the same numbers.

    Args:
        drawings: which.
        folder: where to.
        ending: of the files.
        experiments: what they are drawn from; by default each computes what it needs.
        progress: is told the name of each before it is drawn.

    Raises:
        ParameterError: if a file cannot be written.
    """
    paths = []
    with matplotlib.rc_context():
        matplotlib.rcdefaults()  # figures look as they should, whatever the user's settings
        matplotlib.rcParams["svg.hashsalt"] = _SALT
        for drawing in drawings:
            progress(drawing.name)
            paths.append(folder / f"{drawing.name}.{ending}")
            _write(drawing.draw(experiments), paths[-1], ending)
    return tuple(paths)


def _write(figure: Figure, path: Path, ending: Ending) -> None:
    said: dict[str, Any] = {"svg": {"Date": None, "Creator": None}, "png": {"Software": None}}
    try:
        with whole_file(path) as stream:
            figure.savefig(
                stream, format=ending, dpi=_DPI, metadata=said[ending],
                bbox_inches="tight", pad_inches=_MARGIN,
            )  # fmt: skip
    except OSError as error:
        reason = error.strerror or str(error)
        raise ParameterError("figures", f"cannot be written: {reason}", str(path)) from None
