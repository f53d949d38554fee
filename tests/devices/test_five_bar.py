"""The five-bar linkage: its elbows, its Jacobian, and the damping at its handle."""

from __future__ import annotations

import math

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.devices.five_bar import FiveBar, handle_damping, joint_angles, joint_rates

# Generic lengths and positions, without symmetry.
LINKAGE = FiveBar(proximal=0.061, distal=0.078, base=0.027)
POINTS = [(-0.0125, 0.1), (0.0375, 0.1), (-0.05, 0.07), (0.01, 0.12)]


@pytest.mark.parametrize("point", POINTS)
def test_link_lengths_are_preserved(point: tuple[float, float]) -> None:
    angles = joint_angles(LINKAGE, point)
    for angle, motor in zip(angles, (0.0, -LINKAGE.base), strict=True):
        elbow = np.array(
            [motor + LINKAGE.proximal * math.cos(angle), LINKAGE.proximal * math.sin(angle)]
        )
        assert np.hypot(*(point - elbow)) == pytest.approx(LINKAGE.distal, rel=1e-12)


@pytest.mark.parametrize("point", POINTS)
def test_elbows_are_outside(point: tuple[float, float]) -> None:
    """The elbow of the motor at the origin is to the right of the line to the handle."""
    first, second = joint_angles(LINKAGE, point)
    assert first < math.atan2(point[1], point[0])
    assert second > math.atan2(point[1], point[0] + LINKAGE.base)


@pytest.mark.parametrize("point", POINTS)
def test_joint_rates_agree_with_differences_of_the_angles(point: tuple[float, float]) -> None:
    rates, step = joint_rates(LINKAGE, point), 1e-5
    for axis in range(2):
        shift = np.eye(2)[axis] * step
        behind = joint_angles(LINKAGE, point + shift) - joint_angles(LINKAGE, point - shift)
        ahead = joint_angles(LINKAGE, point + 2 * shift) - joint_angles(LINKAGE, point - 2 * shift)
        numeric = (8.0 * behind - ahead) / (12.0 * step)
        np.testing.assert_allclose(rates[:, axis], numeric, rtol=1e-9, atol=1e-7)


@pytest.mark.parametrize("point", POINTS)
def test_damping_power_at_handle_and_joints_is_equal(point: tuple[float, float]) -> None:
    velocity = np.array([0.03, -0.11])
    joint_velocity = joint_rates(LINKAGE, point) @ velocity
    power = velocity @ handle_damping(LINKAGE, 4e-3, point) @ velocity
    assert power == pytest.approx(4e-3 * joint_velocity @ joint_velocity, rel=1e-12)


def test_damping_of_the_papers_device() -> None:
    """Diagonal on the line of symmetry, where an independent calculation exists.

    Both arms see the handle under the same angle. With the elbow e, u = p - e and
    t = (-e_y, e_x): ∂θ/∂p = u/(u·t), and B = 2 b diag(u_x², u_y²)/(u·t)².
    """
    linkage = FiveBar(0.063, 0.075, 0.025)
    x, y = 0.0125, 0.1
    reach = math.hypot(x, y)
    elbow_angle = math.acos((0.063**2 + reach**2 - 0.075**2) / (2 * 0.063 * reach))
    angle = math.atan2(y, -x) - elbow_angle
    e = np.array([0.063 * math.cos(angle), 0.063 * math.sin(angle)])
    u = np.array([-x, y]) - e
    expected = 2 * 4.7e-3 * np.diag(u**2) / (u @ np.array([-e[1], e[0]])) ** 2
    damping = handle_damping(linkage, 4.7e-3, (-0.0125, 0.1))
    np.testing.assert_allclose(damping, expected, rtol=1e-12, atol=1e-15)
    np.testing.assert_allclose(np.diag(damping), [1.22, 1.16], rtol=0.005)


@pytest.mark.parametrize("point", [(0.0, 0.2), (0.0, 0.001), (-0.3, 0.0), (math.nan, 0.1)])
def test_unreachable_point_is_an_error(point: tuple[float, float]) -> None:
    with pytest.raises(ParameterError, match="point"):
        joint_rates(LINKAGE, point)


@pytest.mark.parametrize(
    "lengths", [(0.0, 0.07, 0.02), (0.06, -0.07, 0.02), (0.06, 0.07, -0.01), (0.06, math.inf, 0.0)]
)
def test_invalid_lengths_are_an_error(lengths: tuple[float, float, float]) -> None:
    with pytest.raises(ParameterError, match=r"proximal|distal|base"):
        FiveBar(*lengths)


@pytest.mark.parametrize("damping", [0.0, -1e-3, math.nan])
def test_invalid_damping_is_an_error(damping: float) -> None:
    with pytest.raises(ParameterError, match="joint_damping"):
        handle_damping(LINKAGE, damping, POINTS[0])
