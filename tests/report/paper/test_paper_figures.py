"""The figures of the reproduction as files: which, where, the same bytes twice, nothing cut."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from asperity.core.errors import ParameterError
from asperity.paper.experiments.cycle_counts import passivity_experiment
from asperity.paper.experiments.experiment_suite import Experiments
from asperity.report.paper import paper_figures
from asperity.report.paper.paper_figures import PAPER_FIGURES, find_figures, write_figures

NAMES = ["fig-2", "fig-3", "fig-5", "onsets", "fig-6", "fig-7", "devices"]


@pytest.fixture(scope="module")
def pictures(found: Experiments, tmp_path_factory: pytest.TempPathFactory) -> tuple[Path, ...]:
    """All figures as PNG, written once."""
    return write_figures(PAPER_FIGURES, tmp_path_factory.mktemp("figures"), "png", found)


def test_every_figure_is_a_file(pictures: tuple[Path, ...]) -> None:
    assert [path.name for path in pictures] == [f"{name}.png" for name in NAMES]
    assert sorted(pictures) == sorted(pictures[0].parent.iterdir())


@pytest.mark.parametrize("ending", ["svg", "png"])
def test_the_same_bytes_twice(
    found: Experiments, tmp_path: Path, ending: paper_figures.FileFormat
) -> None:
    drawings, told, texts = find_figures(["fig-5", "fig-7"]), list[str](), []
    for _ in range(2):
        paths = write_figures(drawings, tmp_path, ending, found, told.append)
        texts.append([path.read_bytes() for path in paths])
    assert texts[0] == texts[1]
    assert told == ["fig-5", "fig-7"] * 2


def test_bytes_differ_without_the_salt(
    found: Experiments, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(paper_figures, "_HASH_SALT", None)
    texts = []
    for _ in range(2):
        (path,) = write_figures(find_figures(["fig-5"]), tmp_path, "svg", found)
        texts.append(path.read_bytes())
    assert texts[0] != texts[1]


def _margin(image: Image.Image) -> int:
    """Return how many pixels along every border are white."""
    drawn = np.argwhere((np.asarray(image.convert("RGB")) < 250).any(axis=-1))
    below = np.array(image.size[::-1]) - 1 - drawn.max(axis=0)
    return int(min(*drawn.min(axis=0), *below))


def test_nothing_is_cut_and_a_slide_holds_it(pictures: tuple[Path, ...]) -> None:
    for path in pictures:
        with Image.open(path) as image:
            assert _margin(image) >= 5, path.name
            assert 1800 <= image.width <= 2100
            assert image.height <= image.width


def test_what_is_cut_is_noticed() -> None:
    figure = Figure(figsize=(2.0, 1.0))
    figure.text(0.5, 1.0, "cut", va="center")
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    with Image.open(stream) as image:
        assert _margin(image) == 0


def test_the_settings_of_the_user_change_nothing(found: Experiments, tmp_path: Path) -> None:
    import matplotlib as mpl

    drawings = find_figures(["fig-5"])
    (path,) = write_figures(drawings, tmp_path, "svg", found)
    usual = path.read_bytes()
    with mpl.rc_context({"font.size": 30.0, "axes.facecolor": "black"}):
        write_figures(drawings, tmp_path, "svg", found)
        assert mpl.rcParams["font.size"] == 30.0  # and are left as they were
    assert path.read_bytes() == usual


def test_an_svg_is_a_file_of_its_own(found: Experiments, tmp_path: Path) -> None:
    (path,) = write_figures(find_figures(["fig-5"]), tmp_path, "svg", found)
    text = path.read_text("utf-8")
    assert text.startswith("<?xml")
    assert re.search(r"<dc:date>|Matplotlib v", text) is None


@pytest.mark.parametrize(
    ("claims", "names"),
    [
        (["fig-2"], ["fig-2"]),
        (["eq-12", "sentence-V.A-cycles"], ["fig-3", "fig-5"]),
        (["sentence-III.B-reduced", "eq-44"], ["onsets"]),
        (["fig-7", "fig-6"], ["fig-6", "fig-7"]),
        ([], NAMES),
    ],
)
def test_only_the_figures_of_the_claims(claims: list[str], names: list[str]) -> None:
    assert [one.name for one in find_figures(claims)] == names


def test_without_experiments_there_are_two() -> None:
    assert [one.name for one in find_figures(include_simulated=False)] == ["fig-2", "fig-3"]
    with pytest.raises(ParameterError, match="are not available for eq-44"):
        find_figures(["eq-44"])


def test_a_figure_alone_computes_what_it_needs(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    asked: list[dict[str, object]] = []

    def small(**arguments: object) -> object:
        asked.append(arguments)
        return passivity_experiment("W", (0,), starts=1)

    monkeypatch.setattr(paper_figures, "passivity_experiment", small)
    write_figures(find_figures(["fig-5"]), tmp_path, "svg")
    assert asked == [{"delays": ()}]  # not the onsets, which take minutes


def test_a_file_that_cannot_be_written_is_named(found: Experiments, tmp_path: Path) -> None:
    (tmp_path / "fig-5.svg").mkdir()
    with pytest.raises(ParameterError, match=r"figures cannot be written.*fig-5\.svg"):
        write_figures(find_figures(["fig-5"]), tmp_path, "svg", found)


def test_the_way_over_the_bump_is_shown_whole(found: Experiments) -> None:
    from asperity.report.pictures.paper_pictures import bumps_figure

    highest = max(1e3 * one.z.max() for one in found.bump.bumps)
    assert highest > 25.0  # A throws the handle up
    assert max(axes.get_ylim()[1] for axes in bumps_figure(found.bump).axes[::2]) > highest
