"""Section III: the corollary, the characteristic number and what it is for, the three cases."""

from __future__ import annotations

import math

import numpy as np

from asperity.analysis.energy.loops import loop_work
from asperity.analysis.gain.characteristic import characteristic_number
from asperity.checks import FloatArray
from asperity.laws import Law, find_law
from asperity.paper.claim import Check, decide, judge, judges, settle
from asperity.paper.comparisons import q_of
from asperity.paper.plane import (
    LAWS,
    PASSIVITY,
    SAMPLING_PERIOD,
    SCANNING,
    Setting,
    groove_path,
    path_points,
    random_settings,
    spots,
)
from asperity.surface import Surface

_SLOW = 0.05  # [m/s], an unhurried stroke
_CORRECTION = (
    "sufficient if the field is conservative and continuous, with at most one sample of delay"
)


def gained(surface: Surface, path: FloatArray, loss: float, delay: int = 0) -> float:
    """Return what a hand gains along sampled positions [J].

    Σ f_{i-d} · Δ_i - loss |Δ_i|², the force held from sample to sample, loss = σ₀/T; the hand
    rests before it begins.
    """
    force = surface.force(path)
    held = np.concatenate([np.repeat(force[:1], delay, axis=0), force])[: len(path) - 1]
    step = np.diff(path, axis=0)
    return float(np.sum(held * step) - loss * np.sum(step**2))


def sampled_loop(vertices: FloatArray, step: float) -> FloatArray:
    """Return points along a closed polygon, at most a step apart."""
    parts = []
    for start, end in zip(vertices, np.roll(vertices, -1, axis=0), strict=True):
        count = max(1, math.ceil(float(np.linalg.norm(end - start)) / step))
        parts.append(start + np.linspace(0.0, 1.0, count, endpoint=False)[:, None] * (end - start))
    return np.concatenate([*parts, vertices[:1]])


def _alive(law: str) -> tuple[float, float, FloatArray, Surface]:
    """Return the net gain of a slow loop where (1) holds with equality, and what made it."""
    surface = SCANNING.surface(law)
    q = characteristic_number(surface).value
    damping = 2.0 * SAMPLING_PERIOD * surface.stiffness * q
    path = sampled_loop(np.array(groove_path(SCANNING)), _SLOW * SAMPLING_PERIOD)
    return gained(surface, path, damping / SAMPLING_PERIOD), damping, path, surface


def _quiet(delay: int, seed: int, part: float = 1.0) -> float:
    """Return the greatest gain of random motions on C where (1) holds with equality.

    Beyond what was stored at the beginning, relative to k times the square of the depth. Also
    shakes where q is attained. ``part`` is of the damping that (1) asks for.
    """
    draw, worst = np.random.default_rng(seed), -math.inf
    for case in [SCANNING, *random_settings(2, seed)]:
        low, high = case.texture.extremes
        floor = low - case.depth
        surface = case.surface("C", max_depth=high - floor)
        loss = part * 2.0 * case.stiffness * characteristic_number(surface).value
        paths = [shake(surface, 1e-4 * case.depth, angle) for angle in (math.pi, 2.0, 0.5, 0.1)]
        for size in 10.0 ** draw.uniform(-6.0, -0.5, 40):
            way = np.cumsum(draw.normal(size=(60, 2)) * size, axis=0)
            way = np.where(draw.random() < 0.5, way, way - np.roll(way, 1, axis=0))
            x = draw.uniform(0.0, case.period) + way[:, 0] * case.period
            z = floor + np.abs(draw.uniform(0.0, high - floor) + way[:, 1] * case.depth)
            paths.append(np.column_stack([x, 0 * x, z]))
        for path in paths:
            store = 0.5 * case.stiffness * _depth(surface, path[[0, -1]]) ** 2
            net = gained(surface, path, loss, delay) - float(store[0] - store[1])
            worst = max(worst, net / (case.stiffness * case.depth**2))
    return worst


def shake(surface: Surface, size: float, angle: float = math.pi) -> FloatArray:
    """Return a to and fro along the stiffest direction where q is attained, just inside."""
    at = characteristic_number(surface).at
    if at is None:
        raise ValueError(f"no place attains q of {surface!r}")
    middle = np.array(at) - [0.0, 0.0, 2.0 * size]
    matrix = -surface.jacobian(middle[None])[0]
    along = np.linalg.eigh(0.5 * (matrix + matrix.T))[1][:, -1]
    return np.asarray(middle + size * np.cos(angle * np.arange(241))[:, None] * along)


