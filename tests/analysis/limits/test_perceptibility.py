"""Perceptibility of a texture: thresholds, what the device resolves, and remedies."""

from __future__ import annotations

import math
import re
from dataclasses import replace
from typing import Any

import numpy as np
import pytest

from asperity.analysis.energy.straight_scan import merit
from asperity.analysis.limits.perceptibility import Perceptibility, Remedy, assess_perceptibility
from asperity.analysis.results.check_limits import limits
from asperity.analysis.results.compare import compare
from asperity.core.checks import FloatArray
from asperity.core.errors import ParameterError
from asperity.devices import Device, device_names, load_device, parse_device
from asperity.devices.device import Datum
from asperity.perception.grip import Grip, load_grip
from asperity.report.sentences.limit_sentences import (
    form_removal_sentences,
    masking_text,
    remedies_text,
    texture_amount_text,
)
from asperity.simulation import Cartesian, PrescribedHand, Servo, Strokes, simulate
from asperity.simulation.trace import COLUMNS
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Sinusoid
from asperity.textures.catalogue import as_texture
from asperity.textures.kinds.prepare_synthetic import prepare_texture
from asperity.textures.texture import TexturePart

RMS = 1.0 / math.sqrt(2.0)
LONG, SHORT = 2e-3, 0.3e-3


def device(**fields: Any) -> Device:
    return parse_device({"max_stiffness": "1000 N/m", **fields}, "mine")


PEN = load_grip()
# The same with thresholds at every frequency, so that magnified waves do not become unknown.
WIDE = replace(
    PEN,
    frequency=(1e-3, *PEN.frequency),
    unnoticed=(PEN.unnoticed[0], *PEN.unnoticed),
    felt=(PEN.felt[0], *PEN.felt),
)


def assess_wave(
    amplitude: float,
    own_device: Device,
    period: float = LONG,
    stiffness: float = 1000.0,
    **options: Any,
) -> Perceptibility:
    """Return the perceptibility of law A on a sinusoid: its force is k times the amplitude."""
    wave = Sinusoid(amplitude, period)
    surface = Surface(wave, "A", stiffness, 1e-3)
    rms = stiffness * amplitude * RMS
    options = {"grip": WIDE, **options}
    return assess_perceptibility(surface, own_device, TexturePart(wave), rms=rms, **options)


def simulate_scan(
    surface: Surface,
    mass: FloatArray,
    damping: FloatArray,
    friction: FloatArray,
    stiffness: FloatArray,
    speed: FloatArray,
    grip: Grip,
) -> tuple[FloatArray, FloatArray]:
    """Return the amplitudes (√2 RMS) of motion and of force on the hand of scans, integrated.

    The hand moves at constant speed and pressed position; the tool of the given mass is held by the
    grip, and dry friction acts against its velocity. Runge-Kutta in 40 steps per period, from
    sliding at rest relative to the hand; the last 10 of 200 periods count. One row per scan,
    surfaces of stiffness 1.
    """
    period = surface.texture.period
    height = surface.texture.extremes[1] - surface.max_depth
    x = np.linspace(0.0, period, 200, endpoint=False)
    level = np.column_stack([x, 0 * x, np.full(200, height)])
    mean = surface.force(level).mean(axis=0)
    count, steps = len(mass), 40
    base = np.column_stack([0 * mass, 0 * mass, height - stiffness * mean[2] / grip.stiffness])
    drift = np.column_stack([speed, 0 * speed, 0 * speed])
    dragged = -(friction + damping * speed) / grip.stiffness
    p = np.column_stack([dragged, 0 * mass, np.full(count, height)])
    v, dt = drift.copy(), (period / speed / steps)[:, None]

    def rate(t: FloatArray, p: FloatArray, v: FloatArray) -> FloatArray:
        held = grip.stiffness * (p - base - drift * t) + grip.damping * (v - drift)
        sliding = friction[:, None] * v / np.linalg.norm(v, axis=1)[:, None]
        force = stiffness[:, None] * surface.force(p) - held - damping[:, None] * v - sliding
        return force / (mass + grip.mass)[:, None]

    motions, forces = [], []
    for i in range(200 * steps):
        t = i * dt
        a1 = rate(t, p, v)
        a2 = rate(t + dt / 2, p + dt / 2 * v, v + dt / 2 * a1)
        a3 = rate(t + dt / 2, p + dt / 2 * v + dt**2 / 4 * a1, v + dt / 2 * a2)
        a4 = rate(t + dt, p + dt * v + dt**2 / 2 * a2, v + dt * a3)
        p, v = p + dt * v + dt**2 / 6 * (a1 + a2 + a3), v + dt / 6 * (a1 + 2 * a2 + 2 * a3 + a4)
        if i >= 190 * steps:
            moved = p - base - drift * (t + dt)
            motions.append(moved)
            inertia = grip.mass * rate(t + dt, p, v)
            forces.append(grip.stiffness * moved + grip.damping * (v - drift) + inertia)
    return tuple(np.sqrt(2.0 * np.var(one, axis=0).sum(axis=1)) for one in (motions, forces))


