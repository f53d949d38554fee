"""The row of each law in a comparison, and the law that is recommended among them."""

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.continuity import Continuity
from asperity.analysis.energy.leak import Leak
from asperity.analysis.limits.perceptibility import Perceptibility, Tier
from asperity.analysis.limits.perceptibility_sentences import (
    force_magnitude_text,
    masking_text,
    remedies_text,
    texture_amount_text,
    unverified_text,
)
from asperity.analysis.passivity.assess_passivity import (
    Passivity,
    buzz_text,
    delay_clause,
    delivery_text,
    stability_limit_text,
    stiffness_limit_text,
)
from asperity.analysis.passivity.criteria import buzz_goal
from asperity.analysis.passivity.verdict import Margin, StabilityLimit, load_margins
from asperity.analysis.surface_sentences import leak_energy_text
from asperity.core.files import attributes_to_dict, to_plain_data
from asperity.core.units import format_quantity, round_down, round_up
from asperity.devices import Device
from asperity.laws import Law
from asperity.rendering import Rendering
from asperity.surface import Surface


@dataclass(frozen=True)
class LawRow:
    """Results of one law on the surface.

    Attributes:
        surface: the surface with this law at the given stiffness; by default at
            ``recommended_stiffness``, or at the smooth wall's K₀ if no stable stiffness is known.
        q: characteristic number.
        one_sided: one-sided number q⁺.
        passivity: verdict and stability limit on the device; the same as in an
            :class:`~asperity.analysis.Analysis`.
        margin: safety margin below the stability limit.
        recommended_stiffness: margin times stability limit [N/m]; 0 if no stable stiffness is
            known.
        perceptibility: perceptibility at the stiffness of ``surface``; ``None`` where none was
            given and no stable one is known.
        conservative: whether the work around every closed path is zero.
        conservative_reason: one sentence.
        leak: the worst simple loop at the stiffness of ``surface``.
        continuity: whether the force is continuous, and why.
        strength: T, RMS of the oscillating force over sup‖J‖ · l [1]; times l [m] if the surface
            has no period.
        support: S, slope of the mean normal force over sup‖J‖ [1].
        contact_lost: fraction of the scan without contact.
        ripple: RMS of the oscillating force per stiffness [m].
        rendering: how a loop renders the law.
    """

    surface: Surface
    q: Bound
    one_sided: Bound
    passivity: Passivity
    margin: Margin
    recommended_stiffness: float
    perceptibility: Perceptibility | None
    conservative: bool
    conservative_reason: str
    leak: Leak
    continuity: Continuity
    strength: float
    support: float
    contact_lost: float
    ripple: float
    rendering: Rendering

    def __repr__(self) -> str:
        start = f"start at {self.recommended_stiffness:g} N/m"
        return f"<LawRow {self.law.letter}: {start}, {self.tier or 'none known'}>"

    @property
    def law(self) -> Law:
        """The law of this row."""
        return self.surface.law

    @property
    def continuous(self) -> bool:
        """Whether the force is continuous."""
        return self.continuity.continuous

    @property
    def continuous_reason(self) -> str:
        """Why the force is continuous, or not, in one sentence."""
        return self.continuity.reason

    @property
    def stability_limit(self) -> StabilityLimit:
        """Stability limit of the stiffness, and its basis."""
        return self.passivity.stability_limit

    @property
    def texture_force(self) -> float:
        """RMS of the oscillating force [N]; 0 where no stiffness was given and none is known."""
        return 0.0 if self.perceptibility is None else self.ripple * self.surface.stiffness

    @property
    def tier(self) -> Tier | None:
        """Perceptibility tier; ``None`` where no stiffness was given and none is known."""
        return None if self.perceptibility is None else self.perceptibility.tier

    @property
    def resolved_force(self) -> float:
        """RMS of the resolved texture force [N]."""
        return 0.0 if self.perceptibility is None else self.perceptibility.resolved_rms

    @property
    def may_buzz(self) -> bool:
        """Whether the law may buzz: the stiffness of ``surface`` is above the stability limit."""
        return (self.stability_limit.stiffness or 0.0) < self.surface.stiffness

    @property
    def is_textureless(self) -> bool:
        """Whether the law renders no texture."""
        return self.ripple == 0.0

    @property
    def loses_contact(self) -> bool:
        """Whether contact is lost on a part of the scan."""
        return self.contact_lost > 0.0 and self.law.contact.begins_on_texture

    @property
    def verdict(self) -> str:
        """Limit of a law that is quiet, and the artefacts to expect, in one line."""
        quiet = self.conservative and not self._instability
        return "; ".join([*([_passivity_text(self)] if quiet else ()), *self.artefacts])

    @property
    def _instability(self) -> str:
        """How the law may be unstable at its stiffness; empty if nothing is known of it."""
        k = stiffness_limit_text(self.surface.stiffness)
        stability = stability_limit_text(self.stability_limit, self.passivity.loop)
        if self.passivity.verdict == "not passive" and self.conservative:
            return f"not passive at {k}; {stability}"
        if not self.recommended_stiffness:
            return stability
        limit = f"; {stability}" if self.conservative else ""
        return f"may buzz at {k}{limit}" if self.may_buzz else ""

    @cached_property
    def artefacts(self) -> list[str]:
        """Artefacts to expect from the law, each in a few words."""
        parts = [self._instability] if self._instability else []
        if not self.conservative:
            gain = f"feels alive: gains up to {leak_energy_text(self.leak)}"
            parts.append(f"{gain}; {delivery_text(self.passivity.loop)}")
        if not self.continuous:
            parts.append("clicks: " + self.continuous_reason)
        if self.is_textureless:
            parts.append("no texture")
        elif self.perceptibility is not None and self.tier != "felt":
            parts.append(f"{self.tier}: {texture_amount_text(self.perceptibility)}")
        if self.rendering.truncated:
            part = 100.0 * self.rendering.truncated / self.rendering.samples
            parts.append(f"search truncated in {part:.2g} % of samples")
        if self.loses_contact:
            parts.append(f"no contact on {100.0 * self.contact_lost:.0f} % of the scan")
        return parts

    def table_row(self) -> dict[str, Any]:
        """Return the main numbers by name and unit; ``None`` where one is unknown."""
        felt = self.perceptibility
        return {
            "law": self.law.letter,
            "recommended stiffness [N/m]": self.recommended_stiffness or None,
            "stiffness [N/m]": self.surface.stiffness,
            "stability limit [N/m]": self.stability_limit.stiffness,
            "passivity": self.passivity.verdict,
            "q": self.q.value,
            "q method": self.q.method,
            "one-sided q": self.one_sided.value,
            "tier": self.tier,
            "texture force RMS [N]": None if felt is None else self.texture_force,
            "resolved force RMS [N]": None if felt is None else self.resolved_force,
            "conservative": self.conservative,
            "leak [J]": self.leak.energy,
            "continuous": self.continuous,
            "ripple [m]": self.ripple,
            "support": self.support,
            "verdict": self.verdict,
        }

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units."""
        before = "q one_sided stability_limit margin recommended_stiffness"
        after = (
            "conservative conservative_reason leak continuous continuous_reason strength support "
            "contact_lost texture_force rendering verdict"
        )
        return {
            "law": self.law.letter,
            "name": self.law.name,
            "law_parameters": to_plain_data(self.surface.law_parameters),
            **attributes_to_dict(self, *before.split()),
            "stiffness": self.surface.stiffness,
            "perceptibility": to_plain_data(self.perceptibility),
            "passivity": self.passivity.verdict,
            **attributes_to_dict(self, *after.split()),
        }


def _passivity_text(row: LawRow) -> str:
    """Return the passivity of a conservative law at its stiffness."""
    passivity = row.passivity
    stiffness = stiffness_limit_text(row.surface.stiffness)
    if passivity.verdict == "bounded" and passivity.buzz is not None:
        return f"passive at {stiffness} but for steps: {buzz_text(passivity.buzz)}"
    if passivity.verdict == "plausible":
        return stability_limit_text(row.stability_limit, passivity.loop)
    return f"{passivity.verdict} at {stiffness}"


EQUAL_STRENGTH_RATIO = 0.8
"""Laws whose texture forces differ by less than a fifth count as equally strong."""


@dataclass(frozen=True)
class Recommendation:
    """The recommended law, and the laws it was chosen from.

    Attributes:
        row: row of the recommended law; ``None`` if no law has a texture that is felt.
        stiffness: the stiffness that was given for all laws [N/m]; ``None`` for that of each law.
        rows: rows of all laws compared.
        is_sound: whether the recommended law is conservative and continuous; else it leaks least.
        textured_rows: rows of the laws with a texture and a known stable stiffness.
        nearest: where no texture is felt, row of the law that comes nearest; else ``None``.
    """

    row: LawRow | None
    rows: tuple[LawRow, ...]
    is_sound: bool
    textured_rows: tuple[LawRow, ...]
    nearest: LawRow | None = None
    stiffness: float | None = None


def recommend(rows: Sequence[LawRow], stiffness: float | None = None) -> Recommendation:
    """Return the recommended law.

    A conservative and continuous law gains no energy on any closed path, and its force does not
    jump. Of such laws whose texture is felt (else: borderline), the one with the strongest texture
    at its recommended stiffness is chosen; of nearly equal ones the stiffest. Without such a law,
    the continuous law that is felt (else: borderline) and leaks least for its texture force is
    chosen. A law that is not felt, without a known stable stiffness, or with a stability limit
    below the given stiffness, is never recommended.

    Args:
        rows: the laws, with their numbers at the given stiffness or each at its recommended one.
        stiffness: the given stiffness [N/m].
    """
    textured = tuple(
        row
        for row in rows
        if row.perceptibility is not None and not row.is_textureless and not row.may_buzz
    )
    by_tier = [[row for row in textured if row.tier == tier] for tier in ("felt", "borderline")]
    for candidates in by_tier:
        if sound := _sound_rows(candidates):
            return Recommendation(
                _strongest(sound), tuple(rows), True, textured, stiffness=stiffness
            )
    for candidates in filter(None, by_tier):
        smooth = [row for row in candidates if row.continuous]
        best = min(smooth or candidates, key=_relative_leak)
        return Recommendation(best, tuple(rows), False, textured, stiffness=stiffness)
    # The row whose texture comes nearest to being felt, of sound laws if there are any.
    sound = _sound_rows(textured) or list(textured)
    nearest = max(sound, key=lambda row: row.resolved_force, default=None)
    return Recommendation(None, tuple(rows), False, textured, nearest, stiffness)


def _sound_rows(rows: Sequence[LawRow]) -> list[LawRow]:
    """Return the rows of conservative and continuous laws."""
    return [row for row in rows if row.conservative and row.continuous]


def _strongest(rows: Sequence[LawRow]) -> LawRow:
    """Return the strongest law; of nearly equal ones the stiffest with a single-valued contact."""
    strongest = max(row.resolved_force for row in rows)
    equal = [row for row in rows if row.resolved_force >= EQUAL_STRENGTH_RATIO * strongest]
    return max(equal, key=lambda row: (row.law.contact.single_valued, row.recommended_stiffness))


def _relative_leak(row: LawRow) -> float:
    """Return the leak over texture force times length [1]."""
    return row.leak.worst_per_period / (row.texture_force * row.leak.line.length)


def recommendation_text(recommended: Recommendation, device: Device) -> str:
    """Return the recommended law and stiffness, its perceptibility, and the reason."""
    best = recommended.row
    if best is None or best.perceptibility is None:
        return _no_recommendation_text(recommended, device)
    texture = best.perceptibility
    gives = f"{texture_amount_text(texture)}: {best.tier}"
    if best.tier != "felt":
        gives += f"; {masking_text(texture)}"
    sentences = [
        f"{_choice_text(best, recommended, device)}, which gives {gives}.",
        unverified_text(texture),
        remedies_text(texture),
        _form_advice(texture),
        _contact_loss_text(best),
        _size_text(best, device),
        _SOUND_REASON if recommended.is_sound else _least_leak_reason(best, recommended),
        _limit_basis_text(best, device),
        _trade_off_text(best, recommended),
        _saturation_warning(best, device),
    ]
    return " ".join(filter(None, sentences))


def _choice_text(row: LawRow, recommended: Recommendation, device: Device) -> str:
    """Return the recommended law and its stiffness."""
    law = _law_title(row)
    start = stiffness_limit_text(row.recommended_stiffness)
    if recommended.stiffness is None:
        return f"Use law {law} on the {device.name} and start at {start}"
    given = format_quantity(recommended.stiffness, "N/m")
    room = (
        f"recommended is a start at {start}" if row.recommended_stiffness else "no start is known"
    )
    return f"At {given} use law {law} on the {device.name} ({room})"


def _law_title(row: LawRow) -> str:
    return f"{row.law.letter} ({row.law.name.replace('-', ' ')})"


def _form_advice(texture: Perceptibility) -> str:
    """Return how to remove form and waviness, where they make up most of the force."""
    if not texture.is_mostly_form:
        return ""
    return "Most of it is form and waviness, felt as a shape: form=2 and l_cutoff remove it."


def _contact_loss_text(row: LawRow) -> str:
    if not row.loses_contact:
        return ""
    depth = format_quantity(row.surface.max_depth, "m")
    full_depth = format_quantity(round_up((1.0 - 1e-9) * row.surface.texture.peak_to_valley), "m")
    return (
        f"Pressed to {depth} it loses contact on {100.0 * row.contact_lost:.0f} % of the scan; "
        f"pressed to {full_depth} it keeps contact (max_depth)."
    )


def _size_text(row: LawRow, device: Device) -> str:
    """Return a warning where surface or period are larger than the workspace, and what fits."""
    domain = row.surface.texture.domain
    size = float(np.hypot(*domain.spans.T).max())
    room = device.workspace_size
    if size <= room or not (domain.periodic or row.surface.texture.is_mirrored):
        return ""
    length = format_quantity(size, "m")
    width = format_quantity(room, "m")
    factor = round_down(room / size, 2)
    whole = "A period" if domain.periodic else "The surface"
    return (
        f"{whole} is {length} long and the workspace {width}: only a part can be touched, "
        f"or all of it magnified {factor:g} times more."
    )


def _no_recommendation_text(recommended: Recommendation, device: Device) -> str:
    """Return why no law is recommended."""
    if all(row.is_textureless for row in recommended.rows):
        return "None of the laws compared renders a texture on this surface."
    row = recommended.nearest
    if row is None or row.perceptibility is None:
        if recommended.stiffness is not None:
            return _too_stiff_text(recommended, recommended.stiffness, device)
        return (
            f"No stable stiffness is known on the {device.name} for any of the laws compared: "
            "they need a known delay, or have no bound at this depth."
        )
    texture = row.perceptibility
    at = stiffness_limit_text(row.surface.stiffness)
    sentences = [
        f"Nothing of this texture will be felt on the {device.name}: law {_law_title(row)}, which "
        f"comes nearest, gives at {at} {texture_amount_text(texture)}; {masking_text(texture)}.",
        remedies_text(texture),
        _form_advice(texture),
        _contact_loss_text(row),
        _size_text(row, device),
    ]
    return " ".join(filter(None, sentences))


def _too_stiff_text(recommended: Recommendation, stiffness: float, device: Device) -> str:
    """Return that no law is stable at the given stiffness, with the law that may be stiffest."""
    row = max(recommended.rows, key=lambda row: row.recommended_stiffness)
    given = format_quantity(stiffness, "N/m")
    text = f"No law that renders this texture is known to be stable at {given} on the {device.name}"
    if not row.recommended_stiffness:
        return f"{text}."
    start = stiffness_limit_text(row.recommended_stiffness)
    return f"{text}; law {_law_title(row)} can start at {start}."


def _limit_basis_text(row: LawRow, device: Device) -> str:
    """Return the basis of the recommended stiffness, in a sentence."""
    limit = row.stability_limit
    at_most = stiffness_limit_text(limit.stiffness or 0.0)
    passivity = row.passivity
    if limit.basis == "proved":
        delay = device.value("delay_samples") or 0.0
        most = passivity.greatest_delay
        reach = f"{delay:.0f}" if most is None or most < delay else f"up to {most}"
        return f"It is proved passive up to {at_most}, at the start with {reach} samples of delay."
    if limit.basis == "bounded":
        text = "It is passive there but for the steps of positions and forces"
        if passivity.buzz is None:
            return f"{text}."
        bound = buzz_goal(device)
        goal = f"{format_quantity(bound, 'm/s')} for which starts are chosen"
        relation = "within" if passivity.buzz.speed <= bound else "more than"
        return f"{text}: {buzz_text(passivity.buzz)}, {relation} the {goal}."
    if limit.basis == "wall gain":
        delivers = delivery_text(passivity.loop)
        wall = _wall_text(device)
        return f"No stiffness is stable: its field {delivers}. {wall} {_margin_text(row)}"
    proved = "not proved"
    if limit.proved_stiffness:
        proved = f"proved only up to {stiffness_limit_text(limit.proved_stiffness)}"
    plausible = f"is therefore plausible{delay_clause(limit.delay)}, but {proved}"
    if limit.delay == math.inf:
        plausible += "; a longer delay than in that test lowers it"
    return (
        f"{_wall_text(device)} A limit of {at_most} for law {row.law.letter} {plausible}. "
        f"{_margin_text(row)}"
    )


def _wall_text(device: Device) -> str:
    """Return the stiffest wall known of the device, in a sentence."""
    test = device.wall_test
    if test is None:
        return "The stiffest stable wall of this device is unknown."
    stiffness = stiffness_limit_text(test.value)
    if test.pedigree == "measured":
        return f"A smooth wall of {stiffness} was stable on this device."
    return f"The stiffest wall known to be stable on this device is {stiffness}."


def _margin_text(row: LawRow) -> str:
    """Return the safety margin below the stability limit and its reason, in a sentence."""
    margin = row.margin
    if not margin.loops:
        return "The recommended stiffness equals this limit."
    start = "equals" if margin.factor == 1.0 else f"is {margin.factor:g} times"
    whole = "this limit" if row.conservative else "K₀/q, the gain of that wall"
    calibrated = next(o.factor for o in load_margins(True).values() if o.law == margin.law)
    text = f"The recommended stiffness {start} {whole}: there {simulated_loops_text(margin)}."
    if calibrated <= margin.factor:
        return text
    gain = f"{calibrated:g}: up to {calibrated / margin.factor:.2g} times stiffer"
    whose = "On a calibrated device, where a wall was tried along every axis, the factor is"
    return f"{text} {whose} {gain} (calibrate)."


def simulated_loops_text(margin: Margin) -> str:
    """Return how many random simulated loops cycle, and how large a motion."""
    text = f"{margin.cycles} of {margin.loops} random simulated loops cycle"
    if not margin.cycles:
        return text
    speed = format_quantity(margin.speed, "m/s", digits=2)
    return f"{text}, at up to {speed} RMS and {margin.frequency:.2g} Hz"


_SOUND_REASON = "No closed path of its field gives net energy, and its force does not jump."


def _least_leak_reason(best: LawRow, recommended: Recommendation) -> str:
    gain = format_quantity(best.leak.worst_per_period, "J")
    faint = [row for row in recommended.textured_rows if row.conservative and row.continuous]
    reason = "None of the laws compared is conservative, continuous and known to work here"
    if faint:
        rival = max(faint, key=lambda row: row.resolved_force)
        force = force_magnitude_text(rival.resolved_force)
        reason = (
            f"Law {rival.law.letter}, conservative and continuous, gives only {force} RMS at its "
            f"{stiffness_limit_text(rival.surface.stiffness)}, which is not felt"
        )
    return (
        f"{reason}; of the continuous laws this one leaks least for its texture force, "
        f"up to {gain} per loop, so it can feel alive."
    )


def _trade_off_text(best: LawRow, recommended: Recommendation) -> str:
    """Return the stiffness that the recommended law gives up against a stiffer one."""
    rows = recommended.textured_rows if recommended.stiffness is None else ()
    stiffer = [row for row in rows if row.recommended_stiffness > 1.5 * best.recommended_stiffness]
    if not stiffer:
        return ""
    rival = max(stiffer, key=lambda row: row.recommended_stiffness)
    drawbacks = []
    if not rival.conservative:
        gain = format_quantity(rival.leak.worst_per_period, "J")
        drawbacks.append(f"gains up to {gain} per loop there")
    if not rival.continuous:
        drawbacks.append("its force jumps")
    start = stiffness_limit_text(rival.recommended_stiffness)
    drawback = " and ".join(drawbacks) or "has less texture"
    return f"The price is stiffness: law {rival.law.letter} can start at {start}, but {drawback}."


def _saturation_warning(best: LawRow, device: Device) -> str:
    """Return a warning if the force at full depth exceeds the device's maximum force."""
    limit = device.value("max_force")
    force = best.surface.stiffness * best.surface.max_depth
    if limit is None or force <= limit:
        return ""
    depth = format_quantity(best.surface.max_depth, "m")
    needed = format_quantity(force, "N")
    available = format_quantity(limit, "N")
    return f"Pressed to {depth} it needs {needed}; the device gives {available}."
