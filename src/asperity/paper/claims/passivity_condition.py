"""Section III: the corollary, the characteristic number and its use, and the three cases."""

from __future__ import annotations

import math

import numpy as np

from asperity.analysis.energy.field_energy import loop_work
from asperity.analysis.gain.characteristic import characteristic_number
from asperity.core.checks import FloatArray
from asperity.laws import Law, find_law
from asperity.paper.cases import (
    PAPER_LAWS,
    SAMPLING_PERIOD,
    SCANNING,
    ExperimentCase,
    path_points,
    random_settings,
)
from asperity.paper.claim import Check, check_statement, check_values, combine_checks
from asperity.paper.formula_checks import find_max_norm, format_by_name
from asperity.paper.probes import generic_probes
from asperity.surface import Surface

_SLOW_SPEED = 0.05  # [m/s], a slow stroke


def energy_gained(surface: Surface, path: FloatArray, loss: float, delay: int = 0) -> float:
    """Return the energy that a hand gains along sampled positions [J].

    Σ f_{i-d} · Δ_i - loss |Δ_i|², with the force held from sample to sample and loss = σ₀/T; the
    hand is at rest initially. With d = -1 it is the paper's own sum of each force times the step
    before it.
    """
    force = surface.force(path)
    step = np.diff(path, axis=0)
    held = np.concatenate([np.repeat(force[:1], max(delay, 0), axis=0), force[max(-delay, 0) :]])
    held = held[: len(step)]
    return float(np.sum(held * step) - loss * np.sum(step**2))


def sample_loop(vertices: FloatArray, step: float) -> FloatArray:
    """Return points along a closed polygon, at most a step apart."""
    parts = []
    for start, end in zip(vertices, np.roll(vertices, -1, axis=0), strict=True):
        count = max(1, math.ceil(float(np.linalg.norm(end - start)) / step))
        parts.append(start + np.linspace(0.0, 1.0, count, endpoint=False)[:, None] * (end - start))
    return np.concatenate([*parts, vertices[:1]])


def _slow_loop_gain(law: str) -> tuple[float, float, FloatArray, Surface]:
    """Return net gain, damping, path and surface of a slow loop with equality in (1)."""
    surface = SCANNING.surface(law)
    q = characteristic_number(surface).value
    damping = 2.0 * SAMPLING_PERIOD * surface.stiffness * q
    path = sample_loop(SCANNING.groove_path(), _SLOW_SPEED * SAMPLING_PERIOD)
    return energy_gained(surface, path, damping / SAMPLING_PERIOD), damping, path, surface


def _max_random_gain(delay: int, seed: int, damping_share: float = 1.0) -> float:
    """Return the greatest gain of motions on C with equality in (1).

    The gain is in excess of the energy stored initially, relative to k times the depth squared.
    Motions are random, and oscillations at the witness of q. ``damping_share`` scales the damping
    that (1) requires.
    """
    rng = np.random.default_rng(seed)
    gains = []
    for case in [SCANNING, *random_settings(2, seed)]:
        low, high = case.texture.extremes
        floor = low - case.depth
        surface = case.surface("C", max_depth=high - floor)
        loss = damping_share * 2.0 * case.stiffness * characteristic_number(surface).value
        paths = [
            oscillating_path(surface, 1e-4 * case.depth, angle)
            for angle in (math.pi, 2.0, 0.5, 0.1)
        ]
        for size in 10.0 ** rng.uniform(-6.0, -0.5, 40):
            walk = np.cumsum(rng.normal(size=(60, 2)) * size, axis=0)
            walk = np.where(rng.random() < 0.5, walk, walk - np.roll(walk, 1, axis=0))
            x = rng.uniform(0.0, case.period) + walk[:, 0] * case.period
            z = floor + np.abs(rng.uniform(0.0, high - floor) + walk[:, 1] * case.depth)
            paths.append(np.column_stack([x, 0 * x, z]))
        for path in paths:
            stored = 0.5 * case.stiffness * _depth(surface, path[[0, -1]]) ** 2
            net = energy_gained(surface, path, loss, delay) - float(stored[0] - stored[1])
            gains.append(net / (case.stiffness * case.depth**2))
    return max(gains)


def oscillating_path(surface: Surface, size: float, angle: float = math.pi) -> FloatArray:
    """Return an oscillation along the stiffest direction at the witness of q, just inside."""
    at = characteristic_number(surface).at
    if at is None:
        raise ValueError(f"q of {surface!r} has no witness")
    middle = np.array(at) - [0.0, 0.0, 2.0 * size]
    matrix = -surface.jacobian(middle[None])[0]
    along = np.linalg.eigh(0.5 * (matrix + matrix.T))[1][:, -1]
    return np.asarray(middle + size * np.cos(angle * np.arange(241))[:, None] * along)