GRIPS = (load_grip(), Grip("firm", 450.0, 5.0, 0.01, (1.0, 1e3), (1e-7,) * 2, (1e-6,) * 2, {}))


@pytest.mark.parametrize(
    ("law", "grip"),
    list(zip("ACGH", GRIPS * 2, strict=True)),
    ids=["A-pen", "C-firm", "G-pen", "H-firm"],
)
def test_motion_at_the_hand_is_that_of_a_direct_simulation(law: str, grip: Grip) -> None:
    """200 random devices, scans and stiffnesses, with dry friction, within 5 %."""
    rng = np.random.default_rng([ord(law), int(grip.stiffness)])
    count, period = 25, 2e-3
    mass, damping = rng.uniform(0.03, 0.3, count), rng.uniform(0.5, 3.0, count)
    friction = rng.choice([0.0, 1.0], count) * rng.uniform(0.02, 0.26, count)
    stiffness, speed = rng.uniform(200.0, 2000.0, count), rng.uniform(0.03, 0.15, count)
    wave = Sinusoid(4e-6, period)
    surface = Surface(wave, law, 1.0, 0.3e-3)
    motions, forces = simulate_scan(surface, mass, damping, friction, stiffness, speed, grip)
    rms = merit(surface).ripple
    for i in range(count):
        fields = {
            "apparent_mass": f"{mass[i]:.17g} kg",
            "damping": f"{damping[i]:.17g} N*s/m",
            "friction": f"{friction[i]:.17g} N",
        }
        result = assess_perceptibility(
            surface.to_stiffness(stiffness[i]),
            device(**fields),
            TexturePart(wave),
            rms=rms * stiffness[i],
            grip=grip,
            speed=speed[i],
            find_remedies=False,
        )
        assert result.hand_motion == pytest.approx(motions[i], rel=0.05)
        assert result.hand_force == pytest.approx(forces[i], rel=0.05)


def test_friction_does_not_hide_a_texture_that_is_scanned() -> None:
    """The issue's washboard: felt with and without 0.26 N of dry friction."""
    for fields in ({}, {"friction": "260 mN"}):
        assert assess_wave(20e-6, device(**fields)).tier == "felt"


@pytest.mark.parametrize("amplitude", [2e-8, 1e-7, 8e-7])
@pytest.mark.parametrize("fields", [{}, {"friction": "60 mN"}, {"force_resolution": "1 mN"}])
def test_each_remedy_makes_the_texture_felt(amplitude: float, fields: dict[str, str]) -> None:
    own_device = device(
        update_rate="1 kHz", position_resolution="10 um", bandwidth="200 Hz", **fields
    )
    for period in (LONG, SHORT):
        result = assess_wave(amplitude, own_device, period)
        assert result.tier != "felt"
        assert result.remedies
        for remedy in result.remedies:
            remedied = assess_remedied(remedy, 1.0, amplitude, period, own_device)
            assert remedied.tier == "felt", remedy
            assert assess_remedied(remedy, 0.9, amplitude, period, own_device).tier != "felt"


