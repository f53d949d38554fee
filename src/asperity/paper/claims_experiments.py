"""Section V, but for the sentences that need a simulation."""

from __future__ import annotations

import math

import numpy as np

from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.energy.loops import loop_work
from asperity.checks import FloatArray
from asperity.devices import load_device
from asperity.devices.five_bar import FiveBar, handle_damping
from asperity.paper.changes import (
    FORCES,
    forces,
    instead,
    laws,
    numbers,
    observed,
    other,
    works,
)
from asperity.paper.claim import Check, decide, judge, judges, observation, settle
from asperity.paper.claims_appendix import true_number
from asperity.paper.claims_friction import PAPER, Rub, norm_of, stick_entries
from asperity.paper.claims_passivity import gained
from asperity.paper.comparisons import SLOPES, outside_check, q_of
from asperity.paper.plane import (
    BUMP,
    PASSIVITY,
    SAMPLING_PERIOD,
    SCANNING,
    Setting,
    friction_path,
    groove_path,
    random_settings,
)

_RESOLUTION = 15e-6  # [m]
_SPEED = 0.2  # [m/s], greatest
SETTINGS = {"V.A": PASSIVITY, "V.B": SCANNING, "V.C": BUMP}


# --- V --------------------------------------------------------------------------------------------


@judges("sentence-V-samples", "V", flipped_by=instead("a hand of 0.4 m/s", "_SPEED", 0.4))
def samples() -> Check:
    """With 1 mm, the highest period, there are 50 samples and more, and at most 200 Hz.

    1 mm is said to be the greatest period.
    """
    periods = [case.period for case in SETTINGS.values()]
    length = 1e-3
    alpha, beta = length / (_SPEED * SAMPLING_PERIOD), length / _RESOLUTION
    return settle(
        decide(
            f"at l = 1 mm and v = 0.2 m/s a period has {alpha:.1f} updates and {beta:.1f} steps of "
            f"position, and passes {_SPEED / length:.0f} times a second",
            printed=alpha >= 50.0 * (1 - 1e-12) and beta > 50.0 and _SPEED / length < 400.0,
            updates=alpha,
            steps=beta,
            frequency=_SPEED / length,
        ),
        decide(
            "periods of sections V.A to V.C: " + ", ".join(f"{p * 1e3:g} mm" for p in periods),
            printed=math.isclose(max(periods), length),
            corrected=math.isclose(min(periods), length),
            correction="1 mm is the smallest period (the highest spatial frequency), and the speed "
            "is in m/s",
            periods=periods,
        ),
    )


@judges("eq-30", "V.A", "(30)", flipped_by=FORCES)
def wall() -> Check:
    """Force of the smooth wall W."""
    surface, draw = PASSIVITY.surface("W"), np.random.default_rng(1)
    points = draw.uniform(-2e-3, 2e-3, (200, 3)) * [1, 0, 1]
    z = points[:, 2]
    printed = np.column_stack([0 * z, np.where(z < 0.0, -PASSIVITY.stiffness * z, 0.0)])
    return settle(
        judge("force of W at 200 probes", printed=printed, truth=surface.force(points)[:, [0, 2]]),
        outside_check("W"),
    )


ROOT_TWO = other(
    "√2 times the norm of (26)", "norm_of",
    lambda was: lambda a, b: math.sqrt(2.0) * was(a, b),
)  # fmt: skip
TRIPLE = other(
    "three times the damping", "_damping", lambda was: lambda joint, x: 3.0 * was(joint, x)
)


@judges("sentence-V.A-qF", "V.A", flipped_by=ROOT_TWO)
def number_f() -> Check:
    """q_F = 8.3 for the stated parameters."""
    own, true, package = norm_of(*stick_entries(PAPER)), true_number(PAPER), q_of(PASSIVITY, "F")
    return decide(
        f"(26) gives {own:.4f}, √2 times that is {math.sqrt(2.0) * own:.4f}; the greatest "
        f"‖J‖/κ₀ of the paper's law is {true:.4f}, of the package's {package:.4f}",
        printed=any(round(value, 1) == 8.3 for value in (own, true, package)),
        correction=f"{own:.2f} by (26): a factor √2/2 was dropped",
        norm_of_the_printed_matrix=own,
        root_two_times_that=math.sqrt(2.0) * own,
        number_of_the_papers_law=true,
        number_of_the_packages_law=package,
    )


@judges("sentence-V.A-qA", "V.A", flipped_by=numbers(1.02))
def number_a() -> Check:
    """q_A = 5.1 for the stated parameters."""
    q = q_of(PASSIVITY, "A")
    return decide(f"q_A = {q:.4f}", printed=round(q, 1) == 5.1, q=q)


def _damping(joint: float, x: float) -> float:
    """Return σ₀(B) at a place of the Pantograph, with links that are not verified [N·s/m]."""
    device = load_device("pantograph")
    lengths = [device.value(field) for field in ("proximal_link", "distal_link", "base_distance")]
    proximal, distal, base = (math.nan if length is None else length for length in lengths)
    matrix = handle_damping(FiveBar(proximal, distal, base), joint, (x, 0.1))
    return float(np.linalg.svd(matrix, compute_uv=False)[-1])


