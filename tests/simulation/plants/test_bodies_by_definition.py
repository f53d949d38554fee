"""One sample of every body, in plain Python, against its differential equation.

The equations are written apart and integrated by SciPy; nothing of the code is used but its
numbers, and the linkage's inertia and damping, which have tests of their own.
"""

from __future__ import annotations

import math
from typing import Any

import numpy as np
import pytest
from scipy.integrate import solve_ivp

from asperity.core.checks import FloatArray
from asperity.devices.five_bar import handle_damping
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
from asperity.simulation.kernels import axis_body as axes
from asperity.simulation.kernels import coupled_body as dense
from asperity.simulation.kernels import elastic_band as banded
from asperity.simulation.kernels import hand_force as hands
from asperity.simulation.kernels import pantograph_dynamics as five_bar
from asperity.simulation.kernels import prescribed_motion as prescribed
from asperity.simulation.kernels import resonant_axis as resonant
from asperity.simulation.kernels.body_interface import LEFT_WORKSPACE, RUNNING, SampleInput
from asperity.simulation.kernels.energy_ledger import (
    EXCHANGED,
    FRICTION,
    HAND,
    LEDGER_SIZE,
    LOST,
    SUPPLIED,
)
from asperity.simulation.pantograph import linkage_record
from asperity.simulation.plants import coupled_plant, sampled_plant, substep_count

MASS = (0.05, 0.04, 0.03)
COUPLED = np.array([[2.0, 0.5, 0.1], [0.5, 1.0, -0.2], [0.1, -0.2, 0.7]])
MODE = Resonance(60.0, 0.08, 0.4)
SPRING = SpringHand([300.0, 200.0, 250.0], [2.0, 1.5, 1.0], mass=0.02, force=(0.1, -0.2, -0.3))
BAND = BandHand(stiffness=150.0, tension=2.0, length=0.07, damping=0.3)
HEAVY = Pantograph(masses=LinkMasses(0.011, 0.007, 0.009, rotor=2e-6), centre=(0.02, 0.09))
HELD = SampleInput(0.4, -0.7, 1.1, 0.003, -0.004, 0.006, 0.2, -0.3, 0.25, True)
PLACE, SPEED = np.array([0.004, 0.003, -0.005]), np.array([0.3, -0.2, 0.4])
BESIDE = np.array([1e-4, -2e-4, 3e-4])
PERIOD = 2e-3


def pull_of(hand: Hand, stretch: FloatArray, rate: FloatArray) -> tuple[FloatArray, float]:
    """Return force of spring and damper, or band, on what it holds [N], and the loss [W]."""
    drag = np.asarray(hand.damping) * rate  # type: ignore[union-attr]  # a spring's or a band's
    lost = float(drag @ rate)
    if isinstance(hand, SpringHand):
        return np.asarray(hand.stiffness) * stretch + drag, lost
    assert isinstance(hand, BandHand)
    away = stretch - [0.0, 0.0, hand.length]
    length = float(np.linalg.norm(away))
    over = max(length - (hand.length - hand.tension / hand.stiffness), 0.0)
    return hand.stiffness * over * away / length + drag, lost


def energy_of(hand: Hand, stretch: FloatArray) -> float:
    if isinstance(hand, SpringHand):
        return 0.5 * float(np.asarray(hand.stiffness) @ stretch**2)
    assert isinstance(hand, BandHand)
    over = float(np.linalg.norm(stretch - [0.0, 0.0, hand.length]))
    return 0.5 * hand.stiffness * max(over - hand.length + hand.tension / hand.stiffness, 0.0) ** 2


def integrated(accelerate: Any, x: FloatArray, span: float = PERIOD) -> FloatArray:
    """Return state, loss and work of the hand at the end; ``accelerate`` gives (x', loss, work)."""
    found = solve_ivp(
        lambda t, y: np.append(*accelerate(t, y[:-2])), (0.0, span), [*x, 0.0, 0.0], "DOP853",
        rtol=1e-12, atol=1e-14, max_step=span / 50.0,
    )  # fmt: skip
    return np.asarray(found.y[:, -1])


def anchor(t: float) -> FloatArray:
    return np.array(HELD[3:6]) + t * np.array(HELD[6:9])


