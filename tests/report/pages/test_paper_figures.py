"""The figure files of the reproduction: selection, reproducibility and margins."""

from __future__ import annotations

import io
import re
from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure
from PIL import Image

from asperity.core.errors import ParameterError
from asperity.paper.experiments import Experiments
from asperity.report.pages import paper_report
from asperity.report.pages.paper_report import PAPER_FIGURES, find_figures, write_figures

NAMES = ["fig-2", "fig-3", "fig-5", "onsets", "fig-6", "fig-7", "devices"]


@pytest.fixture(scope="module")
def pictures(
    experiments: Experiments, tmp_path_factory: pytest.TempPathFactory
) -> tuple[Path, ...]:
    """All figures as PNG, written once."""
    return write_figures(PAPER_FIGURES, tmp_path_factory.mktemp("figures"), "png", experiments)


def test_every_figure_is_written_to_a_file(pictures: tuple[Path, ...]) -> None:
    assert [path.name for path in pictures] == [f"{name}.png" for name in NAMES]
    assert sorted(pictures) == sorted(pictures[0].parent.iterdir())


@pytest.mark.parametrize(("ending", "name"), [("svg", "fig-7"), ("png", "fig-5")])
def test_figure_files_are_reproducible(
    experiments: Experiments, tmp_path: Path, ending: paper_report.FileFormat, name: str
) -> None:
    progress, texts = list[str](), []
    for _ in range(2):
        (path,) = write_figures(
            find_figures([name]), tmp_path, ending, experiments, progress.append
        )
        texts.append(path.read_bytes())
    assert texts[0] == texts[1]
    assert progress == [name] * 2


def test_svg_differs_without_the_hash_salt(
    experiments: Experiments, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(paper_report, "_HASH_SALT", None)
    texts = []
    for _ in range(2):
        (path,) = write_figures(find_figures(["fig-5"]), tmp_path, "svg", experiments)
        texts.append(path.read_bytes())
    assert texts[0] != texts[1]


def _margin(image: Image.Image) -> int:
    """Return the width in pixels of the smallest white border."""
    inked = np.argwhere((np.asarray(image.convert("RGB")) < 250).any(axis=-1))
    below = np.array(image.size[::-1]) - 1 - inked.max(axis=0)
    return int(min(*inked.min(axis=0), *below))


def test_figures_have_margins_and_fit_a_slide(pictures: tuple[Path, ...]) -> None:
    for path in pictures:
        with Image.open(path) as image:
            assert _margin(image) >= 5, path.name
            assert 1800 <= image.width <= 2100
            assert image.height <= image.width


def test_margin_of_a_clipped_figure_is_zero() -> None:
    figure = Figure(figsize=(2.0, 1.0))
    figure.text(0.5, 1.0, "cut", va="center")
    stream = io.BytesIO()
    figure.savefig(stream, format="png")
    with Image.open(stream) as image:
        assert _margin(image) == 0


def test_user_rc_settings_do_not_change_figures(experiments: Experiments, tmp_path: Path) -> None:
    import matplotlib as mpl

    drawings = find_figures(["fig-5"])
    (path,) = write_figures(drawings, tmp_path, "svg", experiments)
    text = path.read_text("utf-8")
    with mpl.rc_context({"font.size": 30.0, "axes.facecolor": "black"}):
        write_figures(drawings, tmp_path, "svg", experiments)
        assert mpl.rcParams["font.size"] == 30.0  # settings are restored
    assert path.read_text("utf-8") == text
    # It stands alone, and has no date.
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
def test_claims_select_their_figures(claims: list[str], names: list[str]) -> None:
    assert [one.name for one in find_figures(claims)] == names


def test_without_experiments_only_analytic_figures_are_available() -> None:
    assert [one.name for one in find_figures(include_simulated=False)] == ["fig-2", "fig-3"]
    with pytest.raises(ParameterError, match="are not available for eq-44"):
        find_figures(["eq-44"])


def test_single_figure_runs_only_its_own_experiment(
    experiments: Experiments, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    calls: list[dict[str, object]] = []

    def run_small_experiment(**arguments: object) -> object:
        calls.append(arguments)
        return experiments.passivity

    monkeypatch.setattr(paper_report, "passivity_experiment", run_small_experiment)
    write_figures(find_figures(["fig-5"]), tmp_path, "svg")
    assert calls == [{"delays": ()}]  # without the onsets, which take minutes


def test_error_names_the_file_that_cannot_be_written(
    experiments: Experiments, tmp_path: Path
) -> None:
    (tmp_path / "fig-5.svg").mkdir()
    with pytest.raises(ParameterError, match=r"figures cannot be written.*fig-5\.svg"):
        write_figures(find_figures(["fig-5"]), tmp_path, "svg", experiments)


def test_path_over_the_bump_is_inside_the_axes(experiments: Experiments) -> None:
    from asperity.report.pictures.paper_pictures import bumps_figure

    highest = max(1e3 * one.z.max() for one in experiments.bump.bumps)
    assert highest > 25.0  # A throws the handle up
    assert max(axes.get_ylim()[1] for axes in bumps_figure(experiments.bump).axes[::2]) > highest
