"""Default arguments of plants, hands and servo, and the limits of the valid ranges."""

from __future__ import annotations

import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.simulation import (
    BandHand,
    Cartesian,
    LinkMasses,
    Pantograph,
    Resonance,
    Servo,
    SpringHand,
    Strokes,
)
from asperity.simulation.pantograph import MK_TWO

TINY, BELOW, ABOVE = 5e-324, math.nextafter(1.0, 0.0), math.nextafter(1.0, 2.0)


def test_defaults_are_as_documented() -> None:
    """Users rely on these defaults, some of which are estimates."""
    body = Cartesian()
    assert (body.mass, body.resonance, body.friction) == ((0.05, 0.05, 0.05), None, 0.0)
    assert not body.damping.any()
    mode = Resonance(100.0)
    assert (mode.damping_ratio, mode.mass_fraction) == (0.02, 0.5)
    masses = LinkMasses()
    assert (masses.proximal, masses.distal, masses.handle, masses.rotor) == (0.008, 0.006, 0.01, 0)
    linkage = Pantograph()
    assert (linkage.masses, linkage.joint_damping, linkage.friction) == (masses, 4.7e-3, 0.0)
    assert (linkage.centre, linkage.inside_only) == ((-0.0125, 0.1), True)
    assert (MK_TWO.proximal, MK_TWO.distal, MK_TWO.base) == (0.063, 0.075, 0.025)
    assert linkage.linkage is MK_TWO
    assert len(linkage.notes) == 2
    assert Pantograph(masses=LinkMasses(handle=0.02)).notes == linkage.notes[1:]
    spring, band = SpringHand(), BandHand()
    assert (spring.stiffness, spring.damping, spring.force, spring.mass) == (*[(0.0,) * 3] * 3, 0.0)
    assert (band.stiffness, band.tension, band.length, band.damping) == (200.0, 3.0, 0.08, 0.02)
    servo = Servo(1e-3)
    assert (servo.delay, servo.velocity_share) == (0, 1.0)
    assert servo.settings == (0.0, 0.0, math.inf, 0.0, 1.0, 1e-3)
    assert Strokes((0.0, 0.0, 0.0), (1.0, 0.0, 0.0), 0.5).count == 1


@pytest.mark.parametrize(
    ("make", "good", "bad", "name"),
    [
        (lambda v: Cartesian(mass=(1.0, v, 1.0)), TINY, 0.0, "mass"),
        (lambda v: Cartesian(friction=v), 0.0, -TINY, "friction"),
        (Resonance, 1e-30, 0.0, "frequency"),
        (lambda v: Resonance(9.0, v), 0.0, -TINY, "damping_ratio"),
        (lambda v: Resonance(9.0, 0.1, v), TINY, 0.0, "mass_fraction"),
        (lambda v: Resonance(9.0, 0.1, v), BELOW, 1.0, "mass_fraction"),
        (lambda v: LinkMasses(proximal=v), 0.0, -TINY, "proximal"),
        (lambda v: LinkMasses(rotor=v), 0.0, -TINY, "rotor"),
        (lambda v: LinkMasses(distal=v), 0.0, -TINY, "distal"),
        (lambda v: LinkMasses(distal=0.0, handle=v), TINY, 0.0, "handle"),
        (lambda v: Pantograph(joint_damping=v), 0.0, -TINY, "joint_damping"),
        (lambda v: Pantograph(friction=v), 0.0, -TINY, "friction"),
        (lambda v: BandHand(tension=v), 0.0, -TINY, "tension"),
        (lambda v: BandHand(stiffness=2.0, length=0.5, tension=v), BELOW, 1.0, "tension"),
        (lambda v: BandHand(damping=v), 0.0, -TINY, "damping"),
        (lambda v: Servo(1e-3, delay=v), 0, -1, "delay"),
        (lambda v: Servo(1e-3, delay=v), 3.0, 2.5, "delay"),
        (lambda v: Servo(1e-3, delay=v), 1, True, "delay"),
        (lambda v: Servo(1e-3, delay=v), 1, math.inf, "delay"),
        (lambda v: Servo(1e-3, max_force=v), TINY, 0.0, "max_force"),
        (lambda v: Servo(1e-3, max_force=v), 1.0, True, "max_force"),
        (lambda v: Servo(1e-3, velocity_share=v), 1.0, ABOVE, "velocity_share"),
        (lambda v: Servo(1e-3, velocity_share=v), TINY, 0.0, "velocity_share"),
        (lambda v: Servo(1e-3, position_resolution=v), 0.0, -TINY, "position_resolution"),
        (lambda v: Servo(1e-3, force_resolution=v), 0.0, -TINY, "force_resolution"),
        (lambda v: Strokes((0, 0, 0), (1, 0, 0), 0.5, v), 2.0, 1.5, "count"),
        (lambda v: Strokes((0, 0, 0), (1, 0, 0), 0.5, v), 1, 0, "count"),
        (lambda v: Strokes((0, 0, 0), (v, 0, 0), 0.5), 1e-9, 0.0, "end"),
        (lambda v: Strokes((0, 0, 0), (1, 0, 0), v), 1e30, 0.0, "speed"),
        (lambda v: Strokes((0, 0, 0), (1e-300, 0, 0), v), 1.0, 1e30, "speed"),
        (lambda v: Strokes((0, 0, 0), (1e30, 0, 0), v), 1.0, 0.0, "speed"),
    ],
)
def test_values_at_and_beyond_the_limit_of_a_range(
    make: Callable[[Any], Any], good: Any, bad: Any, name: str
) -> None:
    make(good)
    with pytest.raises(ParameterError) as caught:
        make(bad)
    assert caught.value.argument == name


def test_damping_must_be_symmetric_and_semidefinite_up_to_rounding() -> None:
    """Up to 1e-12 of the largest entry; a smaller asymmetry is averaged."""
    for off, is_valid in ((0.9e-12, True), (1.1e-12, False)):
        matrix = np.diag([4.0, 1.0, 1.0])
        matrix[0, 1] = 4.0 * off
        indefinite = np.diag([4.0, 1.0, -4.0 * off])
        for candidate in (matrix, indefinite):
            if is_valid:
                damping = Cartesian(damping=candidate).damping
                np.testing.assert_allclose(damping, 0.5 * (candidate + candidate.T), atol=1e-20)
                continue
            with pytest.raises(ParameterError, match=r"symmetric|semidefinite"):
                Cartesian(damping=candidate)
    np.testing.assert_array_equal(Cartesian(damping=(1.0, 2.0, 3.0)).damping, np.diag([1, 2, 3]))


def test_strokes_alternate_at_their_speed() -> None:
    strokes = Strokes((1.0, 0.0, 0.0), (1.0, 3.0, 4.0), 2.5, 3)
    assert (strokes.period, strokes.duration) == (2.0, 6.0)
    times = np.array([-1.0, 0.0, 0.5, 2.0, 3.0, 4.0, 5.0, 6.0, 9.0])
    fraction = np.array([0.0, 0.0, 0.25, 1.0, 0.5, 0.0, 0.5, 1.0, 1.0])
    expected = np.array([1.0, 0.0, 0.0]) + fraction[:, None] * [0.0, 3.0, 4.0]
    np.testing.assert_allclose(strokes.at(times), expected, rtol=1e-15, atol=1e-15)