def assess_remedied(
    remedy: Remedy, share: float, amplitude: float, period: float, own_device: Device
) -> Perceptibility:
    """Return the perceptibility with a remedy, or with a share of it."""
    if remedy.kind == "magnify":
        factor = share * remedy.value
        return assess_wave(factor * amplitude, own_device, factor * period)
    if remedy.kind == "speed":
        slower = remedy.value < 0.1
        speed = remedy.value / share if slower else remedy.value * share
        return assess_wave(amplitude, own_device, period, speed=speed)
    datum = Datum(remedy.value / share, "", "test", True)
    data = {**own_device.data, remedy.kind: datum}
    return assess_wave(amplitude, replace(own_device, data=data), period)


def test_position_resolution_is_the_remedy_where_no_speed_helps() -> None:
    """For steps of 1 mm on waves of 2 mm the only remedy besides magnifying is resolution."""
    own_device = device(update_rate="1 kHz", position_resolution="1 mm")
    (remedy,) = (one for one in assess_wave(1e-4, own_device).remedies if one.kind != "magnify")
    assert remedy.kind == "position_resolution"
    for value, tier in ((remedy.value * (1.0 - 1e-9), True), (1.1 * remedy.value, False)):
        data = {**own_device.data, remedy.kind: replace(own_device.data[remedy.kind], value=value)}
        assert (assess_wave(1e-4, replace(own_device, data=data)).tier == "felt") is tier


def test_undersampled_waves_are_borderline_and_need_a_slower_scan() -> None:
    """At 1 kHz and 0.1 m/s a wave of 0.3 mm has three updates, between 2 and 5."""
    own_device = device(update_rate="1 kHz")
    result = assess_wave(1e-4, own_device, SHORT)
    assert (result.tier, result.resolved, result.resolved_rms) == ("borderline", 0.0, 0.0)
    (slower,) = (one.value for one in result.remedies if one.kind == "speed")
    assert slower == pytest.approx(SHORT * 1000.0 / 5.0, rel=0.06)
    # One update in a wave.
    assert assess_wave(1e-4, own_device, SHORT, speed=0.3).tier == "not felt"
    assert assess_wave(1e-4, own_device, SHORT, speed=0.05).tier == "felt"


def test_only_waves_within_the_bandwidth_are_resolved() -> None:
    """Of two waves with equal force one is above the bandwidth of 100 Hz."""
    wave = Fourier([1e-4, 1e-4], [[2 * math.pi / LONG, 0.0], [2 * math.pi / SHORT, 0.0]])
    surface = Surface(wave, "A", 500.0, 1e-3)
    rms = 500.0 * 1e-4
    result = assess_perceptibility(surface, device(bandwidth="100 Hz"), TexturePart(wave), rms=rms)
    assert result.resolved == pytest.approx(0.5, rel=1e-6)
    assert result.resolved_rms == pytest.approx(rms * RMS, rel=1e-6)


def test_unverified_numbers_that_hide_only_together_hide_nothing() -> None:
    """Friction damps both waves a little, steps of position hide the weaker one."""
    waves = [[2 * math.pi / LONG, 0.0], [2 * math.pi / SHORT, 0.0]]
    numbers = {"friction": "0.2 N", "position_resolution": "100 um"}

    def assess(scale: float, own_device: Device) -> Perceptibility:
        wave = Fourier([scale * 1e-6, scale * 1e-6], waves)
        surface = Surface(wave, "A", 500.0, 1e-3)
        return assess_perceptibility(
            surface, own_device, TexturePart(wave), rms=merit(surface).ripple * 500.0
        )

    alone = [assess(1.0, device(**{name: numbers[name]})).level for name in numbers]
    together = assess(1.0, device(**numbers)).level
    assert together < 0.999 * min(alone)
    scale = 1.0 / math.sqrt(together * min(alone))
    data = device(**numbers).data
    remembered = {name: replace(data[name], source="memory", verified=False) for name in numbers}
    doubtful = replace(device(), data={**device().data, **remembered})
    result = assess(scale, doubtful)
    assert assess(scale, device(**numbers)).tier == "borderline"
    assert (result.tier, set(result.unverified)) == ("felt", set(numbers))


