"""Specifications and scene files."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.scene import load_scene
from asperity.textures import Fourier, HeightMap, Sinusoid


def test_sinusoid_specification() -> None:
    texture = load_scene("sinusoid:amplitude=0.8mm,period=1 mm,phase=90deg,direction=3 4").texture
    assert isinstance(texture, Sinusoid)
    assert (texture.amplitude, texture.period) == (0.0008, 0.001)
    assert texture.direction == (0.6, 0.8)


def test_fourier_specification() -> None:
    spec = "fourier:amplitudes=0.3mm;0.2mm,wavevectors=3 1 rad/m;-1rad/m 4rad/m,phases=0;90deg"
    texture = load_scene(spec).texture
    assert isinstance(texture, Fourier)
    np.testing.assert_allclose(texture.wavevectors, [[3, 1], [-1, 4]])
    profile = load_scene("fourier:amplitudes=1mm;0.5mm,wavevectors=2rad/mm;4000 rad/m").texture
    assert profile.is_profile


def test_scene_file(tmp_path: Path) -> None:
    (tmp_path / "scene.toml").write_text(
        '[texture]\nkind = "sinusoid"\namplitude = "0.4 mm"\nperiod = "1.5 mm"\n'
        '[surface]\nlaw = "C"\nstiffness = "800 N/m"\nmax_depth = "0.5 mm"\n'
        '[device]\nid = "pantograph"\n'
    )
    scene = load_scene(str(tmp_path / "scene.toml"))
    assert isinstance(scene.texture, Sinusoid)
    assert scene.surface == {"law": "C", "stiffness": 800.0, "max_depth": 0.0005}
    assert scene.device is not None
    assert scene.device.id == "pantograph"


def test_scene_with_a_measured_file_beside_it(tmp_path: Path) -> None:
    np.save(tmp_path / "map.npy", 1e-5 * np.random.default_rng(0).normal(size=(12, 16)))
    (tmp_path / "scene.toml").write_text(
        '[texture]\nkind = "file"\npath = "map.npy"\npitch = "10 µm; 20 µm"\nmagnify = 2\n'
        '[device]\nmax_stiffness = "700 N/m"\n'
    )
    scene = load_scene(str(tmp_path / "scene.toml"))
    assert isinstance(scene.texture, HeightMap)
    assert scene.texture.pitch == pytest.approx((2e-5, 4e-5))
    assert scene.device is not None
    assert scene.device.max_stiffness == 700.0


@pytest.mark.parametrize(
    ("source", "argument", "message"),
    [
        ("sinusiod:amplitude=1mm,period=1mm", "surface", "did you mean 'sinusoid'"),
        ("sinusoid:amplitude=1mm", "period", "missing"),
        ("sinusoid:amplitude=1mm,periode=1mm", "sinusoid.periode", "did you mean 'period'"),
        ("sinusoid:amplitude=1mm,amplitude=2mm", "amplitude", "twice"),
        ("sinusoid:amplitude=1N,period=1mm", "amplitude", "dimension"),
        ("sinusoid:amplitude=1mm,period=1", "period", "needs a unit: write 1mm or 1um or 1m"),
        ("sinusoid:amplitude=1mm,period=1mm,phase=90", "phase", "write 90deg or 90rad"),
        ("fourier:amplitudes=1mm;2,wavevectors=1rad/m", "amplitudes", "write 2mm or 2um"),
        ("fourier:amplitudes=1mm,wavevectors=1 2", "wavevectors", "write 1rad/mm or 1rad/m"),
        ("sinusoid:amplitude=-1mm,period=1mm", "amplitude", "positive"),
        ("sinusoid:amplitude=1mm,period=0", "period", "positive"),
        ("sinusoid:amplitude=nan,period=1mm", "amplitude", "finite"),
        ("sinusoid:amplitude", "surface", "kind:argument=value"),
        ("nothing.toml", "scene", "cannot be read"),
        ("nothing.x3p", "path", "nothing.x3p"),
    ],
)
def test_invalid_specifications_are_refused(source: str, argument: str, message: str) -> None:
    with pytest.raises(ParameterError, match=message) as caught:
        load_scene(source)
    assert caught.value.argument == argument


@pytest.mark.parametrize(
    ("content", "message"),
    [
        ("[texure]\n", "did you mean 'texture'"),
        ("[texture]\namplitude = 1\n", "needs .texture. with kind"),
        (
            '[texture]\nkind = "sinusoid"\namplitude = 1\nperiod = 1\n[surface]\nstifness = 3\n',
            "did you mean 'stiffness'",
        ),
        (
            '[texture]\nkind = "sinusoid"\namplitude = 1\nperiod = 1\n[device]\nid = "tuch"\n',
            "did you mean 'touch'",
        ),
        (
            '[texture]\nkind = "sinusoid"\namplitude = 1\nperiod = "1 mm"\n',
            "amplitude needs a unit: write 1mm or 1um or 1m, got 1",
        ),
        (
            '[texture]\nkind = "sinusoid"\namplitude = "1 mm"\nperiod = "1 mm"\n'
            "[surface]\nstiffness = 800\n",
            "stiffness needs a unit: write 800N/m",
        ),
        ("texture = 3\n", "must be a section"),
        ("[texture\n", "not valid TOML"),
        ("[surface]\nstiffness = 1" + "0" * 5000, "not valid TOML"),
        ("a = " + "[" * 3000, "nested too deeply"),
    ],
)
def test_invalid_scenes_are_refused(tmp_path: Path, content: str, message: str) -> None:
    (tmp_path / "scene.toml").write_text(content)
    with pytest.raises(ParameterError, match=message):
        load_scene(str(tmp_path / "scene.toml"))


def test_device_quantities_in_a_scene_need_units(tmp_path: Path) -> None:
    text = '[texture]\nkind = "sinusoid"\namplitude = "1 mm"\nperiod = "1 mm"\n[device]\n'
    for lines in ("max_stiffness = 700\n", 'id = "touch"\nmax_stiffness = 700\n'):
        (tmp_path / "scene.toml").write_text(text + lines)
        with pytest.raises(ParameterError, match=r"max_stiffness needs a unit: write 700N/m"):
            load_scene(str(tmp_path / "scene.toml"))


def test_load_options_override_the_scene(tmp_path: Path) -> None:
    np.save(tmp_path / "map.npy", 1e-5 * np.random.default_rng(0).normal(size=(12, 16)))
    (tmp_path / "scene.toml").write_text(
        '[texture]\nkind = "file"\npath = "map.npy"\npitch = "10 µm"\n'
    )
    texture = load_scene(str(tmp_path / "scene.toml"), {"pitch": 3e-5}).texture
    assert isinstance(texture, HeightMap)
    assert texture.pitch == (3e-5, 3e-5)


def test_file_options_are_refused_for_synthetic_textures() -> None:
    with pytest.raises(ParameterError, match="measured surfaces only"):
        load_scene("sinusoid:amplitude=1mm,period=1mm", {"outliers": 2.0})
