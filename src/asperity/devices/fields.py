"""What can be said of a device: its fields, their units, and which values they may have."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Literal

Range = Literal["positive", "not negative", "any"]


@dataclass(frozen=True)
class Field:
    """A number that a device may have.

    Attributes:
        unit: the SI unit in which asperity keeps it; "1" for a plain number.
        words: what it is.
        allowed: which values it may have; all are finite.
        whole: whether it is a whole number.
    """

    unit: str
    words: str
    allowed: Range = "positive"
    whole: bool = False


FIELD_TABLE: dict[str, Field] = {
    "max_force": Field("N", "greatest force, for a moment"),
    "continuous_force": Field("N", "greatest force that it holds without end"),
    "max_stiffness": Field("N/m", "K₀, the stiffest smooth wall that it renders"),
    "position_resolution": Field("m", "smallest step of the measured position"),
    "force_resolution": Field("N", "smallest step of the force"),
    "update_rate": Field("Hz", "updates of the force per second, 1/T"),
    "velocity_rate": Field("Hz", "updates of the measured velocity per second"),
    "bandwidth": Field("Hz", "frequency up to which it transmits force, F₀"),
    "damping": Field("N*s/m", "physical damping, σ₀(B): the least over the directions"),
    "joint_damping": Field("N*m*s", "physical damping in each joint"),
    "virtual_damping": Field("N*s/m", "damping that the controller adds, or takes away", "any"),
    "controller_damping": Field("N*s/m", "greatest damping gain of the controller; not physical"),
    "delay_samples": Field(
        "1", "whole samples between measurement and force", "not negative", True
    ),
    "friction": Field("N", "dry friction, felt when moving it", "not negative"),
    "apparent_mass": Field("kg", "mass felt when moving it"),
    "workspace_radius": Field("m", "radius of the ball that it reaches"),
    "workspace_diameter": Field("m", "diameter of the cylinder that it reaches"),
    "workspace_length": Field("m", "length of the cylinder that it reaches"),
    "proximal_link": Field("m", "length of each link at a motor"),
    "distal_link": Field("m", "length of each link at the handle"),
    "base_distance": Field("m", "distance of the motors' axes", "not negative"),
    "encoder_counts": Field("1", "steps of an encoder per turn of its joint", whole=True),
}

FIELDS: dict[str, str] = {name: field.unit for name, field in FIELD_TABLE.items()}
"""The unit in which asperity keeps each field."""

WORDS = ("id", "name", "axes", "notes")
"""What a device file may say besides its numbers."""