def _depth(surface: Surface, points: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(surface.texture.height(points[:, :2]) - points[:, 2], 0.0))


def _delayed_wall_gain(delay: int = 2) -> float:
    """Return the gain of a slow oscillation in a plain wall with a delay in samples [J]."""
    wall = SCANNING.surface("W")
    motion = 1e-4 * np.sin(np.arange(20 * 60) * 2.0 * math.pi / 60)
    path = np.column_stack([0 * motion, 0 * motion, motion - 5e-4])
    return energy_gained(wall, path, 2.0 * wall.stiffness, delay)


def corollary() -> Check:
    """‖J‖ <= σ₀(B)/(2T) everywhere is sufficient for passivity (Corollary 1)."""
    net, damping, _path, _surface = _slow_loop_gain("A")
    gain = max([_max_random_gain(delay, 31 + delay) for delay in (0, 1)])
    late = _delayed_wall_gain()
    return check_statement(
        f"A at equality in (1), σ₀ = {damping:.3f} N·s/m",
        printed=net <= 0.0,
        corrected=gain <= 1e-12 and late > 0.0,
        net_gain_of_A=net,
        greatest_gain_of_C=gain,
        gain_of_W_two_samples_late=late,
    )


def increment_condition() -> Check:
    """The force changing by at most σ₀/(2T) per length at every step is sufficient.

    The condition holds at every step of a loop that gains energy.
    """
    net, damping, path, surface = _slow_loop_gain("A")
    step = np.linalg.norm(np.diff(path, axis=0), axis=1)
    change = np.linalg.norm(np.diff(surface.force(path), axis=0), axis=1)
    share = float((change / step).max()) / (damping / (2.0 * SAMPLING_PERIOD))
    gain = _max_random_gain(0, 41)
    return check_statement(
        f"the best of 132 motions on C gains {gain:+.1e} κ₀D²",
        printed=net <= 0.0 or share > 1.0 + 1e-9,
        corrected=gain <= 1e-12,
        greatest_left_side=share,
        net_gain_of_A=net,
    )


def product_bound() -> Check:
    """To first order the force changes by J Δ, and ‖J Δ‖ <= ‖J‖₂ |Δ|.

    Checked with forces over small steps, half of them along the stiffest direction.
    """
    draw = np.random.default_rng(2)
    size = 1e-9
    worst = 0.0
    share = 0.0
    for law in "ABCDEG":
        for spot in generic_probes(law, 3):
            matrix = spot.compiled_jacobian()
            norm = np.linalg.norm(matrix, 2)
            steps = draw.normal(size=(200, 2))
            steps[:100] = np.linalg.svd(matrix)[2][0]
            steps *= size / np.linalg.norm(steps, axis=1)[:, None]
            in_space = steps[:, [0, 0, 1]] * [1, 0, 1]
            ends = np.array([[spot.x, 0.0, spot.z]]) + 0.5 * in_space
            change = spot.surface.force(ends) - spot.surface.force(ends - in_space)
            off = np.linalg.norm(change[:, ::2] - steps @ matrix.T, axis=1)
            worst = max(worst, float(off.max() / (size * norm)))
            share = max(share, float(np.linalg.norm(change, axis=1).max() / (size * norm)))
    return check_statement(
        printed=worst < 1e-5 and abs(share - 1.0) < 1e-5,
        greatest_difference=worst,
        greatest_share=share,
    )


# --- the characteristic number --------------------------------------------------------------------


def number_is_intrinsic() -> Check:
    """q = σ_n(J)/κ₀ belongs to the algorithm, whatever κ₀ is.

    Two stiffnesses are compared: a search over Jacobians of the kernel, and where q is attained.
    """  # noqa: D403 - a symbol
    worst = 0.0
    for law in "ABCEFG":
        soft = SCANNING.surface(law, stiffness=211.0)
        stiff = SCANNING.surface(law, stiffness=1733.0)
        for number in (find_max_norm, _number_at_witness):
            worst = max(worst, abs(number(stiff) / number(soft) - 1.0))
    return check_statement(printed=worst < 1e-5, greatest_difference=worst)


def _number_at_witness(surface: Surface) -> float:
    """Return ‖J‖/κ₀ of the kernel at the witness of q, just inside."""
    q = characteristic_number(surface)
    point = np.array([q.at]) - [0.0, 0.0, 1e-12]
    state = () if q.deflection is None else ([q.deflection], np.array([q.sliding]))
    return float(np.linalg.norm(surface.jacobian(point, *state)[0], 2)) / surface.stiffness