def single(plant: Cartesian, hand: Hand) -> Any:
    """One mass: M p'' = f + g - B p' + pull."""
    mass = np.array(plant.mass) + (hand.mass if isinstance(hand, SpringHand) else 0.0)
    press = np.array(hand.force) if isinstance(hand, SpringHand) else np.zeros(3)
    force, speed = np.array(HELD[:3]), np.array(HELD[6:9])

    def rate(t: float, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        p, v = x[:3], x[3:6]
        pull, lost = pull_of(hand, anchor(t) - p, speed - v)
        drag = plant.damping @ v
        gain = (force + press + pull - drag) / mass
        return np.append(v, gain), np.array([lost + drag @ v, speed @ pull + press @ v])

    return rate


def double(plant: Cartesian, hand: SpringHand) -> Any:
    """Two masses and a spring of the mode between them; the hand is on the far one."""
    mode, whole = plant.resonance, np.array(plant.mass)
    assert mode is not None
    near, far = (1.0 - mode.mass_fraction) * whole, mode.mass_fraction * whole + hand.mass
    omega, reduced = 2.0 * math.pi * mode.frequency, near * far / (near + far)
    spring, damper = omega**2 * reduced, 2.0 * mode.damping_ratio * omega * reduced
    force, speed, press = np.array(HELD[:3]), np.array(HELD[6:9]), np.array(hand.force)

    def rate(t: float, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        p, v, r, w = x.reshape(4, 3)
        pull, lost = pull_of(hand, anchor(t) - r, speed - w)
        between = spring * (r - p) + damper * (w - v)
        drag = plant.damping @ v
        gains = (force - drag + between) / near, (press + pull - between) / far
        lost += float(drag @ v + (damper * (w - v)) @ (w - v))
        return np.concatenate([v, gains[0], w, gains[1]]), np.array(
            [lost, speed @ pull + press @ w]
        )

    return rate


def linkage(plant: Pantograph, hand: Hand) -> Any:
    """M p'' + c = f + g - B p' + pull in the x-z plane."""
    held = hand.mass if isinstance(hand, SpringHand) else 0.0
    press = np.array(hand.force) if isinstance(hand, SpringHand) else np.zeros(3)
    bar, force, speed = linkage_record(plant, held), np.array(HELD[:3]), np.array(HELD[6:9])
    speed[1], plane = 0.0, [0, 2]

    def rate(t: float, x: FloatArray) -> tuple[FloatArray, FloatArray]:
        p, v = x[:3], x[3:6]
        pull, lost = pull_of(hand, (anchor(t) - p) * [1.0, 0.0, 1.0], (speed - v) * [1.0, 0.0, 1.0])
        xx, xz, zz, cx, cz, *_ = five_bar.linkage_dynamics(p[0], p[2], v[0], v[2], bar)
        place = np.add(plant.centre, p[plane])
        drag = handle_damping(plant.linkage, plant.joint_damping, place) @ v[plane]
        gain = np.linalg.solve(
            [[xx, xz], [xz, zz]], (force + press + pull)[plane] - drag - [cx, cz]
        )
        work = speed @ pull + press[plane] @ v[plane]
        return np.array([v[0], 0.0, v[2], gain[0], 0.0, gain[1]]), np.array(
            [lost + drag @ v[plane], work]
        )

    return rate


def begin(order: int, *, plane: bool = False) -> FloatArray:
    x = np.concatenate([PLACE, SPEED])
    if plane:
        x[[1, 4]] = 0.0
    return x if order == 6 else np.concatenate([x, PLACE + BESIDE, -0.7 * SPEED])


CASES: dict[str, tuple[Any, Any, Any, Any]] = {
    "axes": (axes, Cartesian(MASS, (0.5, 0.3, 0.4)), SPRING, single),
    "mode": (axes, Cartesian(MASS, (0.5, 0.3, 0.4), MODE), SPRING, double),
    "coupled": (dense, Cartesian(MASS, COUPLED), SPRING, single),
    "coupled mode": (dense, Cartesian(MASS, COUPLED, MODE), SPRING, double),
    "band": (banded, Cartesian(MASS, COUPLED), BAND, single),
    "slack band": (banded, Cartesian(MASS, COUPLED), BandHand(150.0, 0.05, 0.07, 0.3), single),
    "pantograph": (five_bar, HEAVY, SPRING, linkage),
    "pantograph on a band": (five_bar, HEAVY, BAND, linkage),
    "slack pantograph": (five_bar, HEAVY, BandHand(150.0, 0.05, 0.07, 0.3), linkage),
}


@pytest.fixture
def linked(monkeypatch: pytest.MonkeyPatch) -> Any:
    """Bind the calls of ``axes`` as the linker does."""

    def bind(plant: Any) -> None:
        if not plant.resonance:
            return
        for name in ("advance_axis", "final_velocity"):
            monkeypatch.setattr(axes, name, getattr(resonant, name))

    return bind


@pytest.mark.parametrize("kind", CASES)
def test_a_sample_follows_the_equations(kind: str, linked: Any) -> None:
    module, plant, hand, equations = CASES[kind]
    made = sampled_plant(plant, hand, Servo(PERIOD))
    if module is axes:
        linked(plant)
    flat = module is five_bar
    x, ledger = begin(made.order, plane=flat), np.arange(1.0, LEDGER_SIZE + 1.0)
    start = x.copy()
    expected = integrated(equations(plant, hand), x)
    store = module if module is not axes else (resonant if plant.resonance else axes)
    before = store.stored_energy(x, *HELD[3:6], made.record)
    assert module.advance_body(x, ledger, HELD, made.record) == RUNNING
    np.testing.assert_allclose(x, expected[:-2], rtol=2e-8, atol=1e-12)
    # What is booked is added to what was there.
    booked = ledger - np.arange(1.0, LEDGER_SIZE + 1.0)
    lost, hand_work = expected[-2:]
    work = np.array(HELD[:3]) * (expected[:3] - start[:3])
    np.testing.assert_allclose(booked[SUPPLIED : SUPPLIED + 3], work, rtol=1e-6, atol=1e-13)
    assert booked[LOST] == pytest.approx(lost, rel=1e-7)
    assert booked[HAND] == pytest.approx(hand_work, rel=1e-7)
    assert booked[FRICTION] == 0.0
    size = np.abs(work).sum() + abs(lost) + abs(hand_work)
    assert booked[EXCHANGED] >= size * (1.0 - 1e-7)
    after = store.stored_energy(x, *anchor(PERIOD), made.record)
    assert after - before == pytest.approx(work.sum() + hand_work - lost, rel=1e-6)


@pytest.mark.parametrize("kind", CASES)
def test_stored_energy_is_that_of_masses_and_springs(kind: str) -> None:
    module, plant, hand, _equations = CASES[kind]
    made = sampled_plant(plant, hand, Servo(PERIOD))
    x = begin(made.order, plane=module is five_bar)
    away = np.array(HELD[3:6]) - x[-6:-3]
    if module is five_bar:
        away[1] = 0.0
        held = hand.mass if isinstance(hand, SpringHand) else 0.0
        xx, xz, zz, *_ = five_bar.linkage_dynamics(
            x[0], x[2], x[3], x[5], linkage_record(plant, held)
        )
        energy = 0.5 * (xx * x[3] ** 2 + 2.0 * xz * x[3] * x[5] + zz * x[5] ** 2)
    else:
        extra = hand.mass if isinstance(hand, SpringHand) else 0.0
        mass, mode = np.array(plant.mass), plant.resonance
        near, far = (mass + extra, 0.0 * mass)
        if mode:
            near, far = (1.0 - mode.mass_fraction) * mass, mode.mass_fraction * mass + extra
        energy = 0.5 * float(near @ x[3:6] ** 2 + far @ x[-3:] ** 2)
        if mode:
            spring = (2.0 * math.pi * mode.frequency) ** 2 * near * far / (near + far)
            energy += 0.5 * float(spring @ (x[6:9] - x[:3]) ** 2)
    energy += energy_of(hand, away)
    store = module
    if module is axes:
        store = resonant if plant.resonance else axes
    found = store.stored_energy(x, *HELD[3:6], made.record)
    assert found == pytest.approx(energy, rel=1e-11)


@pytest.mark.parametrize("kind", CASES)
@pytest.mark.parametrize("limit", [0.3, 400.0])
def test_dry_friction_acts_against_the_motion_and_stops_it(
    kind: str, limit: float, linked: Any
) -> None:
    """A limit that nothing exceeds stops the handle at the end of each part; else it slows."""
    module, smooth, hand, _equations = CASES[kind]
    given = {name: getattr(smooth, name) for name in ("mass", "damping", "resonance")
             if hasattr(smooth, name)}  # fmt: skip
    if isinstance(smooth, Pantograph):
        plant: Any = Pantograph(smooth.linkage, smooth.masses, centre=smooth.centre, friction=limit)
        smooth = Pantograph(smooth.linkage, smooth.masses, centre=smooth.centre)
    else:
        plant = Cartesian(**given, friction=limit)
        linked(plant)
    ends = []
    for one in (smooth, plant):
        made = sampled_plant(one, hand, Servo(PERIOD))
        x, ledger = begin(made.order, plane=module is five_bar), np.zeros(LEDGER_SIZE)
        assert module.advance_body(x, ledger, HELD, made.record) == RUNNING
        ends.append((x, ledger))
    (free, _), (x, ledger) = ends
    if limit > 100.0:
        # A Runge-Kutta part, not linear, stops but for its error.
        assert np.abs(x[3:6]).max() < (1e-12 if module in (axes, dense) else 3e-3)
        return
    assert ledger[FRICTION] < 0.0
    speed = np.linalg.norm(x[3:6])
    assert speed < np.linalg.norm(free[3:6])
    # Against the mean velocity, to the first order of the sample.
    way = float(np.linalg.norm(x[:3] - begin(6, plane=module is five_bar)[:3]))
    assert ledger[FRICTION] == pytest.approx(-limit * way, rel=0.1)


def test_the_friction_of_masses_that_differ() -> None:
    """It stops M v in the time, or is the limit, exactly against v."""
    mass = np.array([[2.0, 0.3, -0.1], [0.3, 1.0, 0.4], [-0.1, 0.4, 3.0]])
    v = np.array([0.5, -0.7, 0.2])
    need = -mass @ v / 0.01
    size = float(np.linalg.norm(need))
    for limit in (size * (1.0 + 1e-12), 2.0 * size):
        found = dense.friction_force(*v, limit, mass, 0.01)
        np.testing.assert_allclose(found, need, rtol=1e-14)
    for limit in (size * (1.0 - 1e-6), 0.1 * size):
        found = np.array(dense.friction_force(*v, limit, mass, 0.01))
        np.testing.assert_allclose(found, -limit * v / np.linalg.norm(v), rtol=1e-14)
    assert dense.friction_force(0.0, 0.0, 0.0, 1.0, mass, 0.01) == (0.0, 0.0, 0.0)
    assert dense.friction_force(0.0, 0.0, 0.0, 0.0, mass, 0.01) == (0.0, 0.0, 0.0)


def test_a_product_by_columns_is_that_of_its_matrix() -> None:
    rng = np.random.default_rng(2)
    columns, z, result = rng.normal(size=(7, 5)), rng.normal(size=7), np.full(5, 3.0)
    dense.multiply_columns(columns, z, result)
    np.testing.assert_allclose(result, columns.T @ z, rtol=1e-13)


# --- bands ----------------------------------------------------------------------------------------


def record_of(hand: Any) -> hands.HandRecord:
    """Return a hand as a linkage is given it."""
    found = sampled_plant(HEAVY, hand, Servo(PERIOD)).record[1]
    assert isinstance(found, hands.HandRecord)
    return found


@pytest.mark.parametrize("hand", [SPRING, BAND, BandHand(150.0, 0.05, 0.07, 0.3)])
@pytest.mark.parametrize("stretch", [(0.01, -0.02, 0.03), (-0.03, 0.02, -0.04), (0.0, 0.1, 0.06)])
def test_a_hand_pulls_as_its_formula_says(hand: Any, stretch: Any) -> None:
    rate = np.array([0.3, -0.5, 0.2])
    pull, lost = pull_of(hand, np.array(stretch), rate)
    found = hands.hand_force(*stretch, *rate, record_of(hand))
    np.testing.assert_allclose(found, [*pull, lost], rtol=1e-12)
    energy = energy_of(hand, np.array(stretch))
    assert hands.hand_energy(*stretch, record_of(hand)) == pytest.approx(energy, rel=1e-12)


def test_a_band_turns_where_one_end_of_a_step_is_slack() -> None:
    """Each direction apart, so that every square counts."""
    record = record_of(BAND)
    rest, length = BAND.rest_length, BAND.length
    taut, slack = 1.001 * rest, 0.999 * rest
    for axis in range(3):
        for sign in (1.0, -1.0):
            out, within = np.zeros(3), np.zeros(3)
            out[axis], within[axis] = sign * taut, sign * slack
            out[2] += length
            within[2] += length
            assert hands.band_changes_state(*out, *within, record)
            assert hands.band_changes_state(*within, *out, record)
            assert not hands.band_changes_state(*out, *out, record)
            assert not hands.band_changes_state(*within, *within, record)
            assert not hands.band_changes_state(*out, *within, record_of(SPRING))


@pytest.mark.parametrize("kind", ["band", "pantograph on a band"])
def test_a_band_that_turns_slack_within_a_sample(kind: str) -> None:
    """Small steps at the kink: energy closes to what they leave, and the equations hold."""
    module, plant, _hand, equations = CASES[kind]
    flat = module is five_bar
    x = np.concatenate([PLACE, [0.4, -0.3, -1.5]])
    if flat:
        x[[1, 4]] = 0.0
    away = np.array(HELD[3:6]) - x[:3]
    if flat:
        away[1] = 0.0
    length = float(np.linalg.norm(away - [0.0, 0.0, 0.07]))
    # Taut by a little: it turns slack on the way.
    hand = BandHand(4000.0, 4000.0 * (0.07 - length + 1e-3), 0.07, 0.3)
    made = sampled_plant(plant, hand, Servo(PERIOD))
    start, ledger = x.copy(), np.zeros(LEDGER_SIZE)
    expected = integrated(equations(plant, hand), x)
    ends = [
        np.linalg.norm(a - p - [0.0, 0.0, 0.07]) > hand.rest_length
        for a, p in ((np.array(HELD[3:6]), start[:3]), (anchor(PERIOD), expected[:3]))
    ]
    assert ends == [True, False]
    assert module.advance_body(x, ledger, HELD, made.record) == RUNNING
    np.testing.assert_allclose(x, expected[:-2], rtol=1e-7, atol=1e-10)
    assert ledger[LOST] == pytest.approx(expected[-2], rel=1e-7)
    assert ledger[HAND] == pytest.approx(expected[-1], rel=1e-6)


# --- steps and places -----------------------------------------------------------------------------


def test_a_sample_is_cut_into_hundredths_of_a_time_constant() -> None:
    for friction, least in ((0.0, 1), (0.1, 4)):
        for rate, parts in ((10.0, 1), (0.0, 1), (2500.0, 250), (2500.1, 251), (33.0, 4)):
            assert substep_count(friction, rate, 1e-3) == max(least, parts)
    bar = linkage_record(HEAVY)
    for vx, vz, rate, expected in (
        (0.0, 0.0, 0.0, 1), (0.0, 0.0, 7.3, 8), (0.3, -0.4, 7.3, 8 + int(0.3 + 2.0 / 0.063)),
        (1e9, 0.0, 0.0, 1_000_000),
    ):  # fmt: skip
        assert five_bar.linkage_step_count(vx, vz, rate, 1.0, bar) == expected


@pytest.mark.parametrize("damping", [0.5, COUPLED])
@pytest.mark.parametrize("mode", [None, MODE])
def test_only_friction_cuts_a_linear_sample(damping: Any, mode: Resonance | None) -> None:
    for friction, parts in ((0.0, 1), (0.1, 4)):
        made = sampled_plant(Cartesian(MASS, damping, mode, friction), SPRING, Servo(PERIOD)).record
        assert (made.substeps, made.substep) == (parts, PERIOD / parts)  # type: ignore[attr-defined]  # of a linear body
        assert made.stopping_mass.any() == (friction > 0.0 or damping is COUPLED)  # type: ignore[attr-defined]  # likewise


def test_the_arms_reach_where_the_angles_at_the_elbows_allow() -> None:
    """|cos| of the angle at either elbow below √(1 - s²), and before the motors."""
    plant, least = HEAVY, 0.3
    bar, links = linkage_record(plant), plant.linkage
    rng = np.random.default_rng(6)
    seen = set()
    for x, z in rng.uniform(-0.16, 0.16, (2000, 2)):
        place = np.add(plant.centre, (x, z))
        cosines = [
            (links.proximal**2 + links.distal**2 - (place[0] - motor) ** 2 - place[1] ** 2)
            / (2.0 * links.proximal * links.distal)
            for motor in (0.0, -links.base)
        ]
        reached = bool(place[1] > 0.0 and max(map(abs, cosines)) < math.sqrt(1.0 - least**2))
        assert five_bar.linkage_reaches(x, z, least, bar) == reached
        seen.add((reached, place[1] > 0.0, cosines[0] > 0.0, cosines[1] > 0.0))
    assert len(seen) > 6


def test_what_leaves_the_workspace_stays_where_it_was() -> None:
    made = sampled_plant(HEAVY, SPRING, Servo(0.05))
    x, ledger = np.array([0.0, 0.0, 0.03, 0.1, 0.0, 3.0]), np.zeros(LEDGER_SIZE)
    start = x.copy()
    assert five_bar.advance_body(x, ledger, HELD, made.record) == LEFT_WORKSPACE
    np.testing.assert_array_equal(x, start)
    assert not ledger.any()


@pytest.mark.parametrize("inside", [True, False])
@pytest.mark.parametrize("only", [True, False])
def test_brakes_are_on_where_they_should(inside: bool, only: bool) -> None:
    plant = Pantograph(masses=HEAVY.masses, centre=HEAVY.centre, inside_only=only)
    made = sampled_plant(plant, SpringHand(), Servo(PERIOD))
    x, ledger = begin(6, plane=True), np.zeros(LEDGER_SIZE)
    five_bar.advance_body(x, ledger, HELD._replace(in_contact=inside), made.record)
    assert (ledger[LOST] > 0.0) == (inside or not only)


def test_a_moved_handle_is_where_its_anchor_is() -> None:
    made = sampled_plant(Cartesian(), PrescribedHand(), Servo(PERIOD))
    x, ledger = np.zeros(6), np.ones(LEDGER_SIZE)
    assert prescribed.advance_body(x, ledger, HELD, made.record) == RUNNING
    np.testing.assert_allclose(x[:3], anchor(PERIOD), rtol=1e-15)
    np.testing.assert_array_equal(x[3:], HELD[6:9])
    work = np.array(HELD[:3]) * PERIOD * HELD[6:9]
    np.testing.assert_allclose(ledger[:3] - 1.0, work, rtol=1e-9)
    assert ledger[HAND] - 1.0 == pytest.approx(-work.sum(), rel=1e-9)
    np.testing.assert_array_equal(ledger[[LOST, FRICTION]], 1.0)
    assert prescribed.stored_energy(x, 1.0, 2.0, 3.0, made.record) == 0.0


@pytest.mark.parametrize("mode", [None, MODE])
def test_whole_matrices_are_those_of_the_axes(mode: Resonance | None) -> None:
    """The dense form of a body without coupling, with friction: the same equations."""
    plant = Cartesian(MASS, (0.5, 0.3, 0.4), mode)
    made = coupled_plant(plant, SPRING, PERIOD)
    x, ledger = begin(made.order), np.zeros(LEDGER_SIZE)
    expected = integrated((double if mode else single)(plant, SPRING), x)
    assert dense.advance_body(x, ledger, HELD, made.record) == RUNNING
    np.testing.assert_allclose(x, expected[:-2], rtol=1e-9)
    assert ledger[LOST] == pytest.approx(expected[-2], rel=1e-9)
    assert ledger[HAND] == pytest.approx(expected[-1], rel=1e-9)