def test_form_is_separated_from_texture() -> None:
    """A 2 mm deep bowl with waves of 20 µm has mostly form and little texture."""
    x = np.linspace(0.0, 40e-3, 400)
    bowl = 2e-3 * ((x - 20e-3) / 20e-3) ** 2
    heights = bowl + 20e-6 * np.sin(2 * np.pi * x / 1e-3) + np.zeros((400, 1))
    result = compare(HeightMap(heights, 40e-3 / 399), device(), "A", max_depth=1e-3)
    perceptibility = result.row("A").perceptibility
    assert perceptibility is not None
    k = result.row("A").recommended_stiffness
    assert perceptibility.is_mostly_form
    assert perceptibility.nesting_index == 8e-3
    assert perceptibility.rms > 0.3 * k * 1e-3 / 3
    assert perceptibility.texture_rms == pytest.approx(k * 20e-6 * RMS, rel=0.1)
    assert "of which" in texture_amount_text(perceptibility)
    answer = " ".join([result.recommendation, *result.reasons])
    assert "RMS is form and waviness, felt as a shape" in answer
    assert "remove it" not in answer  # which makes a texture no stronger
    assert "L-filter of 8 mm" in " ".join(result.assumptions)


def test_analytic_texture_has_no_nesting_index() -> None:
    assert Sinusoid(1e-3, 20e-3).texture_part().nesting is None


def test_sentences_name_the_motion_and_the_remedies() -> None:
    result = assess_wave(1e-7, device())
    assert re.fullmatch(
        r"it moves the held tool \(100 g\) by [\d.]+ nm, 0\.\d+ of the amplitude that is felt, "
        "above all at 50 Hz",
        masking_text(result),
    )
    still = replace(result, level=0.0, hand_motion=0.0)
    assert masking_text(still).endswith("in waves that it resolves")
    assert re.fullmatch(r"To feel it, magnify it \d+ times more(, or .*)?\.", remedies_text(result))
    steps = assess_wave(80e-6, device(force_resolution="20 mN"))
    assert masking_text(steps) == "the device's force steps of 20 mN hide it"
    assert "use a device with force steps below 16 mN" in remedies_text(steps)


def test_says_so_where_no_remedy_helps() -> None:
    """A stiff contact law with steps of the force above all that magnifying 1 mm gives."""
    result = replace(assess_wave(1e-7, device()), remedies=())
    text = "No magnification within the workspace, speed or finer device alone makes it felt."
    assert remedies_text(result) == text
    assert remedies_text(assess_wave(1e-4, device())) == ""


def test_compare_and_limits_give_the_same_perceptibility() -> None:
    texture = Sinusoid(1e-4, 1e-3)
    for name in ("touch", "inverse3", "pantograph", "falcon"):
        result = compare(texture, name, "ACH")
        for row in result.rows:
            single = limits(texture, name, law=row.law)
            assert single.perceptibility == row.perceptibility
            assert single.surface.stiffness == row.recommended_stiffness


def test_imperceptible_laws_are_not_recommended() -> None:
    result = compare(Sinusoid(1e-7, 1e-3), "touch", grip=WIDE)
    assert result.recommended == ""
    sound = [row for row in result.rows if row.conservative and row.continuous]
    assert result.nearest_row is max(sound, key=lambda row: row.resolved_force)
    assert result.recommendation.startswith("Nothing of this texture will be felt")
    assert "magnify" in result.recommendation
    # limits() uses the law nearest to being felt.
    assert limits(Sinusoid(1e-7, 1e-3), "touch").surface.law is result.nearest_row.law


def test_laws_continuous_at_every_depth_are_preferred() -> None:
    """Above its focal depth D is as good as C and H, but at larger depths its force jumps."""
    result = compare(Sinusoid(5e-5, 1.5e-3), "omega.3", "CDH", max_depth=5e-5)
    forces = {row.law.letter: row.resolved_force for row in result.rows}
    assert forces["D"] == max(forces.values())
    assert result.row("D").continuous
    assert result.recommended in {"C", "H"}


