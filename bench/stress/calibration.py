"""Random simulated devices, calibrated: are their true numbers recovered?

``python -m bench.stress.calibration 10 1``: so many devices, drawn with that seed. The goals: K₀
along each axis within 10 %, resolution and period within 5 %, the delay exact.

The true K₀ comes from the eigenvalues of mass, damper, delay and sampler, in which dry friction
counts as the damping that takes as much of an oscillation of the size that a calibration begins
with (its describing function, 4 F_c/(π v)).
"""

from __future__ import annotations

import math
import sys
import time
from dataclasses import dataclass

import numpy as np
from rich.console import Console
from scipy.linalg import expm

from asperity.servo.calibration.calibrator import (
    MAX_WALL_STEP,
    WALL_FORCE_FRACTION,
    Calibration,
    Calibrator,
)
from asperity.servo.calibration.excitation import UnclockedRig
from asperity.servo.drivers.simulated import simulated_driver
from asperity.servo.safety import Safety
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary

FORCE = 3.0  # [N]
RAMP = 0.02  # [s]
K0_WITHIN, OTHERS_WITHIN = 0.1, 0.05


@dataclass(frozen=True)
class RandomDevice:
    """A device, with all that is true of it.

    Attributes:
        period: T [s].
        delay: samples.
        step: of positions [m].
        mass: along each axis [kg].
        damping: likewise [N s/m].
        friction: dry [N].
    """

    period: float
    delay: int
    step: float
    mass: tuple[float, float, float]
    damping: tuple[float, float, float]
    friction: float

    def wall_stiffness(self, axis: int) -> float:
        """Return K₀ along an axis [N/m]."""
        mass, damping = self.mass[axis], self.damping[axis]
        smooth = wall_limit(mass, damping, self.period, self.delay)
        speed = initial_amplitude(smooth) * math.sqrt(smooth / mass)
        rubbing = 4.0 * self.friction / (math.pi * speed)
        return wall_limit(mass, damping + rubbing, self.period, self.delay)


def initial_amplitude(stiffness: float) -> float:
    """Return the amplitude with which an oscillation at a wall begins [m]."""
    return min(MAX_WALL_STEP, WALL_FORCE_FRACTION * FORCE / stiffness)


def wall_limit(mass: float, damping: float, period: float, delay: int) -> float:
    """Return the stiffness at which a sampled, delayed spring on a mass and damper rings for ever.

    Its state is position, velocity and the forces that wait; the largest eigenvalue passes 1.

    Example:
        >>> round(wall_limit(0.1, 1.0, 1e-4, 2) * 1e-4 * 2.5, 2)  # b / T / (1/2 + d)
        1.0
    """
    block = np.zeros((3, 3))
    block[0, 1], block[1, 1], block[1, 2] = 1.0, -damping / mass, 1.0 / mass
    step = expm(block * period)
    size = 2 + delay

    def largest(stiffness: float) -> float:
        moves = np.zeros((size, size))
        moves[:2, :2] = step[:2, :2]
        if delay == 0:
            moves[:2, 0] -= stiffness * step[:2, 2]
        else:
            moves[:2, 2] = step[:2, 2]
            moves[2:-1, 3:] += np.eye(delay - 1)
            moves[-1, 0] = -stiffness
        return float(np.abs(np.linalg.eigvals(moves)).max())

    low, high = 1e-3, 1e8
    while high > low * 1.0001:
        middle = math.sqrt(low * high)
        low, high = (low, middle) if largest(middle) > 1.0 else (middle, high)
    return low


def random_device(
    rng: np.random.Generator, rates: tuple[float, float] = (1e3, 1e4)
) -> RandomDevice:
    """Return a random device.

    Args:
        rng: the draw.
        rates: least and greatest update rate [Hz].
    """
    period = 1.0 / math.exp(rng.uniform(*np.log(rates)))
    delay = int(rng.integers(0, 5))
    mass = rng.uniform(0.03, 0.3, 3)
    # A wall of this stiffness is about to cycle, so that K₀ is that of devices that there are.
    stiffness = np.exp(rng.uniform(math.log(300.0), math.log(4000.0), 3))
    damping = stiffness * period * (0.5 + delay)
    speed = np.array([initial_amplitude(one) for one in stiffness]) * np.sqrt(stiffness / mass)
    # Friction that takes up to a fifth of what the damping takes, where it matters most.
    friction = rng.uniform(0.0, 0.2) * math.pi / 4.0 * float((damping * speed).min())
    step = math.exp(rng.uniform(math.log(5e-6), math.log(30e-6)))
    x, y, z = map(float, mass)
    bx, by, bz = map(float, damping)
    return RandomDevice(period, delay, step, (x, y, z), (bx, by, bz), friction)


def calibrate_device(device: RandomDevice) -> Calibration:
    """Return what a calibration says of a device."""
    own = Servo(device.period, delay=device.delay, position_resolution=device.step)
    plant = Cartesian(device.mass, device.damping, friction=device.friction)
    still = Stationary((0.0, 0.0, 0.0))
    driver = simulated_driver(
        plant, SpringHand(), own, still, device.period, device_resolution=True
    )
    loop = Servo(device.period, max_force=FORCE)
    bench = UnclockedRig(driver, loop, Safety(ramp=RAMP, max_slew=1e3 * FORCE))
    return Calibrator(bench, RAMP).run()


def list_misses(device: RandomDevice, found: Calibration) -> list[str]:
    """Return what is further from the truth than the goals allow."""
    said = []
    if found.delay.samples != device.delay or found.delay.alternatives:
        said.append(f"delay {found.delay.samples}, others {found.delay.alternatives}")
    if (
        found.position_step is None
        or abs(found.position_step.value / device.step - 1.0) > OTHERS_WITHIN
    ):
        said.append("resolution")
    if abs(found.update_rate.value * device.period - 1.0) > OTHERS_WITHIN:
        said.append("period")
    if len(found.axes) != 3:
        said.append("axes")
    for axis in found.axes:
        true = device.wall_stiffness("xyz".index(axis.name))
        if not abs(axis.wall.stable_stiffness / true - 1.0) <= K0_WITHIN:
            said.append(f"K₀ along {axis.name}")
    return said


def run(console: Console, count: int = 10, seed: int = 1) -> None:
    """Print what was recovered of random devices."""
    rng = np.random.default_rng(seed)
    console.print("K₀ found over true, by axis")
    missed = 0
    for _ in range(count):
        device, start = random_device(rng), time.perf_counter()
        found = calibrate_device(device)
        took = time.perf_counter() - start
        walls = [
            axis.wall.stable_stiffness / device.wall_stiffness("xyz".index(axis.name))
            for axis in found.axes
        ]
        wrong = list_misses(device, found)
        missed += bool(wrong)
        step = (
            math.nan
            if found.position_step is None
            else found.position_step.value / device.step - 1.0
        )
        console.print(
            f"{1e-3 / device.period:5.2f} kHz, d {device.delay} found {found.delay.samples},"
            f" step {1e6 * device.step:4.1f} µm {step:+.1%}, period"
            f" {1.0 / (found.update_rate.value * device.period) - 1.0:+.1%}, K₀"
            f" {' '.join(f'{wall:.3f}' for wall in walls)}, {took:.1f} s"
            f"{'  MISSED: ' if wrong else ''}{', '.join(wrong)}"
        )
    console.print(f"{count - missed} of {count} devices within the goals")


if __name__ == "__main__":
    run(Console(width=160, highlight=False), *map(int, sys.argv[1:]))
