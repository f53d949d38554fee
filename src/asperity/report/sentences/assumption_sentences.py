"""The assumptions of results: defaults, unverified data, regions, what is not proved."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence

from asperity.analysis.limits.limit_rules import LIMIT_RULES
from asperity.analysis.limits.perceptibility import Perceptibility
from asperity.analysis.limits.spectrum import tip_gain
from asperity.analysis.passivity.criteria import LEAK
from asperity.analysis.results.analyze import PASSIVITY_FIELDS, Analysis, surface_width
from asperity.analysis.results.check_limits import Limits
from asperity.analysis.results.compare import Comparison
from asperity.core.arguments import DEFAULT_STIFFNESS
from asperity.core.units import count_text, format_quantity, format_stiffness
from asperity.devices import Device
from asperity.envelopes.envelope import GENTLE_WAVE, Envelope
from asperity.laws.f_friction_modulation import LAW as F
from asperity.rendering import rendering_sentences
from asperity.report.sentences.answer_sentences import simulated_loops_text
from asperity.report.sentences.limit_sentences import (
    form_removal_sentences,
    grip_text,
    percent,
    perceptibility_assumptions,
    spectrum_description,
    speed_text,
    stiffness_text,
)
from asperity.report.sentences.passivity_sentences import (
    buzz_text,
    damping_assumption,
    energy_gained_text,
    jumps_clause,
    stability_limit_text,
    stiffness_limit_text,
    update_rate_text,
)
from asperity.report.sentences.texts import loss_text
from asperity.surface import Surface, default_max_depth
from asperity.textures.texture import Texture

SCOPE_SENTENCE = "Results concern energy and forces; they were not tested with people"
"""The last assumption of a comparison and of an analysis."""


# --- what results share ---------------------------------------------------------------------------


def default_depth_text(surface: Surface) -> str:
    """Return the default max_depth, in a sentence."""
    depth = format_quantity(surface.max_depth, "m")
    if surface.max_depth == surface.texture.depth_limit:
        return f"Default max depth {depth}: that of the field"
    return f"Default max depth {depth}: the peak-to-valley height, at most 1 mm"


def depth_range_text(surface: Surface) -> str:
    """Return the depths at which q and q⁺ hold.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> wave, clamps = Sinusoid(1e-4, 1e-3), ("none", "backed", "lateral")
        >>> [depth_range_text(Surface(wave, clamp=clamp)) for clamp in clamps]
        ['depths to 200 µm', 'every depth', 'depths to 400 µm']
    """
    if surface.effective_clamp.holds_whole_force:
        return "every depth"
    return f"depths to {format_quantity(surface.clamped_depth, 'm')}"


def law_parameter_sentences(surface: Surface) -> list[str]:
    """Return the parameters of a surface's law, one sentence each.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> law_parameter_sentences(Surface(Sinusoid(1e-4, 1e-3), "F", friction=0.3))[:2]
        ['Given friction 0.3', 'Default max deflection 1 mm']
    """
    sentences = []
    for name, argument in surface.law.arguments.items():
        value = surface.law_parameters[name]
        origin = "Default" if value == argument.default else "Given"
        sentences.append(f"{origin} {name.replace('_', ' ')} {argument.format_value(value)}")
    return [*sentences, *friction_sentences(surface)]


def friction_sentences(surface: Surface) -> list[str]:
    """Return the friction of a surface, one sentence for each of its numbers.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> friction_sentences(Surface(Sinusoid(1e-4, 1e-3), "H", friction=0.3))[:2]
        ['Given friction 0.3', 'Default presliding stiffness 250 N/m, 0.25 of the stiffness']
    """
    friction = surface.contact_friction
    if friction is None:
        return []
    stiffness = format_quantity(friction.presliding_stiffness, "N/m")
    presliding = f"Given presliding stiffness {stiffness}"
    if friction.stiffness_share:
        share = f"{friction.stiffness_share:.2g} of the stiffness"
        presliding = f"Default presliding stiffness {stiffness}, {share}"
    origin = "Given" if friction.modulation else "Default"
    modulation = f"{origin} friction modulation {friction.modulation:g}"
    return [f"Given friction {friction.coefficient:g}", presliding, modulation]


def unverified_sentences(device: Device, fields: Iterable[str]) -> list[str]:
    """Return the used numbers of a device that are not verified, and its notes."""
    unverified = [
        f"{field.replace('_', ' ')} {device.data[field].text}"
        for field in fields
        if field in device.data and not device.data[field].verified
    ]
    return [*_not_verified(device, unverified), *device.notes]


def _not_verified(device: Device, names: Sequence[str]) -> list[str]:
    if not names:
        return []
    return [f"Not verified for the {device.name}: {', '.join(names)}"]


# --- a comparison ---------------------------------------------------------------------------------


def comparison_assumptions(comparison: Comparison) -> tuple[str, ...]:
    """Return the assumptions of a comparison."""
    rows = comparison.rows
    device = comparison.device
    surface = rows[0].surface
    part = surface.texture.texture_part()
    texture = _assessed_texture(comparison)
    steps = [*surface.texture.preparation]
    for row in rows:
        steps += rendering_sentences(row.surface)
    searches = [row.rendering.sentence(row.law) for row in rows]
    sentences = [*dict.fromkeys(steps), *filter(None, searches), *comparison_defaults(comparison)]
    sentences += form_removal_sentences(texture, part.form, part.waviness)
    sentences += _wall_assumptions(comparison)
    sentences += _margin_assumptions(comparison)
    unverified = [
        field.replace("_", " ")
        for field, datum in device.data.items()
        if not datum.verified and field != "max_stiffness"
    ]
    sentences += _not_verified(device, unverified)
    if texture is not None:
        sentences += perceptibility_assumptions(texture, device, comparison.grip)
    if any("sampled" in (row.q.method, row.one_sided.method) for row in rows):
        sentences.append(
            "Numbers marked sampled are the greatest found over "
            f"{surface.texture.domain.description} and depths to "
            f"{format_quantity(surface.max_depth, 'm')}, not bounds"
        )
    sentences.append(_probe_sentence(surface.texture, comparison.speed))
    sentences.append(
        "The leak is the work of the field on one slow traversal of its worst loop, without "
        "delay, quantisation and friction of the device"
    )
    return (*sentences, SCOPE_SENTENCE)


def _assessed_texture(comparison: Comparison) -> Perceptibility | None:
    """Return the texture of a law, of one whose waves are extrapolated if there is any."""
    assessed = [row.perceptibility for row in comparison.rows if row.perceptibility is not None]
    return max(assessed, key=lambda texture: texture.extrapolated, default=None)


def comparison_defaults(comparison: Comparison) -> list[str]:
    """Return speed, press or depth and parameters of the laws: the defaults that were used."""
    sentences = []
    if "speed" in comparison.defaults:
        sentences.append(f"Default scanning speed {speed_text(comparison.speed)}")
    if comparison.press is not None:
        press = format_quantity(comparison.press, "N")
        sentences.append(
            f"Press of {press}: the mean normal force of a scan at constant height; each law has "
            "its own depth for it"
        )
        strongest = comparison.device.value("max_force")
        if strongest is not None and strongest < comparison.press:
            sentences.append(f"The device gives {format_quantity(strongest, 'N')}, less than that")
    elif "max_depth" in comparison.defaults:
        sentences.append(default_depth_text(comparison.rows[0].surface))
    for row in comparison.rows:
        for parameter in law_parameter_sentences(row.surface):
            sentences.append(f"{parameter} for law {row.law.letter}")
    sentences += [_mended_text(row.surface) for row in comparison.rows if row.law is F]
    return sentences


def _mended_text(surface: Surface) -> str:
    """Return the friction that has the slip limit of law F, and no leak."""
    depth = surface.modulation_depth
    coefficient = surface.friction * (1.0 + depth) / 2.0
    modulation = 2.0 * depth / (1.0 + depth)
    mended = f"law W with friction {coefficient:.3g} and friction modulation {modulation:.3g}"
    return f"Law F leaks, as in the paper; the same friction without a leak: {mended}"


_TIP_RADIUS = 0.5e-3
_TIP_BAND = (120.0, 250.0)  # [Hz], where a hand feels the smallest motion


def _probe_sentence(texture: Texture, speed: float) -> str:
    """Return that the probe is a point, and how much less a ball would feel."""
    text = "The probe is a point on the surface as prepared; tip_radius traces it by a ball first"
    low, high = _TIP_BAND
    gain = tip_gain(texture, _TIP_RADIUS, (speed / high, speed / low))
    if gain is None:
        return text
    ball = format_quantity(_TIP_RADIUS, "m")
    at = f"{low:g} to {high:g} Hz, at {format_quantity(speed, 'm/s')}"
    return f"{text}: one of {ball} would feel about {loss_text(gain)} of its heights at {at}"


def _wall_assumptions(comparison: Comparison) -> list[str]:
    """Return the source of K₀, and the assumptions of using it as a limit."""
    device = comparison.device
    test = device.wall_test
    if test is None:
        return []
    loop = comparison.rows[0].passivity.loop
    rate = format_quantity(float(loop.wall_rate), "Hz")
    source = f"; {rate}: {test.rate_source}" if test.rate_source else ""
    sentences = [
        f"K₀ = {test.value:g} N/m at {rate} for the {device.name} ({test.pedigree}): "
        f"{test.source}{source}"
    ]
    sentences += _rate_sentences(comparison)
    if "plausible" in [row.stability_limit.basis for row in comparison.rows]:
        sentences.append(
            "Plausible, not proved. Assumed: the wall of stiffness K₀ was close to its stability "
            f"limit (heavy handle, loose grip); {damping_assumption(test)}"
        )
    return sentences


def _rate_sentences(comparison: Comparison) -> list[str]:
    """Return the update rates at which the recommended stiffnesses hold."""
    loop = comparison.rows[0].passivity.loop
    limits = {row.stability_limit.update_rate: row.stability_limit for row in comparison.rows}
    limits.pop(None, None)
    sentences = [f"Recommended {update_rate_text(limit)}" for limit in limits.values()]
    if loop.least_rate < loop.wall_rate:
        share = float(loop.least_rate / loop.wall_rate)
        sentences.append(f"A slower loop than that of K₀ is allowed less in proportion: {share:g}")
    if loop.delay is not None and loop.delay != loop.wall_delay:
        wall = format_quantity(float(loop.delayed_wall_stiffness or 0), "N/m")
        delay = f"{count_text(loop.delay, 'sample')}, {float(loop.wall_delay):g} in the test of K₀"
        sentences.append(f"A delay of {delay}, allows a wall of {wall}")
    return sentences


def _margin_assumptions(comparison: Comparison) -> list[str]:
    """Return the basis of the safety margins."""
    # A user-defined law borrows the margin of a shipped one, which may be compared too.
    margins = {row.margin.law: row.margin for row in comparison.rows if row.margin.loops}
    if not margins:
        return []
    parts = "; ".join(
        [
            f"{law} {margin.factor:g}: {simulated_loops_text(margin)}"
            for law, margin in margins.items()
        ]
    )
    return [
        f"Safety margins from simulation ({parts}): random loops in which a smooth wall of K₀ is "
        "just passive, over masses, damping per direction, grips up to 500 N/m, delays of 0 to 6 "
        "samples and places on random profiles; not this surface on this device"
    ]


# --- an analysis ----------------------------------------------------------------------------------


def analysis_answer(analysis: Analysis) -> str:
    """Return the verdict of an analysis in one sentence."""
    return f"{_passivity_text(analysis)}; {jumps_clause(analysis.continuity)}."


def _passivity_text(analysis: Analysis) -> str:
    surface = analysis.surface
    passivity = analysis.passivity
    depth = format_quantity(surface.max_depth, "m")
    case = (
        f"{surface.law.letter} at {format_stiffness(surface.stiffness)}, pressed to {depth}, "
        f"on the {analysis.device.name}"
    )
    rule = passivity.criterion(passivity.decided_by)
    limit = stiffness_limit_text(rule.limit or 0.0)
    if passivity.verdict == "passive":
        return f"Law {case} is passive up to {limit}, proved by {rule.formula}"
    if passivity.verdict == "plausible":
        return f"Law {case} is plausibly passive up to {limit}, by {rule.formula}, not proved"
    if passivity.verdict == "bounded" and passivity.buzz is not None:
        return f"Law {case} is passive but for steps: {buzz_text(passivity.buzz)}"
    if passivity.verdict == "not passive" and rule.name == LEAK:
        return f"Law {case} is not passive: {energy_gained_text(passivity.loop)}"
    if passivity.verdict == "not passive":
        return f"Law {case} is not passive: {passivity.reason}"
    return f"Law {case} is not known to be passive: {passivity.reason}"


def analysis_assumptions(analysis: Analysis) -> tuple[str, ...]:
    """Return used defaults, unverified device data and preparation of the surface."""
    surface = analysis.surface
    texture = surface.texture
    search = analysis.rendering.sentence(surface.law)
    steps = [*texture.preparation, *rendering_sentences(surface)[1:]]
    sentences = [*steps, *filter(None, [search]), *_analysis_defaults(surface)]
    region = texture.domain.description
    if analysis.extent is not None:
        sides = [format_quantity(side, "m") for side in analysis.extent]
        region = f"{' x '.join(sides)} from the origin"
    sentences.append(f"The numbers are suprema over {region} and {depth_range_text(surface)}")
    if surface.effective_clamp.changes_force:
        depth = format_quantity(surface.max_depth, "m")
        lowest = format_quantity(surface.clamped_depth, "m")
        sentences.append(
            f"The {surface.effective_clamp} clamp holds the depth from {depth} down; loops are "
            f"compared down to depths of {lowest}"
        )
    x, y = analysis.leak.line.direction.tolist()
    plane = f"Loops in the vertical plane along ({x:g}, {y:g}) are compared"
    directions = analysis.leak.origin.directions
    if directions > 1:
        plane = f"Loops in vertical planes of {directions} directions are compared"
    sentences.append(plane)
    if any(math.isinf(bound.upper - bound.lower) for bound in analysis.bounds):
        sentences.append("A number without an upper bound is the greatest one found, not a proof")
    if not analysis.continuity.continuous:
        sentences.append("Jumps are located where contact begins and below the sharpest crest only")
    sentences += unverified_sentences(analysis.device, PASSIVITY_FIELDS)
    return (*sentences, SCOPE_SENTENCE)


def _analysis_defaults(surface: Surface) -> list[str]:
    sentences = []
    if surface.stiffness == DEFAULT_STIFFNESS:
        sentences.append(f"Default stiffness {surface.stiffness:g} N/m")
    if surface.max_depth == default_max_depth(surface.texture):
        sentences.append(default_depth_text(surface))
    width = surface_width(surface.texture)
    if surface.max_depth > width:
        sentences.append(
            f"Below {format_quantity(width, 'm')}, the surface's width, only its mirror images are "
            "in contact"
        )
    return sentences + law_parameter_sentences(surface)


# --- the six limits -------------------------------------------------------------------------------


def limits_assumptions(result: Limits) -> tuple[str, ...]:
    """Return the assumptions of the limits."""
    surface = result.surface
    steps = [*surface.texture.preparation, *rendering_sentences(surface)[1:]]
    sentences = [*steps, *_limits_defaults(result)]
    sentences.append(f"Waves: {spectrum_description(result.spectrum)}")
    omitted = len(result.spectrum.waves) - len(result.waves)
    if omitted:
        sentences.append(
            f"{omitted} bands with less than 0.1 % of the variance of height and of force are "
            "left out of the limits"
        )
    depth = format_quantity(surface.max_depth, "m")
    sentences.append(f"Forces are those of a scan at constant height, pressed to {depth}")
    if result.contact_lost > 0.0:
        sentences.append(f"No contact on {percent(result.contact_lost)} of that scan")
    if result.gain.method == "sampled":
        sentences.append(f"{result.gain_symbol} = {result.gain.value:.4g} is sampled, not proved")
    fields = [*dict.fromkeys([limit.device_field for limit in result.limits]), "friction"]
    sentences += perceptibility_assumptions(result.perceptibility, result.device, result.grip)
    sentences += unverified_sentences(result.device, fields)
    sentences.append("The limits are necessary, not sufficient; they were not tested with people")
    return tuple(sentences)


def _limits_defaults(result: Limits) -> list[str]:
    sentences = []
    if "speed" in result.defaults:
        sentences.append(f"Default speed {speed_text(result.speed)}")
    if "samples" in result.defaults:
        sentences.append(
            f"Samples in a wave: α = {result.time_samples:g}, β = {result.position_samples:g}, "
            f"γ = {result.force_steps:g}; the paper recommends 5 to 10"
        )
    if "stiffness" in result.defaults:
        sentences.append(_default_stiffness_text(result))
    if "max_depth" in result.defaults:
        sentences.append(default_depth_text(result.surface))
    return sentences + law_parameter_sentences(result.surface)


def _default_stiffness_text(result: Limits) -> str:
    stiffness = stiffness_text(result)
    limit = stability_limit_text(result.stability_limit)
    factor = result.margin.factor
    if not result.stability_limit.stiffness:
        return f"Stiffness {stiffness}, a default: {limit}"
    if factor < 1.0:
        return f"Stiffness {stiffness}: {factor:g} of what is {limit}"
    return f"Stiffness {stiffness}: {limit}"


# --- an envelope ----------------------------------------------------------------------------------

_ENVELOPE_FIELDS = (
    *[rule.device_field for rule in LIMIT_RULES if rule.number != 3],
    "apparent_mass",
    "damping",
    "friction",
)


def envelope_assumptions(envelope: Envelope) -> tuple[str, ...]:
    """Return the assumptions of an envelope."""
    conditions = envelope.conditions
    depth = "their peak-to-valley height, at most 1 mm"
    if conditions.max_depth is not None:
        depth = format_quantity(conditions.max_depth, "m")
    sentences = [
        f"Sinusoids, pressed to {depth}, scanned at {speed_text(conditions.speed)} at constant "
        "height",
        f"Hand: {grip_text(conditions.grip)}",
    ]
    for region in envelope.devices:
        name = region.device.name
        for text in unverified_sentences(region.device, _ENVELOPE_FIELDS):
            sentences.append(text if name in text else f"{name}: {text}")
    for law in envelope.devices[0].laws:
        for text in law_parameter_sentences(law.case.surface(GENTLE_WAVE)):
            sentences.append(f"{text} for law {law.letter}")
    laws = [law for region in envelope.devices for law in region.laws]
    if not all(law.conservative for law in laws):
        sentences.append(
            "A law with curl has the wall's gain K₀/q as its limit: it delivers energy below a "
            "speed v* at any stiffness, and feels alive"
        )
    if envelope.surfaces:
        sentences.append(
            "Points of a surface are its greatest waves, each taken alone; the waves of a surface "
            "act together: compare decides about the whole surface"
        )
    return tuple(sentences)