def test_waviness_of_rounding_size_is_reported_as_none() -> None:
    result = assess_wave(1e-4, device(), SHORT)
    own_device = replace(result, nesting_index=8e-3)
    (text,) = form_removal_sentences(own_device, 3e-6, 1.8e-21)
    assert text.endswith("L-filter of 8 mm; they take form 3 µm high and no waviness")
    assert form_removal_sentences(replace(result, nesting_index=None), 3e-6, 1e-6) == []


@pytest.mark.parametrize(
    ("period", "extrapolates"), [(2.4e-3, False), (2.6e-3, True), (0.21e-3, False), (0.19e-3, True)]
)
def test_thresholds_beyond_their_frequencies_are_reported(
    period: float, extrapolates: bool
) -> None:
    """At 0.1 m/s these waves are at 42, 38, 476 and 526 Hz; the thresholds cover 40 to 500 Hz."""
    for laws in ("C", "WC"):  # the wall, which has no waves, extrapolates nothing
        result = compare(Sinusoid(period / 20.0, period), device(), laws)
        perceptibility = result.row("C").perceptibility
        assert perceptibility is not None
        assert perceptibility.extrapolated is extrapolates
        text = "below 40 Hz and above 500 Hz no threshold is known"
        assert (text in " ".join(result.assumptions)) is extrapolates


def test_nothing_is_felt_at_frequencies_without_thresholds() -> None:
    """1 mN and more at 10 Hz on a Touch: unknown; faster it is felt, smaller it is not felt."""
    for amplitude, speed, tier in (
        (50e-6, 0.1, "unknown"),
        (50e-6, 0.45, "felt"),
        (1e-12, 0.1, "not felt"),
    ):
        result = compare(Sinusoid(amplitude, 10e-3), "touch", "C", speed=speed)
        texture = result.rows[0].perceptibility
        assert texture is not None
        assert texture.tier == tier
        assert (texture.level == 0.0) is (speed == 0.1)
    slow = compare(Sinusoid(50e-6, 10e-3), "touch", "C")
    assert slow.tier == "unknown"
    text = masking_text(slow.rows[0].perceptibility)
    assert text.endswith(
        "where waves of it are, no threshold is known; their harmonics are not counted"
    )
    assert slow.rows[0].perceptibility.remedies[0].kind == "speed"
    # A second wave within the thresholds decides, whatever the first one is.
    both = Fourier([50e-6, 20e-6], [[200.0 * math.pi, 0.0], [2000.0 * math.pi, 0.0]], [0.0, 0.0])
    assert compare(both, "touch", "C").tier == "felt"


def test_wave_longer_than_the_workspace_is_not_felt() -> None:
    """4 µm on 8 m, at 13 mHz: a wave that no stroke passes through."""
    width = 0.15
    for period, tier in ((8.0, "not felt"), (1.001 * width, "not felt"), (0.999 * width, "felt")):
        result = assess_wave(4e-3 * period / 8.0, device(workspace_radius=width / 2.0), period)
        assert result.tier == tier
        assert assess_wave(4e-3 * period / 8.0, device(), period).tier == "felt"


@pytest.mark.parametrize("name", device_names())
def test_wood_is_felt_on_every_device_of_the_catalogue(name: str) -> None:
    """At three times its size; the wall test that the 2diy lacks is given."""
    own_device = load_device(name)
    if own_device.wall_test is None:
        stable = Datum(1000.0, "N/m", "assumed", verified=True)
        own_device = replace(own_device, data={**own_device.data, "max_stiffness": stable})
    wood = prepare_texture(as_texture("wood"), magnify=3.0)
    row = compare(wood, own_device, "H", rendering="search").row("H")
    assert row.perceptibility is not None
    assert row.perceptibility.tier == "felt"


