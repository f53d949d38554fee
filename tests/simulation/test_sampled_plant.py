"""Bodies that are too fast for the sample period are rejected, naming the argument at fault."""

from __future__ import annotations

import numpy as np
import pytest

from asperity.core.errors import ParameterError
from asperity.loop.bodies import pantograph_dynamics as five_bar
from asperity.loop.bodies.coupled_body import multiply_columns
from asperity.simulation import (
    BandHand,
    Cartesian,
    Hand,
    LinkMasses,
    Pantograph,
    Plant,
    Resonance,
    Servo,
    SpringHand,
    Stationary,
    simulate,
)
from asperity.simulation.pantograph import linkage_record
from asperity.simulation.plants import sampled_plant
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

MILLISECOND = Servo(1e-3)
LIGHT = LinkMasses(1e-30, 1e-30, 1e-30)
COUPLED = np.array([[1.0, 0.1, 0.0], [0.1, 1.0, 0.0], [0.0, 0.0, 1.0]])

TOO_FAST: list[tuple[Plant, Hand, Servo, str]] = [
    (Cartesian(0.05), BandHand(stiffness=1e30), MILLISECOND, "stiffness"),
    (Cartesian(1e-30), BandHand(), MILLISECOND, "mass"),
    (Cartesian(0.05, 1e30), BandHand(), MILLISECOND, "damping"),
    (Cartesian(0.05), BandHand(), Servo(1e30), "period"),
    (Pantograph(), SpringHand(1e30), MILLISECOND, "stiffness"),
    (Pantograph(), BandHand(stiffness=1e30), MILLISECOND, "stiffness"),
    (Pantograph(joint_damping=1e30), SpringHand(100.0), MILLISECOND, "joint_damping"),
    (Pantograph(masses=LIGHT), SpringHand(100.0), MILLISECOND, "handle"),
    (Cartesian(0.05), SpringHand(1e30), MILLISECOND, "stiffness"),
    (Cartesian(0.05), SpringHand(1.0, 1e30), MILLISECOND, "damping"),
    (Cartesian(1e-30, 1.0), SpringHand(1.0), MILLISECOND, "mass"),
    (Cartesian(1e-30, COUPLED), SpringHand(1.0), MILLISECOND, "mass"),
    (Cartesian(0.05, COUPLED), SpringHand(1e30), MILLISECOND, "stiffness"),
    (Cartesian(0.05, 1.0), SpringHand(1.0), Servo(1e30), "period"),
    (Cartesian(0.05, 0.0, Resonance(1e30)), SpringHand(1.0), MILLISECOND, "frequency"),
    (Cartesian(0.05, 0.0, Resonance(200.0)), SpringHand(1e30), MILLISECOND, "stiffness"),
    (Cartesian(1e-30, 0.0, Resonance(200.0)), SpringHand(1.0), MILLISECOND, "mass"),
]


@pytest.mark.parametrize(("plant", "hand", "servo", "name"), TOO_FAST)
def test_too_fast_body_is_an_error_naming_the_argument(
    plant: Plant, hand: Hand, servo: Servo, name: str
) -> None:
    with pytest.raises(ParameterError, match="too fast") as caught:
        sampled_plant(plant, hand, servo)
    assert caught.value.argument == name


def band_rate(damping: float) -> float:
    return float(sampled_plant(Pantograph(), BandHand(damping=damping), MILLISECOND).record[3])


def test_at_most_ten_thousand_substeps_are_allowed() -> None:
    """At 100 substeps per time constant this is a rate, damping over mass, of 1e5 1/s at 1 ms."""
    slope = (band_rate(200.0) - band_rate(100.0)) / 100.0
    for plant, limit in (
        (Cartesian(0.1), 1e5 * 0.1),
        (Pantograph(), 200.0 + (1e5 - band_rate(200.0)) / slope),
    ):
        sampled_plant(plant, BandHand(damping=0.999 * limit), MILLISECOND)
        with pytest.raises(ParameterError, match="damping makes the body too fast"):
            sampled_plant(plant, BandHand(damping=1.001 * limit), MILLISECOND)


@pytest.mark.parametrize("speed", [1e9, 1e30])
def test_pantograph_at_extreme_speed_ends_the_run(speed: float) -> None:
    run = simulate(
        Surface(Sinusoid(0.4e-3, 1e-3), "W", 800.0),
        Pantograph(),
        SpringHand(100.0),
        MILLISECOND,
        Stationary((0.0, 0.0, 0.0)),
        0.1,
        velocity=(speed, 0.0, 0.0),
    )
    assert run.stop_message.startswith("left the workspace")
    assert run.samples == 0
    assert (
        five_bar.linkage_step_count(speed, 0.0, 1.0, 1.0, linkage_record(Pantograph())) == 1_000_000
    )


def test_multiply_columns_is_the_matrix_product() -> None:
    rng = np.random.default_rng(2)
    columns, z, result = rng.normal(size=(7, 5)), rng.normal(size=7), np.full(5, 3.0)
    multiply_columns(columns, z, result)
    np.testing.assert_allclose(result, columns.T @ z, rtol=1e-13)
