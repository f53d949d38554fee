"""Friction of a closed body: along its surface everywhere, and never a gain."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from bench.stress import friction as friction_stress
from tests.helpers.c_programs import as_exported, header, kernel_ticks, library, same_bits, ticks

import asperity as asp
from asperity.analysis import characteristic_number, one_sided_number, worst_loop
from asperity.analysis.energy.press import holds_at_any_press, mean_press
from asperity.analysis.energy.straight_scan import friction_scan
from asperity.analysis.passivity import criteria
from asperity.analysis.passivity.verdict import passivity
from asperity.core.errors import ParameterError
from asperity.devices import parse_device
from asperity.kernels.loop_functions import drag_anchor_in_space
from asperity.recording.recording import open_recording
from asperity.rendering import bake_mesh
from asperity.report.sentences.assumption_sentences import default_depth_text
from asperity.simulation import Cartesian, PrescribedHand, Servo, Strokes, simulate
from asperity.surface import Surface

MU, DEPTH, HALF = 0.5, 1e-4, 2e-3
SIDE = np.array([HALF - DEPTH, 0.0, 0.0])


@pytest.fixture(scope="module")
def body(tmp_path_factory: pytest.TempPathFactory) -> Surface:
    """A cube from z = -4 mm to 0, with friction."""
    path = friction_stress.cube(tmp_path_factory.mktemp("body"))
    return bake_mesh(path, "m", 3e-4, 2e-4)._replace(_explicit_parameters={"friction": MU})


def line(start: list[float], end: list[float], count: int = 801) -> np.ndarray:
    return np.linspace(start, end, count)


@pytest.mark.parametrize("axis", [1, 2])
def test_friction_acts_along_a_vertical_side(body: Surface, axis: int) -> None:
    path = np.tile(SIDE, (801, 1))
    path[:, axis] += np.linspace(-3e-3, -1e-3, 801) + (2e-3 if axis == 1 else 0.0)
    path[:, 2] -= 2e-3 if axis == 1 else 0.0
    force = body.trace(path)[-1]
    expected = np.array([1000.0 * DEPTH, 0.0, 0.0])
    expected[axis] = -MU * 1000.0 * DEPTH
    np.testing.assert_allclose(force, expected, rtol=1e-2, atol=1e-9)  # nodes of 0.2 mm


def test_pressing_alone_feels_no_friction(body: Surface) -> None:
    path = line([HALF + DEPTH, 0.0, -2e-3], [HALF - 2 * DEPTH, 0.0, -2e-3])
    np.testing.assert_allclose(body.trace(path), body.without_friction().force(path), atol=1e-12)


def test_a_body_holds_down_to_its_depth_alone(body: Surface) -> None:
    """Its field ends within it, that of a surface does not."""
    assert not holds_at_any_press(body)


def test_press_is_the_mean_where_the_body_is(body: Surface) -> None:
    """On the cube, not beside it, where there is no force."""
    plain = body.without_friction()
    side = np.linspace(-1.5 * HALF, 1.5 * HALF, 301)
    x, y = np.meshgrid(side, side)
    points = np.column_stack([x.ravel(), y.ravel(), np.full(x.size, -plain.texture.depth_limit)])
    forces = plain.force(points)[:, 2]
    assert mean_press(plain) == pytest.approx(forces[forces != 0.0].mean(), rel=0.03)
    assert forces.mean() < 0.6 * mean_press(plain)
    assert default_depth_text(plain) == "Default max depth 300 µm: that of the field"


def test_deflection_has_three_coordinates(body: Surface) -> None:
    point = SIDE + np.array([0.0, 0.0, -2e-3])
    force = body.force(point, deflection=[0.0, 0.0, 1e-5])
    assert force == pytest.approx([0.1, 0.0, -250.0 * 1e-5], abs=1e-6)
    slipping = body.force(point, deflection=[0.0, 3e-3, -4e-3])
    assert slipping == pytest.approx([0.1, -0.03, 0.04], abs=1e-6)
    with pytest.raises(ParameterError, match=r"deflection .*shape"):
        body.force(point, deflection=[0.0, 1e-5])
    with pytest.raises(ParameterError, match="no Jacobian on a closed body"):
        body.jacobian(point, deflection=[0.0, 1e-5, 0.0])
    with pytest.raises(ParameterError, match="friction_modulation must be 0 on a closed body"):
        Surface(body.texture, "H", friction=0.4, friction_modulation=0.5)


def test_held_friction_gains_at_most_half_the_square_of_a_step(body: Surface) -> None:
    """S₊ - S <= κ d·u + κ|u|²/2 on every tick, also round the edges of the cube."""
    rng = np.random.default_rng(4)
    path = HALF * (1.0 - 0.05) * np.tanh(np.cumsum(rng.normal(0.0, 0.05, (4000, 3)), axis=0))
    path[:, 2] -= HALF
    kappa = body.contact_friction.presliding_stiffness  # type: ignore[union-attr]  # it has
    d = (body.without_friction().force(path) - body.trace(path)) / kappa
    energy = 0.5 * kappa * np.square(d).sum(axis=1)
    u = np.diff(path, axis=0)
    bound = kappa * (d[:-1] * u).sum(axis=1) + 0.5 * kappa * np.square(u).sum(axis=1)
    assert (np.diff(energy) <= bound + 1e-16).all()
    assert energy.max() > 1e-7
    assert (np.abs(d).max(axis=0) > 1e-5).all()


def test_no_closed_path_gains(body: Surface) -> None:
    works = friction_stress.walk(body, 300)
    assert (works.above, works.gains) == (0, 0)


def test_rules_count_it_and_the_papers_criterion_has_no_limit(body: Surface) -> None:
    device = parse_device(
        {"damping": "2 N*s/m", "update_rate": "4 kHz", "delay_samples": 2}, "mine"
    )
    numbers = characteristic_number(body), one_sided_number(body)
    evaluated = passivity(body, device, *numbers, worst_loop(body)).evaluated
    gain = numbers[1].upper / 2 + 2 * numbers[0].upper + 3.5 / 4
    assert evaluated[criteria.DELAY].limit == pytest.approx(8000.0 / gain, rel=1e-9)
    assert evaluated[criteria.PAPER].limit is None
    scan = friction_scan(body)
    assert scan is not None
    assert 0.05 < scan.mean < MU * 0.3  # the line leaves the cube


def test_limit_follows_the_angle_to_the_force() -> None:
    free = drag_anchor_in_space(1.0, 2.0, 3.0, False, 9.0, 9.0, 9.0, 0.0, 0.0, 1.0, 5.0)
    assert free == (1.0, 2.0, 3.0, 0.0, 0.0, 0.0)
    across = drag_anchor_in_space(3.0, 4.0, 0.0, True, 0.0, 0.0, 0.0, 0.0, 0.0, 7.0, 2.5)
    assert across == pytest.approx((1.5, 2.0, 0.0, 1.5, 2.0, 0.0), rel=1e-15)
    along = drag_anchor_in_space(0.0, 0.0, 4.0, True, 0.0, 0.0, 0.0, 0.0, 0.0, 7.0, 2.5)
    assert along == (0.0, 0.0, 4.0, 0.0, 0.0, 0.0)
    oblique = drag_anchor_in_space(3.0, 0.0, 4.0, True, 0.0, 0.0, 0.0, 0.0, 0.0, 7.0, 2.5)
    assert np.linalg.norm(oblique[3:]) == pytest.approx(2.5 * 3.0 / 5.0, rel=1e-15)
    stuck = drag_anchor_in_space(3.0, 0.0, 4.0, True, 0.0, 0.0, 0.0, 0.0, 0.0, 7.0, 8.5)
    assert stuck == (0.0, 0.0, 0.0, 3.0, 0.0, 4.0)
    nothing = drag_anchor_in_space(3.0, 0.0, 4.0, True, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0)
    assert nothing == (3.0, 0.0, 4.0, 0.0, 0.0, 0.0)


def test_run_counts_its_energy_and_replays(body: Surface, tmp_path: Path) -> None:
    start, end = ((HALF - DEPTH, 0.0, z) for z in (-1e-3, -3e-3))
    strokes = Strokes(start, end, speed=0.02, count=4)
    options = (Cartesian(0.1), PrescribedHand(), Servo(2e-4), strokes, strokes.duration)
    run = simulate(body, *options, trace=tmp_path / "run.mcap")
    force, reach = MU * 1000.0 * DEPTH, MU * 1000.0 * DEPTH / 250.0
    assert run.slipped == pytest.approx(force * (4 * 2e-3 - 7 * reach), rel=1e-2)
    assert run.deflected == pytest.approx(0.5 * 250.0 * reach**2, rel=1e-2)
    assert run.ledger.total == pytest.approx(-run.slipped - run.deflected, rel=2e-2)
    recording = open_recording(tmp_path / "run.mcap")
    assert np.ptp(recording["law anchor z"]) > 1e-3
    assert asp.replay(recording).is_identical


def test_exported_tick_equals_the_kernel(body: Surface, tmp_path: Path) -> None:
    surface = as_exported(body)
    program = library(tmp_path, "gcc", {"b": header(surface, "b", max_evaluations=np.inf)}, "-O1")
    down, over = ([HALF - DEPTH, 0.0, -3e-3], [HALF - DEPTH, 1e-3, -1e-4]), [0.0, 0.0, -1e-4]
    path = np.ascontiguousarray(np.vstack([line(*down), line(down[1], over)]))
    result = ticks(program, "b", path)
    assert same_bits(result, kernel_ticks(surface, path, np.inf)).all()
    plain = kernel_ticks(surface.without_friction(), path, np.inf)
    assert np.abs(result - plain)[:, 2].max() > 0.04
