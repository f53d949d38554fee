"""The pantograph: inertia against a SymPy derivation, energies, brakes, workspace."""

from __future__ import annotations

import importlib
import math
from dataclasses import replace
from functools import cache
from pathlib import Path as FilePath
from typing import Any

import numpy as np
import pytest

from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.devices.five_bar import handle_damping, joint_angles, joint_rates
from asperity.loop.bodies.pantograph_dynamics import (
    PantographRecord,
    StepInput,
    linkage_dynamics,
    linkage_friction,
    linkage_rates,
    linkage_reaches,
)
from asperity.simulation import (
    BandHand,
    Hand,
    LinkMasses,
    Pantograph,
    PrescribedHand,
    Run,
    Servo,
    SpringHand,
    Stationary,
    Strokes,
    Waypoints,
    plants,
    simulate,
)
from asperity.simulation.pantograph import linkage_record
from asperity.surface import Surface
from asperity.textures.kinds.sinusoid import Sinusoid

WAVE = Sinusoid(amplitude=0.3e-3, period=2e-3, phase=0.3)
HEAVY = Pantograph(masses=LinkMasses(0.011, 0.007, 0.009, rotor=2e-6), centre=(0.02, 0.09))
PLACES = [(0.0, 0.0), (0.013, -0.021), (-0.034, 0.012), (0.009, 0.017)]
SPRING = SpringHand(300.0, 3.0, mass=0.03, force=(0.1, 0.0, -0.5))
STROKES = Strokes((0.0, 0.0, -1e-3), (8e-3, 0.0, -1e-3), speed=0.08, count=9)


@cache
def lagrangian() -> tuple[Any, Any]:
    """Return the kinetic energy by SymPy, and the generalized forces of Lagrange's equations.

    The coordinates are the handle's; only lengths and masses come from the package. Both results
    are functions of (x, z, x', z', x'', z'').
    """
    import sympy as sp

    x, z, dx, dz, ax, az = names = sp.symbols("x z dx dz ax az")
    links, masses = HEAVY.linkage, HEAVY.masses
    place, speed, acceleration = sp.Matrix([x, z]), sp.Matrix([dx, dz]), sp.Matrix([ax, az])
    energy = masses.handle * speed.dot(speed) / 2
    for motor, side in ((0.0, -1), (-links.base, 1)):
        reach = sp.sqrt((x - motor) ** 2 + z**2)
        squares = links.proximal**2 + reach**2 - links.distal**2
        opening = sp.acos(squares / (2 * links.proximal * reach))
        angle = sp.atan2(z, x - motor) + side * opening
        elbow = sp.Matrix([motor + links.proximal * sp.cos(angle), links.proximal * sp.sin(angle)])
        angular_speed = (sp.Matrix([angle]).jacobian(place) * speed)[0]
        elbow_velocity = elbow.jacobian(place) * speed
        energy += masses.rotor * angular_speed**2 / 2
        for mass, start_velocity, end_velocity in (
            (masses.proximal, sp.zeros(2, 1), elbow_velocity),
            (masses.distal, elbow_velocity, speed),
        ):
            # Simpson's rule is exact: the velocity is linear along the rod.
            ends, middle = (
                start_velocity.dot(start_velocity) + end_velocity.dot(end_velocity),
                (start_velocity + end_velocity) / 2,
            )
            energy += mass / 2 * (ends + 4 * middle.dot(middle)) / 6
    momentum = sp.Matrix([energy]).jacobian(speed).T
    force = momentum.jacobian(speed) * acceleration + momentum.jacobian(place) * speed
    force -= sp.Matrix([energy]).jacobian(place).T
    return (
        sp.lambdify(names, energy, "math", cse=True),
        sp.lambdify(names, list(force), "math", cse=True),
    )


def inertia(x: float, z: float, dx: float, dz: float) -> tuple[FloatArray, FloatArray, FloatArray]:
    """Return the package's mass matrix, c and JᵀJ."""
    mxx, mxz, mzz, cx, cz, bxx, bxz, bzz = linkage_dynamics(x, z, dx, dz, linkage_record(HEAVY))
    return (
        np.array([[mxx, mxz], [mxz, mzz]]),
        np.array([cx, cz]),
        np.array([[bxx, bxz], [bxz, bzz]]),
    )


