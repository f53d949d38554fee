"""``asperity maps``: height and normal maps as files."""

from __future__ import annotations

import re
from collections.abc import Callable
from pathlib import Path

import pytest

import asperity as asp

Call = Callable[..., tuple[int, str, str]]
COMMAND = "maps"
WAVE = "sinusoid:amplitude=0.1mm,period=2mm"


def test_height_map_is_written_and_read_back(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "map.png"
    code, out, err = call(WAVE, "-o", str(path), "--spacing", "50um")
    assert (code, err) == (0, "")
    assert f"Written: {path}\n" in out
    assert "2 mm x 2 mm, 40 x 40 points, 50 µm apart: 2 mm x 2 mm as a picture" in out
    assert "Heights from -100 µm to 100 µm, with errors up to 1.53 nm" in out
    assert asp.load_texture(path).pitch == (5e-5, 5e-5)


@pytest.mark.parametrize("suffix", [".png", ".tif", ".x3p"])
@pytest.mark.parametrize(
    ("grid", "is_periodic"),
    [
        (("--spacing", "50um"), True),
        (("--extent", "4mm,1mm", "--spacing", "50um"), True),
        (("--spacing", "30um"), False),
        (("--extent", "3mm"), False),
    ],
)
def test_map_of_whole_periods_is_read_back_as_periodic(
    call: Call, tmp_path: Path, suffix: str, grid: tuple[str, ...], is_periodic: bool
) -> None:
    path = tmp_path / f"map{suffix}"
    _code, out, _err = call(WAVE, "-o", str(path), *grid)
    assert ("it can be tiled" in out) == is_periodic
    texture = asp.load_texture(path)
    assert texture.domain.periodic == is_periodic
    if is_periodic:
        assert not any("levelled: " in step for step in texture.preparation)
        places = [(0.1e-3, 0.0), (0.7e-3, 0.9e-3)]
        expected = asp.Sinusoid(amplitude=1e-4, period=2e-3).height(places)
        assert texture.height(places) == pytest.approx(expected, abs=2e-6)


@pytest.mark.parametrize("convention", ["gltf", "chai3d"])
def test_normal_map_reports_its_force_error(call: Call, tmp_path: Path, convention: str) -> None:
    path = str(tmp_path / "map.png")
    code, out, err = call(WAVE, "-o", path, "--normals", convention, "--stiffness", "500N/m")
    assert (code, err) == (0, "")
    words = r"8 bits turn a normal by up to 0\.\d+°: .* up to 0\.\d+ % of the force\."
    assert re.search(words, out)
    assert "is law G. At 500 N/m, pressed to 200 µm, a loop gains" in out


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["-o", "there.png"], "output exists: there.png; --force replaces it"),
        (["-o", "map.gif"], "output must end in .png, .tif, .tiff, .x3p"),
        (["-o", "map.x3p", "--normals", "gltf"], "output must end in .png"),
        (
            ["-o", "map.png", "--normals", "unity"],
            "normals is an unknown convention: 'unity'; known: chai",
        ),
        (["-o", "no/map.png"], "folder that exists"),
        (["-o", "map.png", "--spacing", "1nm"], "spacing gives 2000000 points"),
        (["-o", "map.png", "--extent", "5"], "extent"),
    ],
)
def test_invalid_input_gives_a_one_line_error_and_writes_no_file(
    call: Call, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, arguments: list[str], words: str
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "there.png").write_text("precious")
    code, out, err = call(WAVE, *arguments)
    assert (code, out, err.count("\n")) == (2, "", 1)
    assert words in err
    assert (tmp_path / "there.png").read_text() == "precious"
    assert [item.name for item in tmp_path.iterdir()] == ["there.png"]


def test_force_replaces_an_existing_file(call: Call, tmp_path: Path) -> None:
    path = tmp_path / "map.x3p"
    path.write_text("old")
    assert call(WAVE, "-o", str(path), "--force")[0] == 0
    assert path.read_bytes()[:2] == b"PK"
