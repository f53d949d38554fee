"""One sample of every body, as plain Python, against its differential equation.

The equations are implemented independently and integrated by SciPy; only the parameters and the
linkage's inertia and damping, which are tested separately, come from the package.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from asperity.core.checks import FloatArray
from asperity.devices.five_bar import handle_damping
from asperity.loop.bodies import axis_body as axes
from asperity.loop.bodies import body_parts as hands
from asperity.loop.bodies import coupled_body as dense
from asperity.loop.bodies import elastic_band as banded
from asperity.loop.bodies import pantograph_dynamics as five_bar
from asperity.loop.bodies import prescribed_motion as prescribed
from asperity.loop.body_interface import LEFT_WORKSPACE, RUNNING, SampleInput
from asperity.loop.simulated_device import EXCHANGED, FRICTION, HAND, LEDGER_SIZE, LOST, SUPPLIED
from asperity.simulation import (
    BandHand,
    Cartesian,
    Hand,
    LinkMasses,
    Pantograph,
    PrescribedHand,
    Resonance,
    Servo,
    SpringHand,
)
from asperity.simulation.pantograph import linkage_record
from asperity.simulation.plants import coupled_plant, sampled_plant, substep_count

MASS = (0.05, 0.04, 0.03)
COUPLED = np.array([[2.0, 0.5, 0.1], [0.5, 1.0, -0.2], [0.1, -0.2, 0.7]])
MODE = Resonance(60.0, 0.08, 0.4)
SPRING = SpringHand([300.0, 200.0, 250.0], [2.0, 1.5, 1.0], mass=0.02, force=(0.1, -0.2, -0.3))
BAND = BandHand(stiffness=150.0, tension=2.0, length=0.07, damping=0.3)
HEAVY = Pantograph(masses=LinkMasses(0.011, 0.007, 0.009, rotor=2e-6), centre=(0.02, 0.09))
INPUT = SampleInput(0.4, -0.7, 1.1, 0.003, -0.004, 0.006, 0.2, -0.3, 0.25, True)
POSITION, VELOCITY = np.array([0.004, 0.003, -0.005]), np.array([0.3, -0.2, 0.4])
CARRIER_OFFSET = np.array([1e-4, -2e-4, 3e-4])
PERIOD = 2e-3


def hand_force(hand: Hand, stretch: FloatArray, rate: FloatArray) -> tuple[FloatArray, float]:
    """Return the force of a spring and damper, or band, on the handle [N], and its loss [W]."""
    drag = np.asarray(hand.damping) * rate  # type: ignore[union-attr]  # a spring's or a band's
    lost = float(drag @ rate)
    if isinstance(hand, SpringHand):
        return np.asarray(hand.stiffness) * stretch + drag, lost
    assert isinstance(hand, BandHand)
    vector = stretch - [0.0, 0.0, hand.length]
    length = float(np.linalg.norm(vector))
    extension = max(length - (hand.length - hand.tension / hand.stiffness), 0.0)
    return hand.stiffness * extension * vector / length + drag, lost


def hand_energy(hand: Hand, stretch: FloatArray) -> float:
    if isinstance(hand, SpringHand):
        return 0.5 * float(np.asarray(hand.stiffness) @ stretch**2)
    assert isinstance(hand, BandHand)
    length = float(np.linalg.norm(stretch - [0.0, 0.0, hand.length]))
    return (
        0.5 * hand.stiffness * max(length - hand.length + hand.tension / hand.stiffness, 0.0) ** 2
    )


def integrate_motion(accelerate: Any, x: FloatArray, span: float = PERIOD) -> FloatArray:
    """Return the final state, loss and work of the hand; ``accelerate`` gives (x', loss, work)."""
    solution = solve_ivp(
        lambda t, y: np.append(*accelerate(t, y[:-2])),
        (0.0, span),
        [*x, 0.0, 0.0],
        "DOP853",
        rtol=1e-12,
        atol=1e-14,
        max_step=span / 50.0,
    )
    return np.asarray(solution.y[:, -1])


def anchor(t: float) -> FloatArray:
    return np.array(INPUT[3:6]) + t * np.array(INPUT[6:9])


def single_mass(plant: Cartesian, hand: Hand) -> Any:
    """Equation of one mass: M p'' = f + g - B p' + pull."""
    mass = np.array(plant.mass) + (hand.mass if isinstance(hand, SpringHand) else 0.0)
    constant_force = np.array(hand.force) if isinstance(hand, SpringHand) else np.zeros(3)
    force, speed = np.array(INPUT[:3]), np.array(INPUT[6:9])

    def rate(t: float, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        p, v = x[:3], x[3:6]
        pull, lost = hand_force(hand, anchor(t) - p, speed - v)
        drag = plant.damping @ v
        acceleration = (force + constant_force + pull - drag) / mass
        return np.append(v, acceleration), np.array(
            [lost + drag @ v, speed @ pull + constant_force @ v]
        )

    return rate


def double_mass(plant: Cartesian, hand: SpringHand) -> Any:
    """Equation of two masses on the spring of the mode; the hand holds the far one."""
    mode, mass = plant.resonance, np.array(plant.mass)
    assert mode is not None
    near, far = (1.0 - mode.mass_fraction) * mass, mode.mass_fraction * mass + hand.mass
    omega, reduced = 2.0 * math.pi * mode.frequency, near * far / (near + far)
    spring, damper = omega**2 * reduced, 2.0 * mode.damping_ratio * omega * reduced
    force, speed, constant_force = np.array(INPUT[:3]), np.array(INPUT[6:9]), np.array(hand.force)

    def rate(t: float, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        p, v, r, w = x.reshape(4, 3)
        pull, lost = hand_force(hand, anchor(t) - r, speed - w)
        mode_force = spring * (r - p) + damper * (w - v)
        drag = plant.damping @ v
        accelerations = (
            (force - drag + mode_force) / near,
            (constant_force + pull - mode_force) / far,
        )
        lost += float(drag @ v + (damper * (w - v)) @ (w - v))
        return np.concatenate([v, accelerations[0], w, accelerations[1]]), np.array(
            [lost, speed @ pull + constant_force @ w]
        )

    return rate


def pantograph(plant: Pantograph, hand: Hand) -> Any:
    """Equation of the linkage: M p'' + c = f + g - B p' + pull in the x-z plane."""
    hand_mass = hand.mass if isinstance(hand, SpringHand) else 0.0
    constant_force = np.array(hand.force) if isinstance(hand, SpringHand) else np.zeros(3)
    record, force, speed = (
        linkage_record(plant, hand_mass),
        np.array(INPUT[:3]),
        np.array(INPUT[6:9]),
    )
    speed[1], in_plane = 0.0, [0, 2]

    def rate(t: float, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        p, v = x[:3], x[3:6]
        pull, lost = hand_force(
            hand, (anchor(t) - p) * [1.0, 0.0, 1.0], (speed - v) * [1.0, 0.0, 1.0]
        )
        xx, xz, zz, cx, cz, *_ = five_bar.linkage_dynamics(p[0], p[2], v[0], v[2], record)
        place = np.add(plant.centre, p[in_plane])
        drag = handle_damping(plant.linkage, plant.joint_damping, place) @ v[in_plane]
        acceleration = np.linalg.solve(
            [[xx, xz], [xz, zz]], (force + constant_force + pull)[in_plane] - drag - [cx, cz]
        )
        work = speed @ pull + constant_force[in_plane] @ v[in_plane]
        return np.array([v[0], 0.0, v[2], acceleration[0], 0.0, acceleration[1]]), np.array(
            [lost + drag @ v[in_plane], work]
        )

    return rate


def initial_state(order: int, *, plane: bool = False) -> FloatArray:
    x = np.concatenate([POSITION, VELOCITY])
    if plane:
        x[[1, 4]] = 0.0
    return x if order == 6 else np.concatenate([x, POSITION + CARRIER_OFFSET, -0.7 * VELOCITY])


CASES: dict[str, tuple[Any, Any, Any, Any]] = {
    "axes": (axes, Cartesian(MASS, (0.5, 0.3, 0.4)), SPRING, single_mass),
    "mode": (dense, Cartesian(MASS, (0.5, 0.3, 0.4), MODE), SPRING, double_mass),
    "coupled": (dense, Cartesian(MASS, COUPLED), SPRING, single_mass),
    "coupled mode": (dense, Cartesian(MASS, COUPLED, MODE), SPRING, double_mass),
    "band": (banded, Cartesian(MASS, COUPLED), BAND, single_mass),
    "slack band": (banded, Cartesian(MASS, COUPLED), BandHand(150.0, 0.05, 0.07, 0.3), single_mass),
    "pantograph": (five_bar, HEAVY, SPRING, pantograph),
    "pantograph on a band": (five_bar, HEAVY, BAND, pantograph),
    "slack pantograph": (five_bar, HEAVY, BandHand(150.0, 0.05, 0.07, 0.3), pantograph),
}


@pytest.mark.parametrize("kind", CASES)
def test_sample_follows_the_differential_equation(kind: str) -> None:
    module, plant, hand, equations = CASES[kind]
    sampled = sampled_plant(plant, hand, Servo(PERIOD))
    is_planar = module is five_bar
    x, ledger = initial_state(sampled.order, plane=is_planar), np.arange(1.0, LEDGER_SIZE + 1.0)
    start = x.copy()
    expected = integrate_motion(equations(plant, hand), x)
    before = module.stored_energy(x, *INPUT[3:6], sampled.record)
    assert module.advance_body(x, ledger, INPUT, sampled.record) == RUNNING
    np.testing.assert_allclose(x, expected[:-2], rtol=2e-8, atol=1e-12)
    # Energies are added to the ledger's previous values.
    entries = ledger - np.arange(1.0, LEDGER_SIZE + 1.0)
    lost, hand_work = expected[-2:]
    work = np.array(INPUT[:3]) * (expected[:3] - start[:3])
    np.testing.assert_allclose(entries[SUPPLIED : SUPPLIED + 3], work, rtol=1e-6, atol=1e-13)
    assert entries[LOST] == pytest.approx(lost, rel=1e-7)
    assert entries[HAND] == pytest.approx(hand_work, rel=1e-7)
    assert entries[FRICTION] == 0.0
    size = np.abs(work).sum() + abs(lost) + abs(hand_work)
    assert entries[EXCHANGED] >= size * (1.0 - 1e-7)
    after = module.stored_energy(x, *anchor(PERIOD), sampled.record)
    assert after - before == pytest.approx(work.sum() + hand_work - lost, rel=1e-6)


@pytest.mark.parametrize("kind", CASES)
def test_stored_energy_sums_masses_and_springs(kind: str) -> None:
    module, plant, hand, _equations = CASES[kind]
    sampled = sampled_plant(plant, hand, Servo(PERIOD))
    x = initial_state(sampled.order, plane=module is five_bar)
    stretch = np.array(INPUT[3:6]) - x[-6:-3]
    if module is five_bar:
        stretch[1] = 0.0
        hand_mass = hand.mass if isinstance(hand, SpringHand) else 0.0
        xx, xz, zz, *_ = five_bar.linkage_dynamics(
            x[0], x[2], x[3], x[5], linkage_record(plant, hand_mass)
        )
        energy = 0.5 * (xx * x[3] ** 2 + 2.0 * xz * x[3] * x[5] + zz * x[5] ** 2)
    else:
        added_mass = hand.mass if isinstance(hand, SpringHand) else 0.0
        mass, mode = np.array(plant.mass), plant.resonance
        near, far = (mass + added_mass, 0.0 * mass)
        if mode:
            near, far = (1.0 - mode.mass_fraction) * mass, mode.mass_fraction * mass + added_mass
        energy = 0.5 * float(near @ x[3:6] ** 2 + far @ x[-3:] ** 2)
        if mode:
            spring = (2.0 * math.pi * mode.frequency) ** 2 * near * far / (near + far)
            energy += 0.5 * float(spring @ (x[6:9] - x[:3]) ** 2)
    energy += hand_energy(hand, stretch)
    result = module.stored_energy(x, *INPUT[3:6], sampled.record)
    assert result == pytest.approx(energy, rel=1e-11)


@pytest.mark.parametrize("kind", CASES)
@pytest.mark.parametrize("limit", [0.3, 400.0])
def test_dry_friction_opposes_and_stops_the_motion(kind: str, limit: float) -> None:
    """A limit that no force exceeds stops the handle within the sample; a smaller one slows it."""
    module, smooth, hand, _equations = CASES[kind]
    parameters = {
        name: getattr(smooth, name)
        for name in ("mass", "damping", "resonance")
        if hasattr(smooth, name)
    }
    if isinstance(smooth, Pantograph):
        plant: Any = Pantograph(smooth.linkage, smooth.masses, centre=smooth.centre, friction=limit)
        smooth = Pantograph(smooth.linkage, smooth.masses, centre=smooth.centre)
    else:
        plant = Cartesian(**parameters, friction=limit)
    results = []
    for body in (smooth, plant):
        sampled = sampled_plant(body, hand, Servo(PERIOD))
        x, ledger = initial_state(sampled.order, plane=module is five_bar), np.zeros(LEDGER_SIZE)
        assert module.advance_body(x, ledger, INPUT, sampled.record) == RUNNING
        results.append((x, ledger))
    (free, _), (x, ledger) = results
    if limit > 100.0:
        # The nonlinear Runge-Kutta substeps stop it up to their error.
        assert np.abs(x[3:6]).max() < (1e-12 if module in (axes, dense) else 3e-3)
        return
    assert ledger[FRICTION] < 0.0
    speed = np.linalg.norm(x[3:6])
    assert speed < np.linalg.norm(free[3:6])
    # Work against the mean velocity, to first order in the period.
    distance = float(np.linalg.norm(x[:3] - initial_state(6, plane=module is five_bar)[:3]))
    assert ledger[FRICTION] == pytest.approx(-limit * distance, rel=0.1)


def test_friction_force_for_a_mass_matrix() -> None:
    """It stops M v within the time, or is the limit in the direction of -v."""
    mass = np.array([[2.0, 0.3, -0.1], [0.3, 1.0, 0.4], [-0.1, 0.4, 3.0]])
    v = np.array([0.5, -0.7, 0.2])
    stopping_force = -mass @ v / 0.01
    size = float(np.linalg.norm(stopping_force))
    for limit in (size * (1.0 + 1e-12), 2.0 * size):
        force = hands.friction_force(*v, limit, mass, 0.01)
        np.testing.assert_allclose(force, stopping_force, rtol=1e-14)
    for limit in (size * (1.0 - 1e-6), 0.1 * size):
        force = np.array(hands.friction_force(*v, limit, mass, 0.01))
        np.testing.assert_allclose(force, -limit * v / np.linalg.norm(v), rtol=1e-14)
    assert hands.friction_force(0.0, 0.0, 0.0, 1.0, mass, 0.01) == (0.0, 0.0, 0.0)
    assert hands.friction_force(0.0, 0.0, 0.0, 0.0, mass, 0.01) == (0.0, 0.0, 0.0)


# --- bands ----------------------------------------------------------------------------------------


def hand_record(hand: Any) -> hands.HandRecord:
    """Return the record of a hand as a linkage receives it."""
    record = sampled_plant(HEAVY, hand, Servo(PERIOD)).record[1]
    assert isinstance(record, hands.HandRecord)
    return record


@pytest.mark.parametrize("hand", [SPRING, BAND, BandHand(150.0, 0.05, 0.07, 0.3)])
@pytest.mark.parametrize("stretch", [(0.01, -0.02, 0.03), (-0.03, 0.02, -0.04), (0.0, 0.1, 0.06)])
def test_hand_force_and_energy_follow_their_formulas(hand: Any, stretch: Any) -> None:
    rate = np.array([0.3, -0.5, 0.2])
    pull, lost = hand_force(hand, np.array(stretch), rate)
    result = hands.hand_force(*stretch, *rate, hand_record(hand))
    np.testing.assert_allclose(result, [*pull, lost], rtol=1e-12)
    energy = hand_energy(hand, np.array(stretch))
    assert hands.hand_energy(*stretch, hand_record(hand)) == pytest.approx(energy, rel=1e-12)


def test_band_changes_state_when_one_end_of_a_step_is_slack() -> None:
    """For each direction by itself, so that every component counts."""
    record = hand_record(BAND)
    rest, length = BAND.rest_length, BAND.length
    taut, slack = 1.001 * rest, 0.999 * rest
    for axis in range(3):
        for sign in (1.0, -1.0):
            taut_end, slack_end = np.zeros(3), np.zeros(3)
            taut_end[axis], slack_end[axis] = sign * taut, sign * slack
            taut_end[2] += length
            slack_end[2] += length
            assert hands.band_changes_state(*taut_end, *slack_end, record)
            assert hands.band_changes_state(*slack_end, *taut_end, record)
            assert not hands.band_changes_state(*taut_end, *taut_end, record)
            assert not hands.band_changes_state(*slack_end, *slack_end, record)
            assert not hands.band_changes_state(*taut_end, *slack_end, hand_record(SPRING))


@pytest.mark.parametrize("kind", ["band", "pantograph on a band"])
def test_band_turning_slack_within_a_sample(kind: str) -> None:
    """Small substeps at the kink: the equations hold and the energies agree."""
    module, plant, _hand, equations = CASES[kind]
    is_planar = module is five_bar
    x = np.concatenate([POSITION, [0.4, -0.3, -1.5]])
    if is_planar:
        x[[1, 4]] = 0.0
    vector = np.array(INPUT[3:6]) - x[:3]
    if is_planar:
        vector[1] = 0.0
    length = float(np.linalg.norm(vector - [0.0, 0.0, 0.07]))
    # Slightly taut: it turns slack within the sample.
    hand = BandHand(4000.0, 4000.0 * (0.07 - length + 1e-3), 0.07, 0.3)
    sampled = sampled_plant(plant, hand, Servo(PERIOD))
    start, ledger = x.copy(), np.zeros(LEDGER_SIZE)
    expected = integrate_motion(equations(plant, hand), x)
    is_taut = [
        np.linalg.norm(a - p - [0.0, 0.0, 0.07]) > hand.rest_length
        for a, p in ((np.array(INPUT[3:6]), start[:3]), (anchor(PERIOD), expected[:3]))
    ]
    assert is_taut == [True, False]
    assert module.advance_body(x, ledger, INPUT, sampled.record) == RUNNING
    np.testing.assert_allclose(x, expected[:-2], rtol=1e-7, atol=1e-10)
    assert ledger[LOST] == pytest.approx(expected[-2], rel=1e-7)
    assert ledger[HAND] == pytest.approx(expected[-1], rel=1e-6)


# --- substeps and workspace -----------------------------------------------------------------------


def test_substeps_are_a_hundredth_of_a_time_constant() -> None:
    for friction, least in ((0.0, 1), (0.1, 4)):
        for rate, count in ((10.0, 1), (0.0, 1), (2500.0, 250), (2500.1, 251), (33.0, 4)):
            assert substep_count(friction, rate, 1e-3) == max(least, count)
    record = linkage_record(HEAVY)
    for vx, vz, rate, expected in (
        (0.0, 0.0, 0.0, 1),
        (0.0, 0.0, 7.3, 8),
        (0.3, -0.4, 7.3, 8 + int(0.3 + 2.0 / 0.063)),
        (1e9, 0.0, 0.0, 1_000_000),
    ):
        assert five_bar.linkage_step_count(vx, vz, rate, 1.0, record) == expected


@pytest.mark.parametrize("damping", [0.5, COUPLED])
@pytest.mark.parametrize("mode", [None, MODE])
def test_linear_sample_has_substeps_only_with_friction(
    damping: Any, mode: Resonance | None
) -> None:
    for friction, count in ((0.0, 1), (0.1, 4)):
        record = sampled_plant(
            Cartesian(MASS, damping, mode, friction), SPRING, Servo(PERIOD)
        ).record
        assert (record.substeps, record.substep) == (count, PERIOD / count)  # type: ignore[attr-defined]  # of its own record
        assert record.stopping_mass.any() == (
            friction > 0.0 or damping is COUPLED or mode is not None
        )  # type: ignore[attr-defined]  # of its own record


def test_state_is_unchanged_when_the_sample_leaves_the_workspace() -> None:
    sampled = sampled_plant(HEAVY, SPRING, Servo(0.05))
    x, ledger = np.array([0.0, 0.0, 0.03, 0.1, 0.0, 3.0]), np.zeros(LEDGER_SIZE)
    start = x.copy()
    assert five_bar.advance_body(x, ledger, INPUT, sampled.record) == LEFT_WORKSPACE
    np.testing.assert_array_equal(x, start)
    assert not ledger.any()


@pytest.mark.parametrize("inside", [True, False])
@pytest.mark.parametrize("inside_only", [True, False])
def test_brakes_act_in_contact_or_everywhere(inside: bool, inside_only: bool) -> None:
    plant = Pantograph(masses=HEAVY.masses, centre=HEAVY.centre, inside_only=inside_only)
    sampled = sampled_plant(plant, SpringHand(), Servo(PERIOD))
    x, ledger = initial_state(6, plane=True), np.zeros(LEDGER_SIZE)
    five_bar.advance_body(x, ledger, INPUT._replace(in_contact=inside), sampled.record)
    assert (ledger[LOST] > 0.0) == (inside or not inside_only)


def test_prescribed_handle_follows_its_anchor() -> None:
    sampled = sampled_plant(Cartesian(), PrescribedHand(), Servo(PERIOD))
    x, ledger = np.zeros(6), np.ones(LEDGER_SIZE)
    assert prescribed.advance_body(x, ledger, INPUT, sampled.record) == RUNNING
    np.testing.assert_allclose(x[:3], anchor(PERIOD), rtol=1e-15)
    np.testing.assert_array_equal(x[3:], INPUT[6:9])
    work = np.array(INPUT[:3]) * PERIOD * INPUT[6:9]
    np.testing.assert_allclose(ledger[:3] - 1.0, work, rtol=1e-9)
    assert ledger[HAND] - 1.0 == pytest.approx(-work.sum(), rel=1e-9)
    np.testing.assert_array_equal(ledger[[LOST, FRICTION]], 1.0)
    assert prescribed.stored_energy(x, 1.0, 2.0, 3.0, sampled.record) == 0.0


def test_dense_form_of_an_uncoupled_body() -> None:
    """It solves the same equations as the per-axis kernels."""
    plant = Cartesian(MASS, (0.5, 0.3, 0.4))
    sampled = coupled_plant(plant, SPRING, PERIOD)
    x, ledger = initial_state(sampled.order), np.zeros(LEDGER_SIZE)
    expected = integrate_motion(single_mass(plant, SPRING), x)
    assert dense.advance_body(x, ledger, INPUT, sampled.record) == RUNNING
    np.testing.assert_allclose(x, expected[:-2], rtol=1e-9)
    assert ledger[LOST] == pytest.approx(expected[-2], rel=1e-9)
    assert ledger[HAND] == pytest.approx(expected[-1], rel=1e-9)
