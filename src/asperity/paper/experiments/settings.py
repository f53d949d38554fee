"""What the experiments of section V are run with: what the paper states, and what it does not.

The paper gives T, the resolution, stiffness, texture, friction and joint damping. Everything else
is taken from elsewhere or fitted, and every result says so.
"""

from __future__ import annotations

from asperity.devices import load_device
from asperity.paper.plane import BUMP, PASSIVITY, SAMPLING_PERIOD, SCANNING
from asperity.scene.plant import plant_of
from asperity.scene.setup import Setup
from asperity.simulation import BandHand, Motion, Pantograph, Servo, SpringHand, Still, Strokes
from asperity.simulation.hands import Hand
from asperity.surface import Surface

RESOLUTION = 15e-6  # m, stated: "better than"
LETTERS = "WABCDEFGH"
LAG = 6  # samples, fitted: of 0 and 4 to 7 the one at which W settles while A and F cycle

FITTED = (
    "Link masses (about 20 g at the handle): guessed, the paper gives none",
    "Link lengths 63, 75, 25 mm: the published device, not read in a source",
    "Working point (37.5, 100) mm from the right motor: fitted; only there x and z couple",
    "Loop lag of 6 samples: fitted; the paper states none",
    "Elastic band 200 N/m, 3 N and 80 mm long at the surface, 0.02 N·s/m: guessed",
    "Release from rest 4 mm above the surface, at 24 phases of the texture: guessed",
)
"""What section V.A needs and does not state."""

BAND_WITHOUT_LAG = "fitted: working point; guessed: masses, links, band, release"
BAND = BAND_WITHOUT_LAG.replace("fitted: ", "fitted: lag, ")
"""The same in one line."""

HANDS_GUESSED = (
    "The hand of section V.B, 300 N/m and 3 N·s/m, 50 g, pressing with 1 N: guessed",
    "Two more hands, softer and stiffer, and three speeds: to see what depends on them",
)
"""What section V.B needs and does not state."""

THREE_HANDS = "guessed: three hands at three speeds each"
"""The same in one line."""

BUMP_GUESSED = (
    "Hands, entry height and speeds of section V.C: guessed; the paper's subject did as he liked",
)
"""What section V.C needs and does not state."""


TWO_WAYS = "guessed: two hands with their ways"
"""The same in one line."""


def band_setup(law: str = "A", stiffness: float = PASSIVITY.stiffness, delay: int = LAG) -> Setup:
    """Return the loop of section V.A: an elastic band pulls the handle into the wall."""
    plant = Pantograph(joint_damping=PASSIVITY.joint_damping, centre=(0.0375, 0.1))
    return _setup(
        PASSIVITY.surface(law, stiffness=stiffness), plant, BandHand(),
        _servo(delay), Still((0.0, 0.0, 0.0)), 0.5, start=(0.0, 0.0, 4e-3),
    )  # fmt: skip


HANDS = {
    "300 N/m": SpringHand((300.0, 300.0, 0.0), 3.0, 0.05, (0.0, 0.0, -1.0)),
    "100 N/m": SpringHand((100.0, 100.0, 0.0), 2.0, 0.03, (0.0, 0.0, -1.0)),
    "800 N/m": SpringHand((800.0, 800.0, 0.0), 6.0, 0.10, (0.0, 0.0, -1.0)),
}
SPEEDS = (0.05, 0.1, 0.15)  # m/s


def stroke_setup(law: str = "A", hand: str = "300 N/m", speed: float = 0.1) -> Setup:
    """Return the loop of section V.B: strokes of 80 mm along the wall, there and back."""
    way = Strokes((-0.04, 0.0, -1e-3), (0.04, 0.0, -1e-3), speed, count=5)
    plant, servo = Pantograph(joint_damping=SCANNING.joint_damping), _servo(0)
    return _setup(SCANNING.surface(law), plant, HANDS[hand], servo, way, way.duration)


ENTRIES = {
    "mid-height": (SpringHand((300.0, 300.0, 100.0), 3.0, 0.05), 5e-3, 0.05, 2e-3),
    "fast": (SpringHand((500.0, 500.0, 50.0), 3.0, 0.05), -0.04, 0.15, 0.0),
}
"""Hand, height of its anchor [m], speed [m/s] and height of the handle at first [m]."""


def bump_setup(law: str = "A", entry: str = "mid-height") -> Setup:
    """Return the loop of section V.C: once over a bump of 20 mm and back."""
    hand, height, speed, first = ENTRIES[entry]
    way = Strokes((-0.01, 0.0, height), (0.01, 0.0, height), speed, count=2)
    plant, servo = Pantograph(joint_damping=BUMP.joint_damping), _servo(0)
    return _setup(
        BUMP.surface(law, max_depth=0.02), plant, hand, servo, way, way.duration,
        start=(-0.01, 0.0, first),
    )  # fmt: skip


def device_setup(name: str, surface: Surface, hand: SpringHand) -> Setup:
    """Return a device of the catalogue that a hand presses onto a surface.

    Raises:
        ParameterError: for a device that lacks what a simulation needs.
    """
    from asperity.scene.plant import default_servo

    device = load_device(name)
    plant, assumed = plant_of(device, centre=None)
    servo, said = default_servo(device)
    still = Still((0.0, 0.0, 0.0))
    return Setup(
        surface, device, plant, hand, servo, still, 0.25, start=(0.0, 0.0, 1e-3),
        assumptions=(*assumed, *said),
    )  # fmt: skip


def _servo(delay: int) -> Servo:
    return Servo(SAMPLING_PERIOD, delay, RESOLUTION)


def _setup(
    surface: Surface, plant: Pantograph, hand: Hand, servo: Servo, motion: Motion,
    duration: float, start: tuple[float, float, float] | None = None,
) -> Setup:  # fmt: skip
    return Setup(
        surface, load_device("pantograph"), plant, hand, servo, motion, duration, start=start,
        assumptions=plant.notes,
    )  # fmt: skip
