"""``asperity prepare``: the preparation that it reports and the file that it writes."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from asperity.measured.reading import measured_file as loading
from asperity.scene import load_scene
from asperity.textures import HeightMap, load_texture

Call = Callable[..., tuple[int, str, str]]

DATA = Path(__file__).parents[3] / "shared" / "data"
needs_data = pytest.mark.skipif(
    not DATA.is_dir(), reason="the real surfaces of ../shared/data are not there"
)


@pytest.fixture
def source(tmp_path: Path) -> str:
    y, x = np.mgrid[:40, :50]
    heights = 2e-6 * np.sin(x / 3.0) + 1e-6 * np.cos(y / 4.0) + 1e-8 * x
    heights[10:13, 20:24] = np.nan
    heights[30, 30] = 5e-5
    np.save(tmp_path / "map.npy", heights)
    return str(tmp_path / "map.npy")


def flat(text: str) -> str:
    return " ".join(text.split())


def test_prepared_file_is_saved_and_each_step_reported(
    call: Call, source: str, tmp_path: Path
) -> None:
    target = tmp_path / "surface.npz"
    code, out, err = call("prepare", source, "-o", str(target), "--pitch", "2um; 3 µm")
    assert (code, err) == (0, "")
    assert "2 pitch 2 µm x 3 µm as given" in flat(out)
    assert (
        "4 filled 12 missing points of 2000 (0.6 %) by harmonic interpolation on the fitted"
        in flat(out)
    )
    assert "(chosen from the sampling: 4 samples)" in flat(out)
    heights = load_texture(target).heights
    assert (
        "50 x 40 points, pitch 2 µm x 3 µm,"
        f" peak to valley {np.ptp(heights) * 1e6:.1f} µm, RMS {np.std(heights) * 1e6:.2f} µm,"
        " 0.6 % filled"
    ) in flat(out)
    assert f"Saved: {target}" in flat(out)
    assert sorted(p.name for p in tmp_path.iterdir()) == ["map.npy", "surface.npz"]


def test_every_option_reaches_the_preparation(call: Call, source: str, tmp_path: Path) -> None:
    target = tmp_path / "surface.npz"
    options = {
        "--pitch": "2um",
        "--height-range": "8um",
        "--outliers": "6",
        "--form": "3",
        "--s-cutoff": "9um",
        "--l-cutoff": "60um",
        "--tip-radius": "4um",
        "--blend": "10um",
        "--magnify": "20",
        "--magnify-height": "10",
    }
    flat_options = [part for pair in options.items() for part in pair]
    code, out, _err = call("prepare", source, "--output", str(target), "--periodic", *flat_options)
    assert code == 0
    for words in (
        "outliers: 1 point beyond 6 robust",
        "to 8 µm peak to valley",
        "polynomial of degree 3",
        "filtered: Gaussian ISO 16610-61, cut-off 9 µm",
        "L-filter ISO 16610-61, cut-off 60 µm",
        "tip of radius 4 µm",
        "blended over 10 µm",
        "magnified 20 times laterally and 10 times in height",
        "periodic",
    ):
        assert words in flat(out)
    expected = load_texture(
        source,
        pitch=2e-6,
        height_range=8e-6,
        outliers=6,
        form=3,
        s_cutoff=9e-6,
        l_cutoff=6e-5,
        tip_radius=4e-6,
        periodic=True,
        blend=1e-5,
        magnify=20,
        magnify_height=10,
    )
    texture = load_texture(target)
    np.testing.assert_array_equal(texture.heights, expected.heights)
    assert texture.pitch == expected.pitch
    assert texture.periodic


def test_prepared_file_is_used_by_compare_and_scenes(
    call: Call, source: str, tmp_path: Path
) -> None:
    target = tmp_path / "surface.npz"
    assert call("prepare", source, "-o", str(target), "--pitch", "20um", "--outliers", "6")[0] == 0
    code, out, err = call("compare", str(target), "--laws", "W", "--magnify-height", "2", "--why")
    assert (code, err) == (0, "")
    assert "outliers: 1 point beyond 6 robust" in flat(out)
    code, _out, err = call("compare", str(target), "--laws", "W", "--s-cutoff", "90um")
    assert code == 2
    assert err.count("\n") == 1
    assert "s_cutoff cannot be applied" in err
    assert "was prepared already" in err
    (tmp_path / "scene.toml").write_text('[texture]\nkind = "file"\npath = "surface.npz"\n')
    texture = load_scene(str(tmp_path / "scene.toml")).texture
    assert isinstance(texture, HeightMap)
    assert texture.filled_mask is not None


def test_scene_options_prepare_the_surface(source: str, tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(
        '[texture]\nkind = "file"\npath = "map.npy"\npitch = "2 µm"\nperiodic = true\nform = 2\n'
        'outliers = 6\nblend = "12 µm"\ntip_radius = "3 µm"\nl_cutoff = "50 µm"\n'
    )
    texture = load_scene(str(tmp_path / "scene.toml")).texture
    expected = load_texture(
        source,
        pitch=2e-6,
        periodic=True,
        form=2,
        outliers=6,
        blend=1.2e-5,
        tip_radius=3e-6,
        l_cutoff=5e-5,
    )
    assert isinstance(texture, HeightMap)
    np.testing.assert_array_equal(texture.heights, expected.heights)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--pitch", "-2um"], "pitch must be positive"),
        (["--pitch", "0"], "pitch must be positive"),
        (["--pitch", "2um", "--outliers", "0"], "outliers must be positive"),
        (["--pitch", "2um", "--outliers", "6 m"], "outliers must be a number"),
        (["--pitch", "2um", "--form", "2.5"], "form must be a whole number"),
        (["--pitch", "2um", "--form", "nan"], "form must be finite"),
        (["--pitch", "2um", "--form", "30"], "form must be a whole number from 0 to 10"),
        (["--pitch", "2um", "--s-cutoff", "9um", "--l-cutoff", "9um"], "l_cutoff must be longer"),
        (["--pitch", "2um", "--l-cutoff", "1kg"], "l_cutoff must be a quantity"),
        (["--pitch", "2um", "--tip-radius", "1 m"], "tip_radius must be at most"),
        (["--pitch", "2um", "--tip-radius", "-1um"], "tip_radius must be positive"),
        (["--pitch", "2um", "--blend", "9um"], "blend is the width"),
        (["--pitch", "2um", "--periodic", "--blend", "1 m"], "blend must be at most half"),
        (["--pitch", "2um", "--magnify", "0"], "magnify must be positive"),
        ([], "pitch must be given"),
    ],
)
def test_invalid_arguments_give_a_one_line_error(
    call: Call, source: str, tmp_path: Path, arguments: list[str], message: str
) -> None:
    code, out, err = call("prepare", source, "-o", str(tmp_path / "surface.npz"), *arguments)
    assert (code, out) == (2, "")
    assert err.startswith(f"asperity: {message}")
    assert err.count("\n") == 1
    assert [p.name for p in tmp_path.iterdir()] == ["map.npy"]


def test_invalid_output_paths_are_refused(call: Call, source: str, tmp_path: Path) -> None:
    before = Path(source).read_bytes()
    for target, message in (
        (source, "output must be another file than the surface"),
        (str(tmp_path / "missing" / "a.npz"), "output must lie in a folder that exists"),
        (str(tmp_path), "output must be a file that ends in .npz"),
        (str(tmp_path / "surface.x3p"), "output must be a file that ends in .npz, got "),
    ):
        code, _out, err = call("prepare", source, "-o", target, "--pitch", "2um")
        assert code == 2
        assert message in err
    assert Path(source).read_bytes() == before
    assert list(tmp_path.iterdir()) == [Path(source)]
    code, _out, err = call("prepare", str(tmp_path / "none.x3p"), "-o", str(tmp_path / "a.npz"))
    assert (code, "no such file" in err) == (2, True)
    code, _out, err = call("prepare", source)
    assert (code, "--output" in err) == (2, True)


@pytest.mark.parametrize("place", [(np, "savez"), (loading, "prepare_file")])
def test_interrupt_leaves_no_file(
    call: Call, source: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, place: tuple[Any, str]
) -> None:
    def stop(*_arguments: Any, **_options: Any) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(*place, stop)
    with pytest.raises(KeyboardInterrupt):  # for the message see tests/cli/test_program.py
        call("prepare", source, "-o", str(tmp_path / "a.npz"), "--pitch", "2um")
    assert [p.name for p in tmp_path.iterdir()] == ["map.npy"]


def test_file_that_appears_meanwhile_is_kept(
    call: Call, source: str, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    target = tmp_path / "a.npz"
    prepare = loading.prepare_file

    def prepare_slowly(*arguments: Any, **keywords: Any) -> Any:
        target.write_text("of another process")
        return prepare(*arguments, **keywords)

    monkeypatch.setattr(loading, "prepare_file", prepare_slowly)
    code, out, err = call("prepare", source, "-o", str(target), "--pitch", "2um")
    assert (code, out) == (2, "")
    assert err == f"asperity: output exists: {target}; --force replaces it\n"
    assert target.read_text() == "of another process"


def test_prepared_file_can_only_be_magnified(call: Call, source: str, tmp_path: Path) -> None:
    first, second = str(tmp_path / "a.npz"), str(tmp_path / "b.npz")
    assert call("prepare", source, "-o", first, "--pitch", "2um", "--periodic")[0] == 0
    assert call("prepare", first, "-o", second, "--magnify", "3")[0] == 0
    assert load_texture(second).periodic
    assert load_texture(second).pitch == pytest.approx((6e-6, 6e-6))
    code, _out, err = call("prepare", first, "-o", second, "--periodic", "--force")
    assert code == 2
    assert "periodic cannot be applied" in err


@needs_data
def test_measured_surface_is_prepared(call: Call, tmp_path: Path) -> None:
    target = tmp_path / "land.npz"
    code, out, err = call(
        *("prepare", str(DATA / "sample-land.x3p"), "-o", str(target)),
        *("--form", "2", "--outliers", "10", "--tip-radius", "10um", "--periodic"),
    )
    assert (code, err) == (0, "")
    assert "polynomial of degree 2" in flat(out)
    texture = load_texture(target)
    assert isinstance(texture, HeightMap)
    assert texture.periodic
    assert texture.filled_mask is not None
    assert 0.1 < texture.filled_mask.mean() < 0.2