@judges("sentence-V.A-rule", "V.A", flipped_by=TRIPLE)
def rule() -> Check:
    """At 2000 N/m W is within (1), A and F are not, and are when divided by their numbers."""
    numbers = {"W": 1.0, "A": q_of(PASSIVITY, "A"), "F": norm_of(*stick_entries(PAPER))}
    loads = {law: PASSIVITY.stiffness * q for law, q in numbers.items()}
    loads["A/5.1"], loads["F/8.3"] = loads["A"] / 5.1, loads["F"] / 8.3
    least = {
        x: _damping(PASSIVITY.joint_damping, x) / (2 * SAMPLING_PERIOD) for x in (-0.0125, 0.0375)
    }
    wanted = {"W": True, "A": False, "F": False, "A/5.1": True, "F/8.3": True}
    right = all(
        (loads[name] <= limit) is wanted[name] for name in wanted for limit in least.values()
    )
    said = ", ".join(f"{name} {load:.0f}" for name, load in loads.items())
    return decide(
        f"κ₀ q [N/m]: {said}; σ₀/(2T) is {min(least.values()):.0f} to "
        f"{max(least.values()):.0f} (links not verified)",
        printed=right,
        numbers={f"load of {name}": load for name, load in loads.items()},
        limits=list(least.values()),
    )


@judges("sentence-V.A-ensured", "V.A", flipped_by=works(0.0))
def ensured() -> Check:
    """Dividing by the characteristic number ensures passivity for A and F.

    Divided by their numbers, A and F still gain on a slow loop.
    """
    damping = _damping(PASSIVITY.joint_damping, 0.0375)
    speeds = {}
    for law, number in (("A", 5.1), ("F", 8.3)):
        surface = PASSIVITY.surface(law, stiffness=PASSIVITY.stiffness / number)
        loop = np.array(groove_path(PASSIVITY) if law == "A" else friction_path(PASSIVITY, 1e-5))
        length = float(np.linalg.norm(loop - np.roll(loop, 1, axis=0), axis=1).sum())
        speeds[law] = loop_work(surface, loop) / (damping * length)
    said = ", ".join(f"{law} {speed * 1e3:.1f} mm/s" for law, speed in speeds.items())
    return decide(
        f"with κ₀/5.1 and κ₀/8.3 and σ₀ = {damping:.2f} N·s/m, turning the loops of Fig. 3 "
        f"feeds a hand slower than: {said}",
        printed=max(speeds.values()) <= 0.0,
        correction="it ends limit cycles at best; a loop that gains is only slowed down",
        numbers={f"speed for {law}": speed for law, speed in speeds.items()},
    )


def held_work(path: FloatArray, force: FloatArray) -> float:
    """Return the work of forces that are held, each from its point to the next [J]."""
    fine = np.linspace(0.0, 1.0, 8)[:, None]
    return sum(
        float(np.sum(np.diff(start + fine * move, axis=0) @ now))
        for start, move, now in zip(path[:-1], np.diff(path, axis=0), force, strict=True)
    )


EARLY = other(
    "each force held over the step before it", "held_work",
    lambda was: lambda path, _force: was(path, SCANNING.surface("W").force(path[1:])),
)  # fmt: skip


@judges("sentence-V.B-sum", "V.B", flipped_by=EARLY)
def energy_sums() -> Check:
    """Force times displacement of the same sample, summed, is the energy supplied.

    The paper's Σ f Δp against the work of a force that is held.
    """
    draw = np.random.default_rng(23)
    surface = SCANNING.surface("W")
    path = np.cumsum(draw.normal(size=(400, 3)), axis=0) * 1e-6 * [0, 0, 1] - [0, 0, 1e-3]
    force, step = surface.force(path), np.diff(path, axis=0)
    held = held_work(path, force[:-1])
    # What the field itself gives along the path is the change of its energy.
    store = 0.5 * surface.stiffness * path[[0, -1], 2] ** 2
    field = float(store[0] - store[1])
    return judge(
        "energy from sampling, beyond the change of the stored energy [J]",
        printed=float(np.sum(force[1:] * step)) - field,
        corrected=float(np.sum(force[:-1] * step)) - field,
        truth=held - field,
        correction="each force times the step that follows it; with the step before it the "
        "energy that sampling feeds in is counted with the wrong sign",
    )


@judges("sentence-V.B-margin", "V.B", flipped_by=numbers(10.0, shorter=1.5e-3))
def margins() -> Check:
    """The margin of passivity is larger than in section V.A."""
    ratios = {}
    for law in "WABCEG":
        loads = [case.stiffness * q_of(case, law) for case in (PASSIVITY, SCANNING)]
        ratios[law] = SCANNING.joint_damping / PASSIVITY.joint_damping * loads[0] / loads[1]
    bounds = [
        case.stiffness * norm_of(*stick_entries(Rub(0.8, 1e-3, 0.8, case.period, 1e-3)))
        for case in (PASSIVITY, SCANNING)
    ]
    ratios["F"] = SCANNING.joint_damping / PASSIVITY.joint_damping * bounds[0] / bounds[1]
    said = ", ".join(f"{law} {ratio:.2f}" for law, ratio in ratios.items())
    return decide(
        f"σ₀/(2T κ₀ q) of V.B over that of V.A: {said}",
        printed=min(ratios.values()) > 1.0,
        numbers={f"ratio for {law}": ratio for law, ratio in ratios.items()},
    )