def _depth(surface: Surface, points: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(surface.texture.height(points[:, :2]) - points[:, 2], 0.0))


def _two_late() -> float:
    """Return the gain per step of a slow shake into a plain wall with two samples of delay."""
    wall = SCANNING.surface("W")
    swing = 1e-4 * np.sin(np.arange(20 * 60) * 2.0 * math.pi / 60)
    path = np.column_stack([0 * swing, 0 * swing, swing - 5e-4])
    return gained(wall, path, 2.0 * wall.stiffness, delay=2)


@judges("eq-1", "III.A", "(1)")
def corollary() -> Check:
    """‖J‖ <= σ₀(B)/(2T) everywhere is sufficient for passivity (Corollary 1)."""
    net, damping, _path, _surface = _alive("A")
    quiet = [_quiet(delay, 31 + delay) for delay in (0, 1)]
    late = _two_late()
    return decide(
        f"A at equality in (1), σ₀ = {damping:.3f} N·s/m: a loop turned at {_SLOW:g} m/s gains "
        f"{net * 1e3:+.3f} mJ net; C at equality: of 252 motions with d = 0, 1 the best "
        f"gains {max(quiet):+.1e} κ₀D²; W with d = 2 gains {late * 1e6:+.2f} µJ",
        printed=net <= 0.0,
        corrected=max(quiet) <= 1e-12 and late > 0.0,
        correction=_CORRECTION,
        net_gain_of_A=net,
        greatest_gain_of_C=max(quiet),
        gain_of_W_two_samples_late=late,
    )


@judges("eq-2", "III.A", "(2)")
def condition() -> Check:
    """The force changing by at most σ₀/(2T) per length at every step is sufficient.

    It holds at every step of the loop that gains.
    """
    net, damping, path, surface = _alive("A")
    step = np.linalg.norm(np.diff(path, axis=0), axis=1)
    change = np.linalg.norm(np.diff(surface.force(path), axis=0), axis=1)
    most = float((change / step).max()) / (damping / (2.0 * SAMPLING_PERIOD))
    quiet = _quiet(0, 41)
    return decide(
        f"a loop of A gains {net * 1e3:+.3f} mJ net though |Δf| <= {most:.4f} σ₀/(2T) |Δs| at "
        f"all of its steps; the best of 132 motions on C gains {quiet:+.1e} κ₀D²",
        printed=net <= 0.0 or most > 1.0 + 1e-9,
        corrected=quiet <= 1e-12,
        correction=_CORRECTION,
        greatest_left_side=most,
        net_gain_of_A=net,
    )


def _jacobians() -> list[FloatArray]:
    return [spot.jacobian() / spot.k for law in "ABCDEG" for spot in spots(law, 3)]


@judges("eq-3", "III.A", "(3)")
def product_bound() -> Check:
    """‖J Δ‖ <= ‖J‖₂ |Δ|."""
    draw, most = np.random.default_rng(2), 0.0
    for matrix in _jacobians():
        steps = draw.normal(size=(200, 2))
        ratio = np.linalg.norm(steps @ matrix.T, axis=1) / np.linalg.norm(steps, axis=1)
        most = max(most, float(ratio.max() / np.linalg.norm(matrix, 2)))
    return decide(
        f"‖JΔ‖ is at most {most:.6f} ‖J‖₂|Δ| for 18 Jacobians and 3600 steps",
        printed=most <= 1.0 + 1e-12,
        greatest_share=most,
    )


@judges("eq-4", "III.A", "(4)")
def step_bound() -> Check:
    """With (1), ‖J Δ‖ <= σ₀/(2T) |Δ|.

    (1) and (3) together.
    """
    draw, most = np.random.default_rng(3), 0.0
    for matrix in _jacobians():
        allowed = draw.uniform(1.0, 3.0) * np.linalg.norm(matrix, 2)  # σ₀/(2T) as (1) asks
        steps = draw.normal(size=(200, 2))
        ratio = np.linalg.norm(steps @ matrix.T, axis=1) / np.linalg.norm(steps, axis=1)
        most = max(most, float(ratio.max() / allowed))
    return decide(
        f"where (1) holds ‖JΔ‖ is at most {most:.4f} σ₀/(2T) |Δ| for 3600 steps",
        printed=most <= 1.0 + 1e-12,
        greatest_share=most,
    )


