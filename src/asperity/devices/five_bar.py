"""Kinematics of the five-bar linkage of a pantograph, and the damping at its handle."""

from __future__ import annotations

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray, check_array, check_nonnegative, check_positive
from asperity.core.errors import ParameterError


@dataclass(frozen=True)
class FiveBar:
    """Two arms of two links, joined at the handle; the motors are at (0, 0) and (-base, 0).

    Attributes:
        proximal: length of the links at the motors [m].
        distal: length of the links at the handle [m].
        base: distance of the motors [m].

    Raises:
        ParameterError: a length is not positive (base: negative).

    Example:
        >>> linkage = FiveBar(proximal=0.063, distal=0.075, base=0.025)
        >>> joint_angles(linkage, (-0.0125, 0.1)).round(4)
        array([0.8578, 2.2838])
    """

    proximal: float
    distal: float
    base: float

    def __post_init__(self) -> None:
        check_positive("proximal", self.proximal, "m")
        check_positive("distal", self.distal, "m")
        check_nonnegative("base", self.base, "m")


def joint_angles(linkage: FiveBar, point: ArrayLike) -> FloatArray:
    """Return the angles of both motors, with the elbows outside.

    Args:
        linkage: the lengths.
        point: position of the handle [m], shape (2,).

    Returns:
        (θ₁, θ₂) [rad], each from the x axis to the link at the motor, counter-clockwise.

    Raises:
        ParameterError: the arms do not reach the point.
    """
    position = check_array("point", point, (2,), "m")
    first = linkage.proximal
    second = linkage.distal
    angles = np.empty(2)
    for arm, (motor, side) in enumerate(((0.0, -1.0), (-linkage.base, 1.0))):
        x = float(position[0]) - motor
        y = float(position[1])
        reach = math.hypot(x, y)
        if not abs(first - second) < reach < first + second:
            limit = f"must be reached by both arms, {first:g} m and {second:g} m long"
            raise ParameterError("point", limit, tuple(position.tolist()))
        opening = math.acos((first**2 + reach**2 - second**2) / (2.0 * first * reach))
        angles[arm] = math.atan2(y, x) + side * opening
    return angles


def joint_rates(linkage: FiveBar, point: ArrayLike) -> FloatArray:
    """Return ∂θ/∂p = J⁻¹, the derivative of the motor angles by the position of the handle.

    The link at the handle has constant length: with u from elbow to handle and t = ∂(elbow)/∂θ,
    u · (dp - t dθ) = 0, so the row of each arm is uᵀ/(u · t).

    Args:
        linkage: the lengths.
        point: position of the handle [m], shape (2,).

    Returns:
        [rad/m], shape (2, 2); row i for motor i.

    Raises:
        ParameterError: the arms do not reach the point.
    """
    position = check_array("point", point, (2,), "m")
    rows = []
    for angle, motor in zip(joint_angles(linkage, position), (0.0, -linkage.base), strict=True):
        along = linkage.proximal * np.array([math.cos(angle), math.sin(angle)])
        across = np.array([-along[1], along[0]])
        link = position - np.array([motor, 0.0]) - along
        rows.append(link / (link @ across))
    return np.array(rows)


def handle_damping(linkage: FiveBar, joint_damping: float, point: ArrayLike) -> FloatArray:
    """Return B = J⁻ᵀ b J⁻¹, the damping at the handle due to equal damping b in both joints.

    Args:
        linkage: the lengths.
        joint_damping: b [N·m·s].
        point: position of the handle [m], shape (2,).

    Returns:
        B [N·s/m], shape (2, 2). Its smallest singular value σ₀(B) is the one in the paper's (1).

    Raises:
        ParameterError: the arms do not reach the point, or the damping is not positive.

    Reference:
        Campion and Hayward, section V: brakes in the joints of a Pantograph.

    Example:
        >>> linkage = FiveBar(proximal=0.063, distal=0.075, base=0.025)
        >>> handle_damping(linkage, 4.7e-3, (-0.0125, 0.1)).round(3) + 0.0
        array([[1.219, 0.   ],
               [0.   , 1.158]])
    """
    rates = joint_rates(linkage, point)
    return np.asarray(check_positive("joint_damping", joint_damping, "N*m*s") * rates.T @ rates)
