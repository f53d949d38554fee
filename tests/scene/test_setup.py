"""Hand, motion and run of a scene."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.recording.recording import open_recording
from asperity.recording.table_export import export_recording
from asperity.scene import load_scene
from asperity.scene.setup import Setup, make_setup
from asperity.simulation import BandHand, Cartesian, Pantograph, PrescribedHand, SpringHand, Strokes

HEAD = """
[texture]
kind = "sinusoid"
amplitude = "0.4 mm"
period = "1.5 mm"
[surface]
law = "C"
stiffness = "800 N/m"
"""
MASS = '[device]\napparent_mass = "45 g"\nupdate_rate = "2 kHz"\n'
SPRING = '[hand]\nkind = "spring"\nstiffness = "300 N/m"\n'
STILL = '[motion]\nkind = "still"\npoint = ["0 mm", "0 mm", "-1 mm"]\n'


def make_scene_setup(tmp_path: Path, *parts: str) -> Setup:
    (tmp_path / "scene.toml").write_text(HEAD + "".join(parts), encoding="utf-8")
    return make_setup(load_scene(str(tmp_path / "scene.toml")))


def test_cartesian_plant_with_a_spring_hand(tmp_path: Path) -> None:
    device = (
        MASS + 'damping = "2 N*s/m"\nfriction = "0.1 N"\ndelay_samples = 2\nmax_force = "8 N"\n'
    )
    hand = SPRING + 'damping = ["1 N*s/m", "2 N*s/m", "3 N*s/m"]\nforce = "0 N; 0 N; -1 N"\n'
    setup = make_scene_setup(
        tmp_path, device, hand, STILL, '[run]\nduration = "0.2 s"\nevery = 4\n'
    )
    assert isinstance(setup.plant, Cartesian)
    assert setup.plant.mass == (0.045, 0.045, 0.045)
    np.testing.assert_array_equal(setup.plant.damping, 2.0 * np.eye(3))
    assert setup.plant.friction == 0.1
    assert setup.hand == SpringHand(300.0, (1.0, 2.0, 3.0), 0.0, (0.0, 0.0, -1.0))
    assert (setup.servo.period, setup.servo.delay, setup.servo.max_force) == (5e-4, 2, 8.0)
    assert (setup.duration, setup.every, setup.surface.stiffness) == (0.2, 4, 800.0)
    assert setup.assumptions == ()
    run = setup.simulate()
    assert (run.samples, len(run.time)) == (400, 100)


def test_missing_device_data_are_reported_as_assumptions(tmp_path: Path) -> None:
    setup = make_scene_setup(tmp_path, '[device]\nid = "touch"\n', SPRING, STILL)
    assumptions = " ".join(setup.assumptions)
    for words in ("physical damping", "update rate", "1000 Hz", "delay", "Default duration 1 s"):
        assert words in assumptions
    assert setup.servo.period == 1e-3
    assert setup.plant.friction == 0.26


def test_scene_overrides_values_of_a_catalogue_device(tmp_path: Path) -> None:
    device = '[device]\nid = "pantograph"\njoint_damping = "4 mN*m*s"\ndelay_samples = 5\n'
    run = '[run]\ncentre = ["37.5 mm", "100 mm"]\nbrakes = "always"\nstart = "0 mm; 0 mm; 4 mm"\n'
    band = '[hand]\nkind = "band"\ntension = "3 N"\nstiffness = "200 N/m"\nlength = "80 mm"\n'
    setup = make_scene_setup(tmp_path, device, band, STILL, run)
    assert isinstance(setup.plant, Pantograph)
    assert (setup.plant.joint_damping, setup.plant.centre) == (4e-3, (0.0375, 0.1))
    assert not setup.plant.inside_only
    assert setup.plant.linkage.proximal == 0.063
    assert setup.servo.position_resolution == 15e-6
    assert setup.servo.delay == 5
    assert setup.hand == BandHand(200.0, 3.0, 0.08)
    assert setup.start == (0.0, 0.0, 4e-3)
    assert any("guess" in sentence for sentence in setup.assumptions)
    assert setup.device.name.startswith("Pantograph")


def test_prescribed_motion_needs_no_mass(tmp_path: Path) -> None:
    strokes = (
        '[motion]\nkind = "strokes"\nstart = ["0 mm", "0 mm", "-0.2 mm"]\n'
        'end = ["3 mm", "0 mm", "-0.2 mm"]\nspeed = "30 mm/s"\ncount = 2\n'
    )
    setup = make_scene_setup(
        tmp_path, '[device]\nid = "omega.3"\n', '[hand]\nkind = "moved"\n', strokes
    )
    assert setup.hand == PrescribedHand()
    assert isinstance(setup.motion, Strokes)
    assert setup.duration == pytest.approx(0.2)
    run = setup.simulate()
    # Two strokes over whole periods of a conservative law: nothing but what sampling adds.
    assert abs(run.ledger.total - run.ledger.sampling) < 1e-3 * abs(run.ledger.exchanged)


@pytest.mark.parametrize("name", ["trace.csv", "trace.mcap"])
def test_trace_of_one_scene_is_the_path_of_another(tmp_path: Path, name: str) -> None:
    first = make_scene_setup(tmp_path, MASS, SPRING, STILL, '[run]\nduration = "0.05 s"\n')
    run = first.simulate(trace=str(tmp_path / "trace.mcap"))
    export_recording(open_recording(run.path), tmp_path / "trace.csv")
    second = make_scene_setup(
        tmp_path, MASS, f'[hand]\nkind = "moved"\n[motion]\nkind = "path"\nfile = "{name}"\n'
    )
    trace = first.simulate()
    at = second.motion.at(trace.time)
    np.testing.assert_allclose(at, trace.position, rtol=1e-9, atol=1e-15)


def test_path_that_leaves_a_finite_surface_is_reported(tmp_path: Path) -> None:
    np.save(tmp_path / "map.npy", 1e-5 * np.random.default_rng(0).normal(size=(32, 64)))
    text = (
        '[texture]\nkind = "file"\npath = "map.npy"\npitch = "20 um"\n[surface]\nlaw = "A"\n'
        '[hand]\nkind = "moved"\n[motion]\nkind = "strokes"\nstart = "0.1 mm; 0.2 mm; 0 mm"\n'
        'end = "END; 0.4 mm; 0 mm"\nspeed = "10 mm/s"\n'
    )
    for end, leaves in (("1.2 mm", False), ("1.4 mm", True)):
        (tmp_path / "map.toml").write_text(text.replace("END", end))
        assumptions = make_setup(load_scene(str(tmp_path / "map.toml"))).assumptions
        assert any("leaves the surface" in sentence for sentence in assumptions) == leaves


def test_changing_the_law_keeps_the_loop(tmp_path: Path) -> None:
    setup = make_scene_setup(tmp_path, MASS, SPRING, STILL)
    other = setup.with_law("H").with_delay(3)
    assert (other.surface.law.letter, other.servo.delay) == ("H", 3)
    assert other.surface.stiffness == setup.surface.stiffness
    assert other.surface.texture is setup.surface.texture
    assert other.plant == setup.plant
    assert setup.surface.law.letter == "C"


BAD = [
    ((MASS, STILL), r"needs a section \[hand\]"),
    ((MASS, SPRING), r"needs a section \[motion\]"),
    ((MASS, '[hand]\nstiffnes = "3 N/m"\n', STILL), r"hand needs kind"),
    ((MASS, '[hand]\nkind = "sprung"\n', STILL), r"did you mean 'spring'"),
    ((MASS, SPRING.replace("stiffness", "stifness"), STILL), r"did you mean 'stiffness'"),
    ((MASS, SPRING.replace("300 N/m", "300 N"), STILL), r"stiffness must be a quantity"),
    ((MASS, SPRING.replace("300", "-300"), STILL), r"stiffness must not be negative"),
    ((MASS, SPRING, '[motion]\nkind = "still"\n'), r"motion.point is missing"),
    ((MASS, SPRING, STILL.replace('"0 mm", ', "", 1)), r"3 quantities"),
    ((MASS, SPRING, '[motion]\nkind = "path"\n'), r"needs a file"),
    ((MASS, SPRING, '[motion]\nkind = "path"\nfile = "no.csv"\n'), r"cannot be read"),
    ((MASS, SPRING, STILL, '[run]\nduraton = "1 s"\n'), r"did you mean 'duration'"),
    ((MASS, SPRING, STILL, '[run]\nduration = "1 m"\n'), r"duration must be a quantity"),
    ((MASS, SPRING, STILL, '[run]\nduration = "-1 s"\n'), r"duration must be positive"),
    ((MASS, SPRING, STILL, '[run]\nbrakes = "off"\n'), r"must be 'inside' or 'always'"),
    ((MASS, SPRING, STILL, '[run]\nbrakes = "always"\n'), r"needs a five-bar"),
    ((MASS, SPRING, STILL, "[run]\nresonance = true\n"), r"needs the bandwidth"),
    ((MASS + "delay_samples = 1.5\n", SPRING, STILL), r"must be a whole number"),
    (('[device]\nid = "omega.3"\n', SPRING, STILL), r"apparent_mass is not known"),
    (('[device]\nid = "pantagraph"\n', SPRING, STILL), r"did you mean 'pantograph'"),
    (('[device]\nid = "pantograph"\njoint_dampng = "1 N*m*s"\n', SPRING, STILL), "joint_damping"),
    ((MASS, SPRING, STILL, "[runs]\nevery = 1\n"), r"unknown section \[runs\]"),
]


@pytest.mark.parametrize(("parts", "message"), BAD, ids=[message for _parts, message in BAD])
def test_invalid_scenes_are_refused(tmp_path: Path, parts: tuple[str, ...], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        make_scene_setup(tmp_path, *parts)


def test_missing_law_is_an_error(tmp_path: Path) -> None:
    text = HEAD.replace('law = "C"\n', "") + MASS + SPRING + STILL
    (tmp_path / "scene.toml").write_text(text)
    with pytest.raises(ParameterError, match="law is missing"):
        make_setup(load_scene(str(tmp_path / "scene.toml")))


def test_paths_with_wrong_columns_are_refused(tmp_path: Path) -> None:
    path = '[motion]\nkind = "path"\nfile = "way.csv"\n'
    (tmp_path / "way.csv").write_text("time [s],x [m],y [m]\n0,0,0\n")
    with pytest.raises(ParameterError, match=r"no column 'z \[m\]'"):
        make_scene_setup(tmp_path, MASS, SPRING, path)
    (tmp_path / "way.csv").write_text("time [s],x [m],y [m],z [m]\n0,0,zero,0\n")
    with pytest.raises(ParameterError, match="not a table of numbers"):
        make_scene_setup(tmp_path, MASS, SPRING, path)
    for nothing in ("", "\n\n", "# 1,2,3,4\n"):
        (tmp_path / "way.csv").write_text("time [s],x [m],y [m],z [m]\n" + nothing)
        with pytest.raises(ParameterError, match="has no rows"):
            make_scene_setup(tmp_path, MASS, SPRING, path)
    (tmp_path / "way.csv").write_text("time [s],x [m],y [m],z [m]\n1,0,0,0\n0,0,0,0\n")
    with pytest.raises(ParameterError, match="times must increase"):
        make_scene_setup(tmp_path, MASS, SPRING, path)