@pytest.mark.parametrize("make", ["wave", "map"])
def test_magnification_stays_within_the_workspace(make: str) -> None:
    """What is printed fits: one wave of an endless texture, the whole of a finite one."""
    x = np.linspace(0.0, 0.9e-3, 40)
    height = 1e-6 * np.sin(2.0 * np.pi / 0.2e-3 * x + 0.2 * np.arange(40)[:, None])
    is_map = make == "map"
    texture: Any = HeightMap(height, (x[1], x[1])) if is_map else Sinusoid(3e-9, 2e-3)
    size = float(np.hypot(*texture.domain.spans.T).max())
    surface = Surface(texture, "A", 1000.0)
    rms = merit(surface).ripple * 1000.0

    def magnification(own_device: Device) -> float | None:
        part = TexturePart(texture)
        found = assess_perceptibility(surface, own_device, part, rms=rms, grip=WIDE).remedies
        return next((remedy.value for remedy in found if remedy.kind == "magnify"), None)

    factor = magnification(device())
    assert factor is not None
    assert factor > 2.0
    for room, is_printed in ((1.01, True), (0.99, False)):
        own_device = device(workspace_diameter=room * factor * size)
        assert (magnification(own_device) is not None) is is_printed


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"speed": 0.0}, r"speed must be positive \[m/s\], got 0.0"),
        ({"speed": -0.1}, "speed must be positive"),
    ],
)
def test_scan_without_speed_is_refused(options: dict[str, float], message: str) -> None:
    with pytest.raises(ParameterError, match=message):
        compare(Sinusoid(1e-4, 2e-3), device(), "C", **options)


@pytest.mark.parametrize("field", ["apparent_mass", "damping"])
@pytest.mark.parametrize("value", [0.0, -0.05])
def test_mass_and_damping_of_a_device_are_positive(field: str, value: float) -> None:
    with pytest.raises(ParameterError, match=f"{field} must be positive"):
        device(**{field: value})


@pytest.mark.parametrize("ratio", [2.0, 0.5, 0.25])
def test_friction_that_varies_is_felt_as_a_simulated_scan_renders_it(ratio: float) -> None:
    """On law W nothing else is; the presliding stiffness leaves 0.79 and 0.48 of the limit."""
    wave, depth, speed = Sinusoid(1e-4, 1e-3), 2e-4, 0.1
    slope = 0.4 * 1000.0 * depth * 0.5 * 2.0 * math.pi / 1e-3
    friction = {"friction": 0.4, "friction_modulation": 1.0, "presliding_stiffness": ratio * slope}
    surface = Surface(wave, "W", 1000.0, depth, **friction)  # type: ignore[arg-type]  # by name
    part = TexturePart(wave)
    found = assess_perceptibility(surface, device(), part, rms=0.0, speed=speed)
    stroke = Strokes((0.0, 0.0, -depth), (10e-3, 0.0, -depth), speed=speed, count=1)
    servo = Servo(2.5e-5)
    run = simulate(surface, Cartesian(0.1), PrescribedHand(), servo, stroke, stroke.duration)
    names = [name for name, _unit in COLUMNS]
    force = run.table[-2000:, names.index("commanded x")]  # the last five periods
    assert found.texture_rms == found.rms
    assert found.texture_rms == pytest.approx(force.std(), rel=0.01)
    compliance = PEN.compliance(np.array([100.0]), 0.1)[0]
    assert found.hand_motion == pytest.approx(compliance * math.sqrt(2.0) * force.std(), rel=0.01)
    assert found.tier == "felt"
    plain = surface.without_friction()
    assert assess_perceptibility(plain, device(), part, rms=0.0, speed=speed).tier == "not felt"


def test_constant_friction_adds_nothing_and_friction_adds_in_squares() -> None:
    wave = Sinusoid(1e-4, 1e-3)
    still = Surface(wave, "W", 1000.0, 2e-4, friction=0.4)
    assert assess_perceptibility(still, device(), TexturePart(wave), rms=0.0).texture_rms < 1e-9
    for law in ("C", "H"):
        surface = Surface(wave, law, 1000.0, 2e-4, friction=0.8, friction_modulation=1.0)
        rms = merit(surface).ripple * 1000.0
        found = assess_perceptibility(surface, device(), TexturePart(wave), rms=rms)
        x = np.linspace(0.0, 10e-3, 40_001)
        height = wave.extremes[1] - 2e-4
        path = np.column_stack([x, 0.0 * x, np.full_like(x, height)])
        rendered = surface.trace(path)[20_000:-1]
        assert found.texture_rms == pytest.approx(math.sqrt(rendered.var(axis=0).sum()), rel=0.02)