@pytest.mark.parametrize("place", PLACES)
def test_inertia_and_velocity_forces_agree_with_lagrange(place: tuple[float, float]) -> None:
    energy, forces = lagrangian()
    rng = np.random.default_rng(4)
    for _ in range(5):
        v, a = rng.normal(size=2), 30.0 * rng.normal(size=2)
        mass, velocity_forces, _ = inertia(*place, *v)
        absolute = (HEAVY.centre[0] + place[0], HEAVY.centre[1] + place[1])
        assert 0.5 * v @ mass @ v == pytest.approx(energy(*absolute, *v, *a), rel=1e-11)
        expected = np.array(forces(*absolute, *v, *a))
        np.testing.assert_allclose(
            mass @ a + velocity_forces, expected, atol=1e-11 * np.abs(expected).max()
        )
        # Negative control: the velocity-dependent forces are not small.
        assert np.abs(velocity_forces).max() > 1e-4 * np.abs(expected).max()


@pytest.mark.parametrize("place", PLACES)
def test_joint_rates_are_derivatives_of_the_joint_angles(place: tuple[float, float]) -> None:
    p = np.add(HEAVY.centre, place)
    step = 1e-6 * np.eye(2)
    finite = [
        (joint_angles(HEAVY.linkage, p + d) - joint_angles(HEAVY.linkage, p - d)) / 2e-6
        for d in step
    ]
    rates = joint_rates(HEAVY.linkage, p)
    np.testing.assert_allclose(rates, np.array(finite).T, rtol=1e-7, atol=1e-7)
    np.testing.assert_allclose(inertia(*place, 0.0, 0.0)[2], rates.T @ rates, rtol=1e-12)


def test_default_inertia_is_about_20_grams_and_labelled_a_guess() -> None:
    plant = Pantograph()
    dynamics = linkage_dynamics(0.0, 0.0, 0.0, 0.0, linkage_record(plant))
    assert dynamics[0] == pytest.approx(0.020, abs=1.5e-3)
    assert dynamics[2] == pytest.approx(0.020, abs=1.5e-3)
    assert "guess" in plant.notes[0]
    assert not any("guess" in note for note in HEAVY.notes)
    damping = handle_damping(plant.linkage, plant.joint_damping, plant.centre)
    np.testing.assert_allclose(
        plant.joint_damping * np.array([dynamics[5], dynamics[7]]), np.diag(damping), rtol=1e-12
    )


def run_of(
    plant: Pantograph, hand: Hand, period: float = 1e-4, letter: str = "C", duration: float = 0.5
) -> Run:
    surface = Surface(WAVE, letter, 600.0, max_depth=0.3e-3)
    servo = Servo(period, delay=1, position_resolution=15e-6)
    return simulate(
        surface,
        plant,
        hand,
        servo,
        STROKES,
        duration,
        start=(0.0, 0.0, 2e-3),
        velocity=(0.1, 0.0, -0.1),
    )


SLACK = BandHand(stiffness=400.0, tension=0.2)


@pytest.mark.parametrize("hand", [SPRING, BandHand(), SLACK], ids=["spring", "band", "slack"])
@pytest.mark.parametrize("friction", [0.0, 0.02])
@pytest.mark.parametrize("period", [1e-4, 3e-4])
def test_energy_ledger_closes(hand: Hand, friction: float, period: float) -> None:
    plant = Pantograph(friction=friction, joint_damping=3e-3, centre=(0.01, 0.1))
    run = run_of(plant, hand, period)
    ledger, energies = run.ledger, run.energies
    assert not run.stop_message
    assert abs(ledger.closure) < 1e-9 * ledger.exchanged
    assert ledger.exchanged > 1e-4
    assert (ledger.friction < 0.0) == (friction > 0.0)
    inflow = energies["supplied"].sum(axis=1) + energies["hand"] + energies["friction"]
    gap = energies["stored"] - energies["stored"][0] - inflow + energies["lost"]
    assert np.abs(gap).max() < 1e-9 * ledger.exchanged
    steps = np.diff(run.position, axis=0)
    np.testing.assert_allclose(
        energies["supplied"][1:], np.cumsum(run.applied[:-1] * steps, axis=0), atol=1e-13
    )


def test_energy_error_grows_with_the_step(monkeypatch: pytest.MonkeyPatch) -> None:
    """Negative control: the ledger does not close with long steps; the order is at least 4."""
    gaps = []
    for share in (4.0, 1.0, 0.25):
        monkeypatch.setattr("asperity.simulation.pantograph._MAX_STEP_FRACTION", share)
        ledger = run_of(Pantograph(inside_only=False, joint_damping=0.05), SPRING, 4e-3).ledger
        gaps.append(abs(ledger.closure) / ledger.exchanged)
    assert gaps[0] > gaps[1] > 1e-9 > gaps[2]
    assert gaps[1] / gaps[2] > 2.0**8