# --- the characteristic number --------------------------------------------------------------------


@judges("eq-5", "III.B", "(5)")
def definition() -> Check:
    """q = σ_n(J)/κ₀ belongs to the algorithm, whatever κ₀ is.

    A number of the algorithm only if J is proportional to κ₀.
    """  # noqa: D403 - a symbol
    worst = 0.0
    for law in LAWS:
        for spot in spots(law, 2):
            points = np.array([[spot.x, 0.0, spot.z]])
            one, other = (
                Surface(SCANNING.texture, law, stiffness=k).jacobian(points - [0, 0, 2e-3])[0] / k
                for k in (211.0, 1733.0)
            )
            worst = max(worst, float(np.abs(one - other).max() / np.abs(one).max()))
    return decide(
        f"J/κ₀ of A to G at two stiffnesses differs by {worst:.1e}",
        printed=worst < 1e-12,
        greatest_difference=worst,
    )


@judges("sentence-III.B-reduced", "III.B")
def reduced() -> Check:
    """κ₁ = κ₀/q gives the textured wall the norm of the smooth one, for any algorithm."""
    numbers = {law: q_of(PASSIVITY, law) for law in LAWS}
    finite = [law for law, q in numbers.items() if math.isfinite(q)]
    worst = 0.0
    for law in finite:
        k = PASSIVITY.stiffness / numbers[law]
        again = k * q_of(Setting(k, PASSIVITY.period, PASSIVITY.amplitude), law)
        worst = max(worst, abs(again / PASSIVITY.stiffness - 1.0))
    without = "".join(law for law in LAWS if law not in finite)
    return decide(
        f"in V.A's setting κ₀/q has the norm κ₀ within {worst:.1e} for {''.join(finite)}; "
        f"q is infinite for {without or 'none'}",
        printed=worst < 1e-5 and not without,
        corrected=worst < 1e-5 and without == "D",
        correction="for D only as long as the depth stays above its medial axis",
        numbers={f"q_{law}": q for law, q in numbers.items()},
    )


@judges("sentence-III.B-doubling", "III.B")
def doubling() -> Check:
    """Doubling the spatial frequency requires half the stiffness."""
    ratios: dict[str, list[float]] = {}
    for law in LAWS:
        values = [q_of(Setting(1000.0, length, 0.4e-3), law) for length in (1e-3, 0.5e-3)]
        steep = [q_of(Setting(1000.0, length, 0.4e-3), law) for length in (2e-5, 1e-5)]
        ratios[law] = [values[1] / values[0], steep[1] / steep[0]]
    # From infinity to infinity the ratio is no number.
    printed = all(abs(ratio[0] - 2.0) < 0.02 for ratio in ratios.values())
    halves = "".join(law for law, ratio in ratios.items() if abs(ratio[1] - 2.0) < 0.02)
    said = ", ".join(
        f"{law} {ratio[0]:.2f}" for law, ratio in ratios.items() if math.isfinite(ratio[0])
    )
    return decide(
        f"l from 1 to 0.5 mm multiplies q by: {said} (D is infinite both times); "
        f"from 20 to 10 µm by 2 for {halves}",
        printed=printed,
        corrected=halves == "AF",
        correction="for A and F, where the texture is steep; q of B, C and G then grows four "
        "times, E's not at all, and D's is infinite",
        numbers={
            f"ratios for {law}": [r for r in ratio if math.isfinite(r)]
            for law, ratio in ratios.items()
        },
    )


@judges("sentence-III.B-compare", "III.B")
def no_comparison() -> Check:
    """q does not rank algorithms: its order depends on the parameters."""  # noqa: D403 - a symbol
    orders = set()
    for amplitude, depth in ((0.8e-3, 1e-3), (0.05e-3, 1e-3), (0.05e-3, 0.1e-3)):
        case = Setting(1000.0, 2e-3, amplitude, depth=depth)
        numbers = {law: round(q_of(case, law), 6) for law in "ABCEG"}
        orders.add("".join(sorted(numbers, key=lambda law: (numbers[law], law))))
    return decide(
        f"three settings rank A, B, C, E, G by q as {', '.join(sorted(orders))}",
        printed=len(orders) > 1,
        orders=", ".join(sorted(orders)),
    )


