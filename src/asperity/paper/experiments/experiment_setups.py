"""Parameters of the experiments of section V.

The paper states T, the resolution, stiffness, texture, friction and joint damping. All other
parameters are from other sources, fitted or guessed, and are listed in every result.
"""

from __future__ import annotations

from pathlib import Path

from asperity.core.files import read_toml
from asperity.devices import load_device
from asperity.paper.cases import BUMP, PASSIVITY, SAMPLING_PERIOD, SCANNING
from asperity.scene.scene_defaults import make_plant
from asperity.scene.setup import Setup
from asperity.simulation import BandHand, Motion, Pantograph, Servo, SpringHand, Stationary, Strokes
from asperity.simulation.hands import Hand
from asperity.surface import Surface

RESOLUTION = 15e-6  # m, stated: "better than"
ALL_LAWS = "WABCDEFGH"
FITTED_DELAY = 6  # samples, fitted: of 0 and 4 to 7 the one at which W settles while A and F cycle
TRACE_STRIDE = 10  # samples

_ASSUMPTIONS = read_toml("assumptions", Path(__file__).with_name("assumptions.toml"))
FITTED_ASSUMPTIONS, GUESSED_HANDS, GUESSED_BUMP, GUESSED_DEVICES = map(tuple, _ASSUMPTIONS.values())
"""What sections V.A, V.B, V.C and further devices require and the paper does not state."""


def band_setup(
    law: str = "A", stiffness: float = PASSIVITY.stiffness, delay: int = FITTED_DELAY
) -> Setup:
    """Return the loop of section V.A: an elastic band pulls the handle into the wall."""
    plant = Pantograph(joint_damping=PASSIVITY.joint_damping, centre=(0.0375, 0.1))
    surface = PASSIVITY.surface(law, stiffness=stiffness)
    motion = Stationary((0.0, 0.0, 0.0))
    start = (0.0, 0.0, 4e-3)
    return _setup(surface, plant, BandHand(), motion, 0.5, delay=delay, start=start)


HANDS = {
    "300 N/m": SpringHand((300.0, 300.0, 0.0), 3.0, 0.05, (0.0, 0.0, -1.0)),
    "100 N/m": SpringHand((100.0, 100.0, 0.0), 2.0, 0.03, (0.0, 0.0, -1.0)),
    "800 N/m": SpringHand((800.0, 800.0, 0.0), 6.0, 0.10, (0.0, 0.0, -1.0)),
}
SPEEDS = (0.05, 0.1, 0.15)  # m/s


def stroke_setup(law: str = "A", hand: str = "300 N/m", speed: float = 0.1) -> Setup:
    """Return the loop of section V.B: strokes of 80 mm along the wall, forth and back."""
    motion = Strokes((-0.04, 0.0, -1e-3), (0.04, 0.0, -1e-3), speed, count=5)
    plant = Pantograph(joint_damping=SCANNING.joint_damping)
    return _setup(SCANNING.surface(law), plant, HANDS[hand], motion, motion.duration)


ENTRIES = {
    "mid-height": (SpringHand((300.0, 300.0, 100.0), 3.0, 0.05), 5e-3, 0.05, 2e-3),
    "fast": (SpringHand((500.0, 500.0, 50.0), 3.0, 0.05), -0.04, 0.15, 0.0),
}
"""Hand, height of its anchor [m], speed [m/s] and initial height of the handle [m]."""


def bump_setup(law: str = "A", entry: str = "mid-height") -> Setup:
    """Return the loop of section V.C: one stroke over a bump of 20 mm and back."""
    hand, height, speed, start = ENTRIES[entry]
    motion = Strokes((-0.01, 0.0, height), (0.01, 0.0, height), speed, count=2)
    plant = Pantograph(joint_damping=BUMP.joint_damping)
    surface = BUMP.surface(law, max_depth=0.02)
    return _setup(surface, plant, hand, motion, motion.duration, start=(-0.01, 0.0, start))


def device_setup(name: str, surface: Surface, hand: SpringHand) -> Setup:
    """Return the loop of a catalogue device that a hand presses onto a surface.

    Raises:
        ParameterError: if the device has no data that a simulation requires.
    """
    from asperity.scene.scene_defaults import make_servo

    device = load_device(name)
    plant, assumed = make_plant(device, centre=None)
    servo, servo_assumptions = make_servo(device)
    loop = surface, device, plant, hand, servo, Stationary((0.0, 0.0, 0.0)), 0.25
    return Setup(*loop, start=(0.0, 0.0, 1e-3), assumptions=(*assumed, *servo_assumptions))


def _setup(
    surface: Surface,
    plant: Pantograph,
    hand: Hand,
    motion: Motion,
    duration: float,
    *,
    delay: int = 0,
    start: tuple[float, float, float] | None = None,
) -> Setup:
    servo = Servo(SAMPLING_PERIOD, delay, RESOLUTION)
    loop = surface, load_device("pantograph"), plant, hand, servo, motion, duration
    return Setup(*loop, start=start, assumptions=plant.notes)