def doubling_halves_stiffness() -> Check:
    """Doubling the spatial frequency requires half the stiffness."""
    ratios: dict[str, list[float]] = {}
    for law in PAPER_LAWS:
        q = [ExperimentCase(1000.0, period, 0.4e-3).q(law) for period in (1e-3, 5e-4, 2e-5, 1e-5)]
        ratios[law] = [q[1] / q[0], q[3] / q[2]]
    finite = {law: ratio for law, ratio in ratios.items() if math.isfinite(ratio[0])}
    halving = "".join([law for law, ratio in ratios.items() if abs(ratio[1] - 2.0) < 0.02])
    summary = format_by_name({law: ratio[0] for law, ratio in finite.items()})
    return check_statement(
        f"l from 1 to 0.5 mm multiplies q by: {summary} (D is infinite both times); "
        f"from 20 to 10 µm by 2 for {halving}",
        # From infinity to infinity the ratio is NaN.
        printed=all(abs(ratio[0] - 2.0) < 0.02 for ratio in ratios.values()),
        corrected=halving == "AF",
        numbers={
            f"ratios for {law}": [r for r in ratio if math.isfinite(r)]
            for law, ratio in ratios.items()
        },
    )


def number_does_not_rank() -> Check:
    """q does not rank algorithms: its order depends on the parameters."""  # noqa: D403 - a symbol
    orders = set()
    for amplitude, depth in ((0.8e-3, 1e-3), (0.05e-3, 1e-3), (0.05e-3, 0.1e-3)):
        case = ExperimentCase(1000.0, 2e-3, amplitude, depth=depth)
        numbers = {law: round(case.q(law), 6) for law in "ABCEG"}
        orders.add("".join(sorted(numbers, key=lambda law: (numbers[law], law))))
    return check_statement(printed=len(orders) > 1, orders=", ".join(sorted(orders)))


# --- conservativity -------------------------------------------------------------------------------


def zero_curl_is_conservative() -> Check:
    """A field with zero curl is conservative.

    Not if the force jumps where contact begins.
    """
    from asperity.derive.derivatives import curl_verdict

    stripe = Law("T", "constant-pull", "nominal", lambda c: c.k * 1e-3 * c.tangential([1, 0]))
    verdict = curl_verdict(stripe)
    free = all(entry == 0 for entry in verdict.curl)
    surface = Surface(SCANNING.texture, stripe)
    path = path_points((0.0, 1e-4), (0.0, -1e-4), (1e-3, -1e-4), (1e-3, 1e-4))
    work = loop_work(surface, path)
    smooth = [law for law in "WCD" if curl_verdict(find_law(law)).conservative]
    loops = [abs(loop_work(SCANNING.surface(law), SCANNING.groove_path(), 1e-10)) for law in smooth]
    return check_statement(
        f"a constant tangential force inside the body has curl {'0' if free else 'not 0'}",
        printed=not free or work == 0.0,
        corrected=len(smooth) == 3 and max(loops) < 1e-12,
        work_with_zero_curl=work,
        work_of_W_C_D=max(loops),
    )


def condition_violated() -> Check:
    """Where (1) does not hold unwanted energy may be injected."""
    surface = SCANNING.surface("C")
    path = oscillating_path(surface, 1e-8)
    scale = surface.stiffness * SCANNING.q("C")
    nets = {part: energy_gained(surface, path, scale / part) for part in (1.9, 2.1)}
    return check_statement(
        printed=nets[2.1] > 0.0, gain_above_a_quarter=nets[1.9], gain_below_a_quarter=nets[2.1]
    )


def condition_with_generative_law() -> Check:
    """Where (1) holds and the law is generative, some motions may still gain."""
    nets = {f"net gain of {law}": _slow_loop_gain(law)[0] for law in "ABE"}
    return check_statement(printed=max(nets.values()) > 0.0, numbers=nets)


def condition_with_conservative_law() -> Check:
    """Where (1) holds and the field is conservative, every motion loses.

    Computed by the work of the held force, and by the paper's own sum of section V.B.
    """
    gain = max([_max_random_gain(delay, 51 + delay) for delay in (0, 1)])
    late = _delayed_wall_gain()
    wall = _delayed_wall_gain(delay=-1)
    return check_statement(
        printed=gain <= 1e-12 and late <= 0.0,
        corrected=gain <= 1e-12,
        greatest_gain=gain,
        gain_of_W_two_samples_late=late,
        gain_of_W_by_the_papers_sum=wall,
    )


def smooth_then_textured() -> Check:
    """A smooth surface that is rendered passively may lose this once textured."""
    wall = SCANNING.surface("W")
    textured = SCANNING.surface("C")
    loss = wall.stiffness  # twice the σ₀/T = k/2 that the plain wall requires
    on_wall = energy_gained(wall, oscillating_path(wall, 1e-8), loss)
    on_texture = energy_gained(textured, oscillating_path(textured, 1e-8), loss)
    return combine_checks(
        check_values("the wall's q", printed=1.0, reference=SCANNING.q("W")),
        check_statement(
            printed=on_wall < 0.0 < on_texture,
            gain_on_the_wall=on_wall,
            gain_on_the_texture=on_texture,
        ),
    )
