"""The main job: the paper's Table II for your surface on your device."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.energy.merit import merit
from asperity.analysis.gain.answers import content_but_stiffness
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.analysis.judge_passivity import passivity
from asperity.analysis.limits.felt import DEFAULT_SPEED, texture_alone, texture_felt
from asperity.analysis.limits.spectrum import spectrum
from asperity.analysis.limits.wave_force import wave_forces
from asperity.analysis.passivity.margin import at_start, start
from asperity.analysis.recommendation import recommend
from asperity.analysis.row import LawRow
from asperity.analysis.words.comparison import assumptions, recommendation, verdict
from asperity.arguments import DEFAULT_STIFFNESS
from asperity.checks import positive
from asperity.devices import Device, load_device
from asperity.display import Plotted, Reported
from asperity.errors import ParameterError
from asperity.files import plain, record
from asperity.laws import LAWS, Law, find_laws, shared_out
from asperity.processes import helped
from asperity.surface import Surface
from asperity.textures.naming import TextureLike, as_texture
from asperity.textures.texture import Texture, TexturePart

SCHEMA = 1
DEFAULT_DEVICE = "omega.3"
ALL_LAWS = "".join(LAWS)

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Comparison(Plotted, Reported):
    """The laws compared on one surface and one device.

    Attributes:
        texture: the texture.
        device: the device.
        stiffness: the stiffness that was asked for [N/m]; ``None`` if each law was taken at its
            own, the one to begin with.
        max_depth: the depth to which the surface is pressed [m].
        speed: of the scan on which the texture is to be felt [m/s].
        rows: one per law, in the order asked for.
        recommended_row: of the recommended law; ``None`` if none can be recommended.
        nearest_row: where nothing is felt, of the law that comes nearest to it; else ``None``.
        recommendation: the recommendation with its reason, in words.
        assumptions: what was assumed, in sentences: defaults, unverified device data, the steps
            of preparing the surface, regions and resolutions of sampling.
    """

    texture: Texture
    device: Device
    stiffness: float | None
    max_depth: float
    speed: float
    rows: tuple[LawRow, ...]
    recommended_row: LawRow | None
    nearest_row: LawRow | None
    recommendation: str
    assumptions: tuple[str, ...]

    @property
    def recommended(self) -> str:
        """Letter of the recommended law; empty if none can be recommended."""
        return "" if self.recommended_row is None else self.recommended_row.law.letter

    def row(self, letter: str) -> LawRow:
        """Return the row of a law by its letter.

        Raises:
            KeyError: if the law was not compared.
        """
        return {row.law.letter: row for row in self.rows}[letter]

    def __repr__(self) -> str:
        row = self.recommended_row
        said = "none recommended" if row is None else f"{row!r} recommended"
        return f"<Comparison of {len(self.rows)} laws on {self.device.id}: {said}>"

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        return {
            "schema": SCHEMA,
            "texture": self.texture.describe(),
            **record(self, "device", "stiffness", "max_depth", "speed"),
            "laws": plain(self.rows),
            **record(self, "recommended", "recommendation", "assumptions"),
        }


def compare(
    texture: TextureLike,
    device: str | os.PathLike[str] | Device = DEFAULT_DEVICE,
    laws: str | Sequence[str | Law] = ALL_LAWS,
    stiffness: float | None = None,
    max_depth: float | None = None,
    *,
    speed: float | None = None,
    progress: Progress | None = None,
    law_parameters: Mapping[str, float] | None = None,
    **surface_arguments: Any,
) -> Comparison:
    """Return which laws render a surface on a device, at which stiffness, and what goes wrong.

    For every law: q and q⁺, up to which stiffness the device may render it and how well that is
    known (:func:`~asperity.analysis.judge_passivity.passivity`), whether the field is conservative
    and what its worst loop gains, whether the force is continuous, strength and support, and a
    verdict. First of all: whether its texture is felt, at the stiffness to begin with
    (:func:`~asperity.analysis.limits.felt.texture_felt`).

    Args:
        texture: the surface, or what names it on the command line: "sandpaper:grit=P60", "cloth",
            the path of a measured file; see :func:`~asperity.textures.naming.as_texture`.
        device: id of the catalogue, TOML file, or a :class:`~asperity.devices.Device`.
        laws: letters or names, or laws of your own.
        stiffness: the stiffness that you ask about [N/m]; by default each law's own, the one to
            begin with on this device.
        max_depth: the depth to which the surface is pressed [m]; by default its peak-to-valley
            height, at most 1 mm.
        speed: of the scan on which the texture is to be felt [m/s]; 0.1 by default.
        progress: called with the letter of each law before it is analysed.
        law_parameters: values of laws' parameters by name; each goes to the laws that declare it.
        **surface_arguments: further arguments of :class:`~asperity.surface.Surface`.

    Raises:
        ParameterError: for a value that cannot be used, or a parameter that none of the laws
            declares; it names the argument.

    Example:
        >>> result = compare("sinusoid:amplitude=0.8mm,period=1mm", laws="WA")
        >>> [f"{row.law.letter} {row.safe_stiffness:.0f} N/m" for row in result.rows]
        ['W 5000 N/m', 'A 976 N/m']
    """
    chosen = find_laws(list(laws) if not isinstance(laws, str) else laws)
    known_device = load_device(device)
    asked = None if stiffness is None else positive("stiffness", stiffness, "N/m")
    brisk = DEFAULT_SPEED if speed is None else positive("speed", speed, "m/s")
    _refuse_unknown(known_device)
    shares = shared_out(law_parameters or {}, chosen)
    made = as_texture(texture)
    surfaces = [
        Surface(made, law, asked or DEFAULT_STIFFNESS, max_depth, law_parameters=own,
                **surface_arguments)
        for law, own in zip(chosen, shares, strict=True)
    ]  # fmt: skip
    question = _Question(known_device, asked, brisk, made.texture_part(), max_depth is not None)
    rows = []
    with helped(answer_ahead, _tasks(surfaces, question)) as turns:
        for surface, _ in zip(surfaces, turns, strict=True):
            if progress is not None:
                progress(surface.law.letter)
            rows.append(_row(surface, question))
    found = recommend(rows)
    defaults = {"max_depth": max_depth is None, "speed": speed is None}
    return Comparison(
        texture=made,
        device=known_device,
        stiffness=asked,
        max_depth=surfaces[0].max_depth,
        speed=brisk,
        rows=tuple(rows),
        recommended_row=found.row,
        nearest_row=found.nearest,
        recommendation=recommendation(found, known_device),
        assumptions=assumptions(rows, question.part, known_device, defaults),
    )


def line_to_add(device: Device) -> str:
    """Return the line that a device's file lacks to compare laws on it; empty if it lacks none.

    Example:
        >>> line_to_add(load_device("touch")), line_to_add(load_device("2diy"))
        ('', 'max_stiffness = "... N/m"')
    """
    proof = ("damping", "update_rate", "delay_samples")
    proved = all(device.value(field) is not None for field in proof)
    return "" if device.wall_test is not None or proved else 'max_stiffness = "... N/m"'


def law_to_ask_about(
    texture: TextureLike,
    device: str | os.PathLike[str] | Device = DEFAULT_DEVICE,
    max_depth: float | None = None,
    **arguments: Any,
) -> Law:
    """Return the law that a comparison recommends; where nothing is felt, the one that is nearest.

    Args:
        texture: the surface.
        device: see :func:`compare`.
        max_depth: see :func:`compare`.
        **arguments: further ones of :func:`compare`.

    Raises:
        ParameterError: where no law is better than another, since none is known to do.
    """
    found = compare(texture, device, max_depth=max_depth, **arguments)
    row = found.recommended_row or found.nearest_row
    if row is None:
        raise ParameterError(
            "law", f"is missing, and none can be recommended: {found.recommendation}"
        )
    return row.law


@dataclass(frozen=True)
class _Question:
    """What is asked of every law."""

    device: Device
    stiffness: float | None
    speed: float
    part: TexturePart
    deep: bool


def _refuse_unknown(device: Device) -> None:
    """Refuse a device of which no stiffness of any law could follow."""
    if line := line_to_add(device):
        others = "damping, update_rate and delay_samples"
        needs = f"needs max_stiffness to compare laws: add {line}, the stiffest smooth wall"
        raise ParameterError("device", f"{device.id} {needs} that held, to its file; or {others}")


def _tasks(surfaces: Sequence[Surface], question: _Question) -> list[tuple[Surface, bool] | None]:
    """Return what can be answered ahead, law by law: what is kept."""
    return [
        None if content_but_stiffness(surface) is None else (surface, question.deep)
        for surface in surfaces
    ]


def answer_ahead(task: tuple[Surface, bool] | None) -> None:
    """Work out, and keep, what of a row costs time: all that does not depend on the device."""
    if task is None:
        return
    surface, deep = task
    q = characteristic_number(surface)
    one_sided_number(surface)
    merit(surface)
    worst_loop(surface)
    continuity(surface, q)
    part = surface.texture.texture_part()
    alone = texture_alone(surface, part, deep=deep)
    merit(alone)
    wave_forces(alone, spectrum(part.texture))


def _row(surface: Surface, question: _Question) -> LawRow:
    device = question.device
    q, one_sided = characteristic_number(surface), one_sided_number(surface)
    begin = start(surface, device, q, one_sided)
    if question.stiffness is None:
        surface = at_start(surface, device, begin)
    facts = surface.facts
    scan, leak = merit(surface), worst_loop(surface)
    smooth = continuity(surface, q)
    felt = None
    if begin.stiffness:
        felt = texture_felt(
            surface.to_stiffness(begin.stiffness), device, question.part,
            rms=scan.ripple * begin.stiffness, speed=question.speed, deep=question.deep,
        )  # fmt: skip
    row = LawRow(
        surface=surface,
        q=q,
        one_sided=one_sided,
        passivity=passivity(surface, device, q, one_sided, leak),
        margin=begin.margin,
        start=begin.stiffness,
        felt=felt,
        conservative=facts.conservative,
        conservative_reason=facts.reason,
        leak=leak,
        continuous=smooth.continuous,
        continuous_reason=smooth.reason,
        strength=scan.strength,
        support=scan.support,
        contact_lost=scan.contact_lost,
        ripple=scan.ripple,
        verdict="",
    )
    return replace(row, verdict=verdict(row))
