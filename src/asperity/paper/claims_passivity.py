"""Section III: the corollary, the characteristic number and what it is for, the three cases."""

from __future__ import annotations

import math

import numpy as np

from asperity.analysis.energy.loops import loop_work
from asperity.analysis.gain.characteristic import characteristic_number
from asperity.checks import FloatArray
from asperity.laws import Law, find_law
from asperity.paper.changes import JACOBIANS, forces, instead, laws, numbers, other, works
from asperity.paper.claim import Check, decide, judge, judges, settle
from asperity.paper.comparisons import SLOPES, greatest_norm, q_of, steepest_pairs
from asperity.paper.plane import (
    LAWS,
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
    rests before it begins. With d = -1 the paper's own sum, each force times the step before it.
    """
    force, step = surface.force(path), np.diff(path, axis=0)
    held = np.concatenate([np.repeat(force[:1], max(delay, 0), axis=0), force[max(-delay, 0) :]])
    held = held[: len(step)]
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


ALIKE = other("A's q for every law", "q_of", lambda was: lambda case, _law: was(case, "A"))


def _depth(surface: Surface, points: FloatArray) -> FloatArray:
    return np.asarray(np.maximum(surface.texture.height(points[:, :2]) - points[:, 2], 0.0))


_LATE = 2  # samples


def _two_late(delay: int | None = None) -> float:
    """Return the gain of a slow shake into a plain wall with two samples of delay [J]."""
    wall = SCANNING.surface("W")
    swing = 1e-4 * np.sin(np.arange(20 * 60) * 2.0 * math.pi / 60)
    path = np.column_stack([0 * swing, 0 * swing, swing - 5e-4])
    return gained(wall, path, 2.0 * wall.stiffness, _LATE if delay is None else delay)


@judges("eq-1", "III.A", "(1)", flipped_by=laws(A="C"))
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


@judges("eq-2", "III.A", "(2)", flipped_by=laws(A="C"))
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


@judges("eq-3", "III.A", "(3)", flipped_by=JACOBIANS)
def product_bound() -> Check:
    """To first order the force changes by J Δ, and ‖J Δ‖ <= ‖J‖₂ |Δ|.

    What the force really does over small steps, half of them along the stiffest direction.
    """
    draw, size, worst, most = np.random.default_rng(2), 1e-9, 0.0, 0.0
    for law in "ABCDEG":
        for spot in spots(law, 3):
            matrix = spot.compiled_jacobian()
            norm = np.linalg.norm(matrix, 2)
            steps = draw.normal(size=(200, 2))
            steps[:100] = np.linalg.svd(matrix)[2][0]
            steps *= size / np.linalg.norm(steps, axis=1)[:, None]
            ends = np.array([[spot.x, 0.0, spot.z]]) + 0.5 * steps[:, [0, 0, 1]] * [1, 0, 1]
            change = spot.surface.force(ends) - spot.surface.force(
                ends - steps[:, [0, 0, 1]] * [1, 0, 1]
            )
            off = np.linalg.norm(change[:, ::2] - steps @ matrix.T, axis=1)
            worst = max(worst, float(off.max() / (size * norm)))
            most = max(most, float(np.linalg.norm(change, axis=1).max() / (size * norm)))
    return decide(
        f"over 3600 steps of 1 nm of A to E and G the force changes by JΔ within {worst:.1e} and "
        f"by at most {most:.6f} ‖J‖₂|Δ|",
        printed=worst < 1e-5 and abs(most - 1.0) < 1e-5,
        greatest_difference=worst,
        greatest_share=most,
    )


@judges("eq-4", "III.A", "(4)", flipped_by=numbers(0.999))
def step_bound() -> Check:
    """With (1), the force changes by at most σ₀/(2T) |Δ|.

    σ₀ as small as (1) allows it by q; pairs of probes apart, and close by where q is attained.
    """
    shares = steepest_pairs(3)
    best, worst = min(shares.values()), max(shares.values())
    return decide(
        "at equality in (1) the force of A, B, C, E, G changes over 4250 pairs of probes by at "
        f"most {best:.6f} to {worst:.6f} σ₀/(2T) |Δ|",
        printed=worst <= 1.0 + 1e-6 and best > 0.97,
        numbers={f"greatest share for {law}": share for law, share in shares.items()},
    )


# --- the characteristic number --------------------------------------------------------------------


@judges("eq-5", "III.B", "(5)", flipped_by=numbers(0.999))
def definition() -> Check:
    """q = σ_n(J)/κ₀ belongs to the algorithm, whatever κ₀ is.

    The number, known without a stiffness, against a search over Jacobians of the kernel at two.
    """  # noqa: D403 - a symbol
    worst = 0.0
    for law in "ABCEFG":
        q = q_of(SCANNING, law)
        for k in (211.0, 1733.0):
            surface = SCANNING.surface(law, stiffness=k)
            for found in (greatest_norm(surface), _norm_where_attained(surface) / k):
                worst = max(worst, abs(found / q - 1.0))
    return decide(
        "σ_n(J)/κ₀ of A, B, C, E, F, G at 211 and 1733 N/m, searched and where q is attained, "
        f"differs from q by {worst:.1e}",
        printed=worst < 1e-5,
        greatest_difference=worst,
    )


def _norm_where_attained(surface: Surface) -> float:
    """Return ‖J‖ of the kernel where q is attained, just inside [N/m]."""
    q = characteristic_number(surface)
    place = np.array([q.at]) - [0.0, 0.0, 1e-12]
    state = () if q.deflection is None else ([q.deflection], np.array([q.sliding]))
    return float(np.linalg.norm(surface.jacobian(place, *state)[0], 2))


@judges("sentence-III.B-doubling", "III.B", flipped_by=SLOPES)
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


@judges("sentence-III.B-compare", "III.B", flipped_by=ALIKE)
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


@judges("sentence-III.C-curl", "III.C", flipped_by=works(0.0))
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


@judges("sentence-III.C-case-1", "III.C", flipped_by=forces(0.9))
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


@judges("sentence-III.C-case-2", "III.C", flipped_by=laws(A="C", E="W"))
def case_2() -> Check:
    """Where (1) holds and the law is generative, some motions may still gain."""
    nets = {law: _alive(law)[0] for law in "ABE"}
    said = ", ".join(f"{law} {net * 1e3:+.3f} mJ" for law, net in nets.items())
    return decide(
        f"at equality in (1) a loop at {_SLOW:g} m/s gains net: {said}",
        printed=max(nets.values()) > 0.0,
        numbers={f"net gain of {law}": net for law, net in nets.items()},
    )


@judges(
    "sentence-III.C-case-3", "III.C", flipped_by=instead("one sample of delay for two", "_LATE", 1)
)
def case_3() -> Check:
    """Where (1) holds and the field is conservative, every motion loses.

    By the work of the held force, and beside it by the paper's own sum of section V.B.
    """
    quiet, late = max(_quiet(delay, 51 + delay) for delay in (0, 1)), _two_late()
    wall = _two_late(delay=-1)
    return decide(
        f"the best of 252 motions on C with d = 0, 1 gains {quiet:+.1e} κ₀D²; with d = 2 a slow "
        f"shake of W at equality in (1) gains {late * 1e6:+.2f} µJ, {wall * 1e6:+.2f} by the "
        "paper's own sum",
        printed=quiet <= 1e-12 and late <= 0.0,
        corrected=quiet <= 1e-12,
        correction="with at most one sample of delay",
        greatest_gain=quiet,
        gain_of_W_two_samples_late=late,
        gain_of_W_by_the_papers_sum=wall,
    )


@judges("sentence-abstract-texture", "Abstract", flipped_by=laws(C="W"))
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