# --- conservativity -------------------------------------------------------------------------------


@judges("sentence-III.C-curl", "III.C")
def zero_curl() -> Check:
    """A field with zero curl is conservative.

    A field that begins with a jump says when.
    """
    from asperity.derive.curl import curl_verdict

    stripe = Law("T", "constant-pull", "nominal", lambda c: c.k * 1e-3 * c.tangential([1, 0]))
    verdict = curl_verdict(stripe)
    free = all(entry == 0 for entry in verdict.curl)
    surface = Surface(SCANNING.texture, stripe)
    path = path_points((0.0, 1e-4), (0.0, -1e-4), (1e-3, -1e-4), (1e-3, 1e-4))
    work = loop_work(surface, path)
    smooth = [law for law in "WCD" if curl_verdict(find_law(law)).conservative]
    loops = [abs(loop_work(SCANNING.surface(law), groove_path(SCANNING), 1e-10)) for law in smooth]
    return decide(
        f"a constant tangential force inside the body has curl {'0' if free else 'not 0'} and "
        f"gains {work * 1e6:.2f} µJ per loop; W, C, D with curl 0 at most {max(loops):.1e} J",
        printed=not free or work == 0.0,
        corrected=len(smooth) == 3 and max(loops) < 1e-12,
        correction="if the force also has no tangential jump where contact begins",
        work_with_zero_curl=work,
        work_of_W_C_D=max(loops),
    )


@judges("sentence-III.C-case-1", "III.C")
def case_1() -> Check:
    """Where (1) does not hold unwanted energy may be injected."""
    surface = SCANNING.surface("C")
    path = shake(surface, 1e-8)
    scale = surface.stiffness * q_of(SCANNING, "C")
    nets = {part: gained(surface, path, scale / part) for part in (1.9, 2.1)}
    return decide(
        "C shaken where q is attained: with σ₀ at 1/3.8 of what (1) asks for it gains "
        f"{nets[1.9]:+.1e} J, at 1/4.2 {nets[2.1]:+.1e} J",
        printed=nets[2.1] > 0.0,
        gain_above_a_quarter=nets[1.9],
        gain_below_a_quarter=nets[2.1],
    )


@judges("sentence-III.C-case-2", "III.C")
def case_2() -> Check:
    """Where (1) holds and the law is generative, some motions may still gain."""
    nets = {law: _alive(law)[0] for law in "ABE"}
    said = ", ".join(f"{law} {net * 1e3:+.3f} mJ" for law, net in nets.items())
    return decide(
        f"at equality in (1) a loop at {_SLOW:g} m/s gains net: {said}",
        printed=max(nets.values()) > 0.0,
        numbers={f"net gain of {law}": net for law, net in nets.items()},
    )


@judges("sentence-III.C-case-3", "III.C")
def case_3() -> Check:
    """Where (1) holds and the field is conservative, every motion loses."""
    quiet, late = max(_quiet(delay, 51 + delay) for delay in (0, 1)), _two_late()
    return decide(
        f"the best of 252 motions on C with d = 0, 1 gains {quiet:+.1e} κ₀D²",
        printed=quiet <= 1e-12,
        greatest_gain=quiet,
        gain_of_W_two_samples_late=late,
    )


@judges("sentence-abstract-texture", "Abstract")
def smooth_then_textured() -> Check:
    """A smooth surface that is rendered passively may lose this once textured."""
    wall, textured = SCANNING.surface("W"), SCANNING.surface("C")
    loss = wall.stiffness  # twice what the plain wall needs, σ₀/T = k/2
    on_wall = gained(wall, shake(wall, 1e-8), loss)
    on_texture = gained(textured, shake(textured, 1e-8), loss)
    return settle(
        judge("the wall's q", printed=1.0, truth=q_of(SCANNING, "W")),
        decide(
            f"shaken by 10 nm with σ₀ = κ₀T the wall gains {on_wall:+.1e} J, C {on_texture:+.1e} J",
            printed=on_wall < 0.0 < on_texture,
            gain_on_the_wall=on_wall,
            gain_on_the_texture=on_texture,
        ),
    )