@judges("sentence-V.B-lateral", "V.B", flipped_by=laws(A="B"))
def no_lateral_energy() -> Check:
    """A exchanges no energy along the surface."""
    surface, draw = SCANNING.surface("A"), np.random.default_rng(5)
    force = surface.force(draw.uniform(-2e-3, 2e-3, (1000, 3)) * [1, 0, 1])
    most, normal = float(np.abs(force[:, 0]).max()), float(np.abs(force[:, 2]).max())
    return decide(
        f"greatest |f_x| of A at 1000 probes {most:g} N, |f_z| {normal:.2f} N",
        printed=most == 0.0 < normal,
        lateral=most,
        normal=normal,
    )


@judges("sentence-V.C-alive", "V.C", flipped_by=observed("sentence-V.C-alive"))
def alive() -> Check:
    """Fields that are not conservative feel alive.

    The leak is computed, what is felt is not.
    """
    found = {law: worst_loop(BUMP.surface(law)).energy for law in "ABD"}  # pressed 1 mm deep [J]
    said = ", ".join(f"{law} {energy * 1e3:.3g} mJ" for law, energy in found.items())
    return observation(
        "sentence-V.C-alive",
        f"worst loops in V.C's setting: {said}; whether a hand notices is not computed",
        {f"worst loop of {law} [J]": energy for law, energy in found.items()},
    )


def growth(values: list[float], by: list[float]) -> float:
    """Return the exponent with which values grow."""
    return math.log(values[1] / values[0]) / math.log(by[1] / by[0])


@judges("sentence-V.C-scaling", "V.C", flipped_by=SLOPES)
def scaling() -> Check:
    """q_A is proportional to A/l, the energy gained on a horizontal path to A²."""
    exponents = {}
    amplitudes, periods = [BUMP.amplitude, 1.01 * BUMP.amplitude], [BUMP.period, 1.01 * BUMP.period]
    tall = [Setting(1000.0, BUMP.period, a) for a in amplitudes]
    long = [Setting(1000.0, length, BUMP.amplitude) for length in periods]
    exponents["q by A"] = growth([q_of(case, "A") for case in tall], amplitudes)
    exponents["q by l"] = growth([q_of(case, "A") for case in long], periods)
    for name, cases, by in (("energy by A", tall, amplitudes), ("energy by l", long, periods)):
        energies = [loop_work(case.surface("A"), groove_path(case)) for case in cases]
        exponents[name] = growth(energies, by)
    path = [[0.0, 0.0, 0.0], [0.37 * BUMP.period, 0.0, 0.0]]
    straight = loop_work(BUMP.surface("A"), path)
    said = ", ".join(f"{name} {value:+.3f}" for name, value in exponents.items())
    near = [abs(exponents["q by A"] - 1.0), abs(exponents["q by l"] + 1.0)]
    energy = [abs(exponents["energy by A"] - 2.0), abs(exponents["energy by l"])]
    return decide(
        f"exponents in V.C's setting: {said}; along a horizontal way there and back {straight:g} J",
        printed=max(near) < 1e-6 and max(energy) < 1e-6,
        corrected=max(near) < 0.05 and max(energy) < 1e-6 and straight == 0.0,
        correction="q_A only nearly; the energy around the path of Fig. 3 (a horizontal way "
        "alone gives none)",
        numbers=exponents,
    )


@judges("sentence-V.C-perpendicular", "V.C", flipped_by=forces(1.1))
def perpendicular() -> Check:
    """A is passive to a probe that moves at right angles to the surface.

    As passive as a smooth wall: with the least damping that a wall needs, σ₀ = κ₀T/2.
    """
    draw, most = np.random.default_rng(29), -math.inf
    for case in [PASSIVITY, *random_settings()]:
        surface = case.surface("A")
        for size in 10.0 ** draw.uniform(-3.0, 0.0, 20):
            x = draw.uniform(0.0, case.period)
            top = float(surface.texture.height([[x, 0.0]])[0])
            # To and fro where the probe is inside, as hard as it can be for a wall.
            depth = case.depth * (0.5 + 0.5 * size * (-1.0) ** np.arange(60))
            path = np.column_stack([np.full(60, x), np.zeros(60), top - depth])
            store = 0.5 * case.stiffness * depth[[0, -1]] ** 2
            net = gained(surface, path, 0.5 * case.stiffness) - float(store[0] - store[1])
            most = max(most, net / (case.stiffness * (size * case.depth) ** 2))
    return decide(
        f"with σ₀ = κ₀T/2 the best of 80 vertical shakes of A gains {most:+.1e} κ₀ times its swing "
        "squared",
        printed=most < 1e-9,
        greatest=most,
    )
