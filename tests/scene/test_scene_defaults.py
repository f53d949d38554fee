"""The default hand, motion and device of a surface without a scene."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.devices import load_device, parse_device
from asperity.scene import load_scene
from asperity.scene.scene_defaults import make_plant, make_servo, with_assumed_mass
from asperity.scene.setup import make_setup
from asperity.simulation import Cartesian, Pantograph, SpringHand, Strokes

SINUSOID = "sinusoid:amplitude=0.4mm,period=1.5mm"
SURFACE = {"law": "C", "stiffness": 800.0, "max_depth": 0.5e-3}


def test_default_hand_presses_within_the_analysed_depth() -> None:
    setup = make_setup(load_scene(SINUSOID), surface=SURFACE, use_defaults=True)
    assert isinstance(setup.hand, SpringHand)
    assert isinstance(setup.motion, Strokes)
    assert setup.duration == 10.0
    assert setup.motion.start[2] == pytest.approx(0.4e-3 - 0.8 * 0.5e-3)
    length = np.subtract(setup.motion.end, setup.motion.start)
    assert np.hypot(*length[:2]) == pytest.approx(10e-3)
    assert setup.motion.speed == 0.05
    assert setup.hand.stiffness == (300.0, 300.0, 800.0)
    assert "pulled 400 µm deep by a spring of 800 N/m" in setup.assumptions[0]


def test_default_hand_force_is_at_most_half_of_the_device_maximum() -> None:
    device = parse_device({"max_force": 0.4, "apparent_mass": 0.05}, "weak")
    setup = make_setup(load_scene(SINUSOID), surface=SURFACE, device=device, use_defaults=True)
    assert setup.hand.stiffness[2] == pytest.approx(0.5 * 0.4 / (0.8 * 0.5e-3))


def test_default_stroke_stays_within_a_finite_surface(tmp_path: Path) -> None:
    heights = 1e-5 * np.random.default_rng(1).normal(size=(40, 60))
    np.save(tmp_path / "map.npy", heights)
    scene = load_scene(str(tmp_path / "map.npy"), {"pitch": 1e-4})
    setup = make_setup(scene, surface=SURFACE, use_defaults=True)
    assert isinstance(setup.motion, Strokes)
    for end in (setup.motion.start, setup.motion.end):
        assert 0.0 <= end[0] <= 5.9e-3
        assert 0.0 <= end[1] <= 3.9e-3
    assert not any("leaves the surface" in sentence for sentence in setup.assumptions)


def test_unknown_mass_is_assumed_and_reported() -> None:
    device, assumed = with_assumed_mass(parse_device({"max_force": 3.0}, "mine"))
    assert device.value("apparent_mass") == 0.1
    assert device.data["apparent_mass"].source == "assumed"
    assert assumed == ("The apparent mass of mine is not known; 100 g are simulated",)
    for device_with_mass in (
        parse_device({"apparent_mass": 0.05}, "mine"),
        load_device("pantograph"),
    ):
        assert with_assumed_mass(device_with_mass)[1] == ()


def test_plant_is_chosen_by_the_device_data() -> None:
    plant, _ = make_plant(load_device("pantograph"))
    assert isinstance(plant, Pantograph)
    plant, notes = make_plant(parse_device({"apparent_mass": 0.05, "friction": 0.2}, "mine"))
    assert isinstance(plant, Cartesian)
    assert notes == ["The physical damping of mine is not known; none is simulated"]
    assert make_plant(parse_device({}, "mine"), needs_dynamics=False)[1] == []


@pytest.mark.parametrize(
    ("device", "arguments", "message"),
    [
        ({}, {}, r"apparent_mass is not known: .* \[device\], else apparent_mass='50 g'"),
        ({"apparent_mass": 0.05}, {"centre": (0.0, 0.1)}, r"run\.centre needs a five-bar"),
        ({"apparent_mass": 0.05}, {"brakes": "always"}, r"run\.brakes needs a five-bar"),
        ({"apparent_mass": 0.05}, {"brakes": "never"}, "must be 'inside' or 'always'"),
        ({"apparent_mass": 0.05}, {"has_resonance": True}, "needs the bandwidth of mine"),
        ({}, {"needs_dynamics": False, "brakes": "always"}, "whose motion is prescribed"),
    ],
)
def test_inapplicable_arguments_are_refused(
    device: dict[str, float], arguments: dict[str, object], message: str
) -> None:
    with pytest.raises(ParameterError, match=message):
        make_plant(parse_device(device, "mine"), **arguments)  # type: ignore[arg-type]  # invalid on purpose


def test_servo_uses_the_device_data() -> None:
    device = parse_device(
        {"update_rate": 4000, "delay_samples": 3, "force_resolution": 1e-3, "max_force": 5}, "mine"
    )
    servo, notes = make_servo(device)
    assert (servo.period, servo.delay, servo.force_resolution, servo.max_force) == (
        2.5e-4,
        3,
        1e-3,
        5.0,
    )
    assert notes == []
    servo, notes = make_servo(parse_device({}, "mine"), uses_delay=False)
    assert servo.period == 1e-3
    assert notes == ["The update rate of mine is not known; 1000 Hz is simulated"]