def test_slack_band_needs_small_steps_at_the_kink(
    tmp_path: FilePath, monkeypatch: pytest.MonkeyPatch
) -> None:
    """Negative control: without them, where the band turns slack, the ledger does not close."""
    plant = Pantograph(joint_damping=0.0)
    run = run_of(plant, SLACK)
    band_vectors = run.anchor - [0.0, 0.0, SLACK.length]
    taut = np.linalg.norm(band_vectors - run.position, axis=1) > SLACK.rest_length
    assert np.count_nonzero(np.diff(taut)) > 3
    assert abs(run.ledger.closure) < 1e-9 * run.ledger.exchanged

    source = "def band_changes_state(sx, sy, sz, tx, ty, tz, hand):\n    return False\n"
    declared = 'KERNELS = Kernels(provides=("band_changes_state",))'
    source = f"from asperity.core.compiled import Kernels\n{declared}\n{source}"
    (tmp_path / "blind_band.py").write_text(source)
    monkeypatch.syspath_prepend(tmp_path)
    module, sample = importlib.import_module("blind_band"), Pantograph.sample

    def sample_without_kink(*arguments: Any) -> plants.SampledPlant:
        plant_record = sample(*arguments)
        return plants.SampledPlant(
            (plant_record.modules[0], module, *plant_record.modules[1:]),
            plant_record.record,
            plant_record.order,
        )

    monkeypatch.setattr(Pantograph, "sample", sample_without_kink)
    ledger = run_of(plant, SLACK).ledger
    assert abs(ledger.closure) > 1e-9 * ledger.exchanged


def test_free_motion_agrees_with_lagrange_equations() -> None:
    """Undamped and free, it follows an independent integration of SymPy's equations."""
    from scipy.integrate import solve_ivp

    _, forces = lagrangian()
    free = Pantograph(HEAVY.linkage, HEAVY.masses, 0.0, HEAVY.centre)
    initial_position, speed = (0.005, 0.0, 0.004), (0.4, 0.0, 0.3)
    surface = Surface(WAVE, "W", 1.0)
    run = simulate(
        surface, free, SpringHand(), Servo(1e-3), Stationary(initial_position), 0.05, velocity=speed
    )
    assert run.applied.max() == 0.0

    def rate(_t: float, y: FloatArray) -> list[float]:
        place = (y[0] + free.centre[0], y[1] + free.centre[1])
        bias = np.array(forces(*place, *y[2:], 0.0, 0.0))
        columns = [np.array(forces(*place, *y[2:], *unit)) - bias for unit in np.eye(2)]
        return [*y[2:], *np.linalg.solve(np.array(columns).T, -bias)]

    start = [initial_position[0], initial_position[2], speed[0], speed[2]]
    end = solve_ivp(rate, (0.0, 0.05), start, "DOP853", rtol=1e-11, atol=1e-13).y[:, -1]
    np.testing.assert_allclose(run.state[[0, 2, 3, 5]], end, rtol=1e-8)
    # Negative control: the velocity is not constant.
    assert abs(run.state[3] - speed[0]) > 1e-3


def test_inside_only_brakes_act_in_contact_only() -> None:
    """With the option energy is lost inside the wall only; without it, everywhere."""
    surface, motion = Surface(WAVE, "W", 600.0), Stationary((0.0, 0.0, 0.0))
    losses = {}
    for inside_only in (True, False):
        plant = Pantograph(inside_only=inside_only)
        run = simulate(
            surface,
            plant,
            SpringHand(),
            Servo(1e-4),
            motion,
            0.05,
            start=(0.0, 0.0, 0.5e-3),
            velocity=(0.0, 0.0, -0.1),
        )
        lost = run.energies["lost"]
        outside = run.position[:, 2] > 0.0
        contact = int(np.argmin(outside))
        assert 10 < contact < len(lost)
        losses[inside_only] = lost[contact], run.ledger.dissipated
    assert losses[True][0] == 0.0
    assert losses[True][1] > 0.0
    assert losses[False][0] > 0.0


