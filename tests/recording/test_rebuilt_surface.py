"""Textures rebuilt from recordings: bit-identical to the original, and usable in scenes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from tests.helpers.user_modules import imported

import asperity as asp
from asperity.core.errors import ParameterError
from asperity.recording.recorded_field import TEXTURE_FILE, field_attachments, field_metadata
from asperity.recording.recording import Recording, open_recording
from asperity.recording.replay import recorded_surface_on, recorded_texture
from asperity.recording.writer import RecordingWriter
from asperity.scene import load_scene
from asperity.textures import Texture, catalogue
from asperity.textures.catalogue import as_texture

EXAMPLES = Path(__file__).parents[2] / "examples"
POINTS = np.random.default_rng(0).uniform(-1.0, 1.0, (500, 3)) * (7e-3, 7e-3, 2e-4)
MAP = asp.HeightMap(1e-4 * np.sin(np.arange(120.0) ** 1.3).reshape(10, 12), (1e-4, 3e-4 / 7.0))
WAVES = [[3000.0, 0.0], [0.0, 1e4 / 3.0], [2000.0, 1000.0]]
TEXTURES: dict[str, Texture | str] = {
    "sinusoid": asp.Sinusoid(amplitude=0.3e-3, period=7e-3 / 3.0, direction=(1.0, 0.3)),
    "fourier": asp.Fourier([2e-4, 1e-4, 1e-4 / 3.0], WAVES),
    "profile": asp.Profile(1e-4 * np.cos(np.arange(30.0) ** 1.2), 1e-3 / 7.0, origin=-2e-3),
    "map": MAP,
    **{name: name for name in ("knurl", "noise:rms=20um,size=10mm", "knurl:magnify=1.7")},
}


def recording_of(path: Path, surface: asp.Surface, **metadata: object) -> Recording:
    """Return a recording with two rows, made on a surface."""
    about = {"surface": {**field_metadata(surface), **metadata}}
    with RecordingWriter(
        path, (("time", "s"), ("x", "m")), about, field_attachments(surface)
    ) as writer:
        writer.append([[0.0, 0.0], [1e-3, 0.0]])
    return open_recording(path)


@pytest.mark.parametrize("name", TEXTURES)
@pytest.mark.parametrize("law", ["C", "F"])  # F needs the extremes
def test_rebuilt_surface_is_bit_identical(tmp_path: Path, name: str, law: str) -> None:
    surface = asp.Surface(as_texture(TEXTURES[name]), law, stiffness=700.0, clamp="backed")
    recording = recording_of(tmp_path / "run.mcap", surface)
    rebuilt = recorded_surface_on(recording, recorded_texture(recording))
    force = surface.force(POINTS)
    assert (rebuilt.force(POINTS) == force).all()
    assert np.abs(force).max() > 0.01
    assert rebuilt.digest == surface.digest
    assert rebuilt.texture.extremes == surface.texture.extremes
    assert rebuilt.texture.bounds == pytest.approx(surface.texture.bounds, rel=1e-12)
    assert rebuilt.texture.domain.spans == pytest.approx(surface.texture.domain.spans, rel=1e-12)
    assert rebuilt.texture.preparation == surface.texture.preparation
    # Nodes are recomputed, so they agree only up to rounding.
    heights = [one.texture.samples()[0] for one in (rebuilt, surface)]
    assert np.abs(np.subtract(*heights)).max() < 1e-18


def test_scene_with_a_recording_as_texture(tmp_path: Path) -> None:
    recording_of(tmp_path / "run.mcap", asp.Surface(MAP, "C"))
    scene = tmp_path / "scene.toml"
    scene.write_text('[texture]\nkind = "recording"\npath = "run.mcap"\n')
    assert (load_scene(str(scene)).texture.height(POINTS[:, :2]) == MAP.height(POINTS[:, :2])).all()
    scene.write_text('[texture]\nkind = "recording"\npath = "run.mcap"\nmagnify = 2\n')
    larger = load_scene(str(scene)).texture
    assert larger.peak_to_valley == pytest.approx(2.0 * MAP.peak_to_valley, rel=1e-6)
    scene.write_text('[texture]\nkind = "recording"\npath = "gone.mcap"\n')
    with pytest.raises(ParameterError, match=r"gone\.mcap cannot be read: No such file"):
        load_scene(str(scene))
    scene.write_text('[texture]\nkind = "recording"\n')
    with pytest.raises(ParameterError, match="path is missing: a recording needs path"):
        load_scene(str(scene))


def test_user_defined_texture_is_rebuilt_from_its_description(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "my_eggs.py").write_text((EXAMPLES / "own_texture.py").read_text())
    with imported(tmp_path, "my_eggs") as module:
        surface = asp.Surface(module.EggBox(1e-4, 2e-3), "C")
        recording = recording_of(tmp_path / "run.mcap", surface)
        with pytest.raises(ParameterError, match="a kind of your own, egg-box, that cannot be"):
            recorded_texture(recording)  # its kind is not registered
        monkeypatch.setitem(catalogue.CATALOGUE, "egg-box", module.EGG_BOX)
        rebuilt = recorded_surface_on(recording, recorded_texture(recording))
        assert (rebuilt.force(POINTS) == surface.force(POINTS)).all()
        # The description does not match the parameters of the sampler.
        wrong = {"kind": "egg-box", "amplitude": 2e-4, "period": 2e-3}
        with pytest.raises(ParameterError, match=r"describe\(\) must name its arguments"):
            recorded_texture(recording_of(tmp_path / "other.mcap", surface, texture=wrong))


def test_sampler_of_another_kind_is_not_rebuilt_as_a_spline(tmp_path: Path) -> None:
    metadata = {"sampler": ["asperity.textures.spline.heightmap_sampler"]}
    recording = recording_of(tmp_path / "run.mcap", asp.Surface(MAP, "C"), **metadata)
    with pytest.raises(ParameterError, match="that cannot be made again"):
        recorded_texture(recording)
    assert recording.attachment(TEXTURE_FILE) is not None
