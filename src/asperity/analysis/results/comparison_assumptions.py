"""The assumptions of a comparison, in sentences."""

from __future__ import annotations

from collections.abc import Mapping, Sequence

from asperity.analysis import surface_sentences
from asperity.analysis.limits import perceptibility_sentences
from asperity.analysis.limits.limit_rules import DEFAULT_SPEED
from asperity.analysis.passivity.criteria import damping_assumption
from asperity.analysis.results.recommendation import LawRow, simulated_loops_text
from asperity.core.units import format_quantity
from asperity.devices import Device
from asperity.perception.grip import Grip
from asperity.rendering import rendering_sentences
from asperity.textures.texture import TexturePart


def comparison_assumptions(
    rows: Sequence[LawRow],
    part: TexturePart,
    device: Device,
    grip: Grip,
    defaults: Mapping[str, bool],
) -> tuple[str, ...]:
    """Return the assumptions of a comparison, in sentences.

    Args:
        rows: the laws compared.
        part: the part of the surface that is texture.
        device: the device.
        grip: the hand.
        defaults: whether max_depth and speed are defaults.
    """
    first = rows[0].surface
    assessed = [row.perceptibility for row in rows if row.perceptibility is not None]
    # Laws differ in their waves, and the wall has none: one extrapolated law is enough to report.
    texture = max(assessed, key=lambda one: one.extrapolated, default=None)
    rendered = [text for row in rows for text in rendering_sentences(row.surface)]
    searched = [row.rendering.sentence(row.law) for row in rows]
    steps = dict.fromkeys((*first.texture.preparation, *rendered))
    sentences = [*steps, *filter(None, searched), *_default_sentences(rows, defaults)]
    sentences += perceptibility_sentences.form_removal_sentences(texture, part.form, part.waviness)
    sentences += _wall_assumptions(rows, device)
    sentences += _margin_assumptions(rows)
    unverified = [
        field.replace("_", " ")
        for field, datum in device.data.items()
        if not datum.verified and field != "max_stiffness"
    ]
    if unverified:
        sentences.append(f"Not verified for the {device.name}: {', '.join(unverified)}")
    if texture is not None:
        sentences += perceptibility_sentences.perceptibility_assumptions(texture, device, grip)
    if any("sampled" in (row.q.method, row.one_sided.method) for row in rows):
        sentences.append(
            "Numbers marked sampled are the greatest found over "
            f"{first.texture.domain.description} and depths to "
            f"{format_quantity(first.max_depth, 'm')}, not bounds"
        )
    sentences.append(
        "The leak is the work of the field on one slow traversal of its worst loop, without "
        "delay, quantisation and friction of the device"
    )
    return (*sentences, surface_sentences.SCOPE_SENTENCE)


def _margin_assumptions(rows: Sequence[LawRow]) -> list[str]:
    """Return the basis of the safety margins."""
    # A user-defined law borrows the margin of a shipped one, which may be compared too.
    margins = {row.margin.law: row.margin for row in rows if row.margin.loops}
    if not margins:
        return []
    listed = "; ".join(
        f"{law} {one.factor:g}: {simulated_loops_text(one)}" for law, one in margins.items()
    )
    return [
        f"Safety margins from simulation ({listed}): random loops in which a smooth wall of K₀ is "
        "just passive, over masses, damping per direction, grips up to 500 N/m, delays of 0 to 6 "
        "samples and places on random profiles; not this surface on this device"
    ]


def _wall_assumptions(rows: Sequence[LawRow], device: Device) -> list[str]:
    """Return the source of K₀, and the assumptions of using it as a limit."""
    test = device.wall_test
    if test is None:
        return []
    sentences = [f"K₀ = {test.value:g} N/m for the {device.name} ({test.pedigree}): {test.source}"]
    if any(row.stability_limit.basis == "plausible" for row in rows):
        sentences.append(
            "Plausible, not proved. Assumed: the wall of stiffness K₀ was close to its stability "
            f"limit (heavy handle, loose grip); {damping_assumption(test)}"
        )
    return sentences


def _default_sentences(rows: Sequence[LawRow], defaults: Mapping[str, bool]) -> list[str]:
    sentences = []
    if defaults["speed"]:
        speed = perceptibility_sentences.speed_text(DEFAULT_SPEED)
        sentences.append(f"Default scanning speed {speed}")
    if defaults["max_depth"]:
        sentences.append(surface_sentences.default_depth_text(rows[0].surface))
    return sentences + [
        f"{parameter} for law {row.law.letter}"
        for row in rows
        for parameter in surface_sentences.law_parameter_sentences(row.surface)
    ]