def test_brakes_of_a_textured_law_act_below_the_texture() -> None:
    """Contact of law C starts at h: between z = 0 and a crest the brakes are on."""
    crest = float(WAVE.height([[0.42e-3, 0.0]])[0])
    assert crest > 0.2e-3
    losses = {}
    for letter in "WC":
        run = simulate(
            Surface(WAVE, letter, 600.0),
            Pantograph(),
            SpringHand(),
            Servo(1e-4),
            Stationary((0.42e-3, 0.0, 0.5 * crest)),
            1e-3,
            velocity=(0.0, 0.0, -0.01),
        )
        assert run.position[:, 2].min() > 0.0
        losses[letter] = run.ledger.dissipated
    assert losses["W"] == 0.0
    assert losses["C"] > 0.0


def test_unlimited_friction_stops_the_handle_in_one_step() -> None:
    """With it v + a t = 0 in the equations of motion, including damping, hand and coupling."""
    span = 1e-3
    plant = plants.sampled_plant(replace(HEAVY, friction=1e9), SPRING, Servo(span)).record
    assert isinstance(plant, PantographRecord)
    x = np.array([0.004, 0.0, -0.005, 0.3, 0.0, -0.4])
    anchor_and_damping = (0.003, 0.006, 0.2, 0.25, 5.0)  # anchor, its velocity, joint damping
    fx, fz = linkage_friction(x, StepInput(0.4, 1.1, *anchor_and_damping), span, plant)
    inputs = StepInput(0.4 + fx, 1.1 + fz, *anchor_and_damping)
    rates = linkage_rates(x[0], x[2], x[3], x[5], 0.0, inputs, plant)
    np.testing.assert_allclose(np.array(rates[:2]) * span, -x[[3, 5]], rtol=1e-9)


def test_run_stops_at_the_edge_of_the_workspace() -> None:
    motion = Waypoints([0.0, 1.0], [[0.0, 0.0, 0.02], [0.0, 0.0, 0.12]])
    run = simulate(Surface(WAVE, "W", 500.0), Pantograph(), SPRING, Servo(1e-3), motion, 1.0)
    assert run.stop_message.startswith("left the workspace: from (")
    assert 0 < run.samples < 1000
    np.testing.assert_array_equal(run.position[-1], run.state[:3])
    plant = Pantograph()
    reach = math.hypot(plant.centre[0] + run.state[0], plant.centre[1] + run.state[2])
    assert reach < 0.138
    assert abs(run.ledger.closure) < 1e-9 * run.ledger.exchanged


@pytest.mark.parametrize(
    ("point", "message"),
    [
        ((0.0, 0.0, 0.1), "stretched"),
        ((0.0, 0.0, -0.11), "behind the motors"),
        ((0.0125, 0.0, -0.09), "folded"),
        ((0.0, 1e-3, 0.0), "y = 0"),
    ],
)
def test_start_outside_the_workspace_is_an_error(
    point: tuple[float, float, float], message: str
) -> None:
    with pytest.raises(ParameterError, match=message):
        simulate(Surface(WAVE, "W"), Pantograph(), SPRING, Servo(1e-3), Stationary(point), 0.1)


def test_motion_must_stay_in_the_plane_of_the_linkage() -> None:
    strokes = Strokes((0.0, 0.0, 0.0), (0.01, 0.01, 0.0), 0.1)
    with pytest.raises(ParameterError, match="y = 0"):
        simulate(Surface(WAVE, "W"), Pantograph(), SPRING, Servo(1e-3), strokes, 0.1)
    run = simulate(Surface(WAVE, "A"), Pantograph(), PrescribedHand(), Servo(1e-3), STROKES, 0.1)
    np.testing.assert_allclose(run.position, run.anchor, atol=1e-15)
    assert run.ledger.closure == 0.0


def test_linkage_reach_is_limited_by_the_elbow_angles() -> None:
    """|cos| of both elbow angles is below √(1 - s²), and the handle is in front of the motors."""
    plant, min_sine = Pantograph(centre=(0.02, 0.09)), 0.3
    record, links = linkage_record(plant), plant.linkage
    rng = np.random.default_rng(6)
    cases = set()
    for x, z in rng.uniform(-0.16, 0.16, (2000, 2)):
        place = np.add(plant.centre, (x, z))
        cosines = [
            (links.proximal**2 + links.distal**2 - (place[0] - motor) ** 2 - place[1] ** 2)
            / (2.0 * links.proximal * links.distal)
            for motor in (0.0, -links.base)
        ]
        is_reached = bool(place[1] > 0.0 and max(map(abs, cosines)) < math.sqrt(1.0 - min_sine**2))
        assert linkage_reaches(x, z, min_sine, record) == is_reached
        cases.add((is_reached, place[1] > 0.0, cosines[0] > 0.0, cosines[1] > 0.0))
    assert len(cases) > 6
