"""Comparison of the laws on one surface and one device: the paper's Table II."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Any

from asperity.analysis.gain.surface_cache import is_shipped_law, surface_content
from asperity.analysis.limits.limit_rules import DEFAULT_SPEED
from asperity.analysis.limits.perceptibility import Tier
from asperity.analysis.passivity.recommended_stiffness import RISKS
from asperity.analysis.results.comparison_rows import (
    ComparisonQuery,
    Task,
    precompute_row,
    render_row,
)
from asperity.analysis.results.recommendation import (
    LawRow,
    nearest_to_felt,
    recommend,
    textured_rows,
)
from asperity.core.arguments import DEFAULT_STIFFNESS, FIELD
from asperity.core.checks import check_keywords, check_positive
from asperity.core.display import Plottable, Reportable, Tabular, Text
from asperity.core.errors import ParameterError
from asperity.core.files import attributes_to_dict, content_digest, json_text, to_plain_data
from asperity.core.processes import precompute
from asperity.devices import Device, DeviceLike, load_device
from asperity.laws import LAWS, Law, distribute_parameters, find_laws
from asperity.perception.grip import DEFAULT_GRIP, Grip, load_grip
from asperity.surface import SURFACE_KEYWORDS, Surface
from asperity.textures.catalogue import TextureLike, as_texture
from asperity.textures.texture import Texture

SCHEMA = 4
DEFAULT_DEVICE = "omega.3"
ALL_LAWS = "".join(LAWS)

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Comparison(Plottable, Reportable, Tabular):
    """The laws compared on one surface and one device.

    Attributes:
        texture: the texture.
        device: the device.
        stiffness: the given stiffness [N/m]; ``None`` if each law is taken at its recommended
            stiffness.
        max_depth: depth to which the surface is pressed [m].
        press: mean normal force of the hand that chose ``max_depth`` of each law [N]; ``None`` if
            it was not given, see :attr:`LawRow.press`.
        speed: speed of the scan for which perceptibility is assessed [m/s].
        grip: the hand that holds the device.
        risk: share of random loops that may cycle at the recommended stiffnesses.
        rows: one per law, in the given order.
        recommended_row: row of the recommended law; ``None`` if none can be recommended.
        nearest_row: where no texture is felt, row of the law that comes nearest; else ``None``.
        defaults: names of the arguments that were not given.
    """

    texture: Texture
    device: Device
    stiffness: float | None
    max_depth: float
    press: float | None
    speed: float
    grip: Grip
    risk: float
    rows: tuple[LawRow, ...]
    recommended_row: LawRow | None
    nearest_row: LawRow | None
    defaults: tuple[str, ...]
    recommendation = Text[str]("Law, stiffness, what is felt, and what to watch: two sentences.")
    reasons = Text[tuple[str, ...]]("Why this law at this stiffness, and what else to watch.")
    assumptions = Text[tuple[str, ...]](
        "Assumptions, in sentences: defaults, unverified device data, the preparation steps of the "
        "surface, regions and resolutions of sampling."
    )

    @property
    def textured_rows(self) -> list[LawRow]:
        """Rows of the laws with a texture and a known stable stiffness."""
        return textured_rows(self.rows)

    @property
    def recommended(self) -> str:
        """Letter of the recommended law; empty if none can be recommended."""
        if self.recommended_row is None:
            return ""
        return self.recommended_row.law.letter

    @cached_property
    def content_digest(self) -> str | None:
        """Digest of the numbers, the texture and the laws; ``None`` if a law is user-defined."""
        contents = [surface_content(row.surface) for row in self.rows]
        if None in contents:
            return None
        return content_digest(json_text(self), self.texture.filled_mask, tuple(contents))

    @property
    def tier(self) -> Tier | None:
        """Tier of the recommended law, or of the one that comes nearest to it."""
        row = self.recommended_row or self.nearest_row
        if row is None:
            return None
        return row.tier

    def row(self, letter: str) -> LawRow:
        """Return the row of a law by its letter.

        Raises:
            KeyError: if the law was not compared.
        """
        return {row.law.letter: row for row in self.rows}[letter]

    __getitem__ = row

    def __repr__(self) -> str:
        outcome = self.recommended_row or "none"
        return f"<Comparison of {len(self.rows)} laws on {self.device.id}: {outcome} recommended>"

    def table_rows(self) -> list[dict[str, Any]]:
        """Return device, depth, speed and the main numbers of each law; SI units."""
        case = {"device": self.device.id, "depth [m]": self.max_depth, "speed [m/s]": self.speed}
        return [case | row.table_row() for row in self.rows]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        return {
            "schema": SCHEMA,
            "texture": self.texture.describe(),
            **attributes_to_dict(self, "device", "stiffness", "max_depth", "press"),
            **attributes_to_dict(self, "speed", "grip", "risk"),
            "laws": to_plain_data(self.rows),
            **attributes_to_dict(self, "recommended", "recommendation", "reasons", "assumptions"),
        }


def compare(
    texture: TextureLike,
    device: DeviceLike = DEFAULT_DEVICE,
    laws: str | Sequence[str | Law] = ALL_LAWS,
    stiffness: float | None = None,
    max_depth: float | None = None,
    *,
    speed: float | None = None,
    progress: Progress | None = None,
    on_row: Callable[[Comparison], None] | None = None,
    law_parameters: Mapping[str, float] | None = None,
    rendering: str = FIELD,
    grip: str | os.PathLike[str] | Grip = DEFAULT_GRIP,
    risk: str = "1%",
    press: float | None = None,
    **surface_arguments: Any,
) -> Comparison:
    """Compare laws on a surface and a device: stability, perceptibility and artefacts.

    For every law: the perceptibility of its texture
    (:func:`~asperity.analysis.limits.perceptibility.assess_perceptibility`); q and q⁺; the
    stability limit and its basis
    (:func:`~asperity.analysis.passivity.verdict.passivity`); whether the field is
    conservative, and the energy gained on its worst loop; whether the force is continuous;
    strength and support; and a verdict. All numbers of a law are those of one stiffness.

    Args:
        texture: the surface, or what names it on the command line: "sandpaper:grit=P60", "cloth",
            the path of a measured file; see :func:`~asperity.textures.catalogue.as_texture`.
        device: id of the catalogue, TOML file, or a :class:`~asperity.devices.Device`; several:
            :func:`~asperity.analysis.results.device_comparisons.compare_devices`.
        laws: letters or names, or user-defined laws.
        stiffness: stiffness of all laws [N/m]; by default the recommended stiffness of each law
            on this device.
        max_depth: depth to which the surface is pressed [m]; by default its peak-to-valley
            height, at most 1 mm.
        speed: speed of the scan for which perceptibility is assessed [m/s]; 0.1 by default.
        progress: called with the letter of each law before it is analysed.
        on_row: called after each law with the comparison of the laws that are ready.
        law_parameters: parameters of laws by name; each goes to the laws that declare it.
        rendering: how law H is rendered: ``"field"`` or ``"search"``; see
            :func:`~asperity.rendering.rendered_surface`.
        grip: the hand that holds the device: an id, a TOML file, or a
            :class:`~asperity.perception.grip.Grip`.
        risk: ``"1%"`` or ``"5%"``: how many random loops may cycle at the recommended stiffness
            (docs/theory/passivity.md).
        press: mean normal force of the hand [N], in place of ``max_depth``: each law is analysed
            down to the depth that it reaches, at the stiffest start that holds down to there.
        **surface_arguments: further arguments of :class:`~asperity.surface.Surface`.

    Raises:
        ParameterError: for a value that cannot be used, or a parameter that none of the laws
            declares; it names the argument.

    Example:
        >>> result = compare("sinusoid:amplitude=0.8mm,period=1mm", laws="WA")
        >>> [f"{row.law.letter} {row.stability_limit.stiffness:.0f} N/m" for row in result.rows]
        ['W 5000 N/m', 'A 976 N/m']
    """
    if "devices" in surface_arguments or isinstance(device, (list, tuple)):
        raise ParameterError("device", "must be one: asp.compare_devices compares several")
    check_keywords(surface_arguments, SURFACE_KEYWORDS - {"law"}, compare)
    texture = as_texture(texture)
    query = _make_query(texture, device, stiffness, max_depth, speed, rendering, grip, risk, press)
    surface_arguments |= {"stiffness": query.stiffness or DEFAULT_STIFFNESS, "max_depth": max_depth}
    compared = _compared_laws(texture, laws)
    parameters = distribute_parameters(law_parameters or {}, compared)
    surfaces = [
        Surface(texture, law, law_parameters=own, **surface_arguments)
        for law, own in zip(compared, parameters, strict=True)
    ]
    arguments = {"max_depth": max_depth, "speed": speed}
    defaults = tuple([name for name, value in arguments.items() if value is None])
    rows: list[LawRow] = []
    with precompute(precompute_row, _precompute_tasks(surfaces, query)) as precomputed:
        for surface in surfaces:
            if progress is not None:
                progress(surface.law.letter)
            next(precomputed)
            rows.append(render_row(surface, query))
            if on_row is not None:
                on_row(_make_comparison(texture, surfaces[0].max_depth, query, rows, defaults))
    return _make_comparison(texture, surfaces[0].max_depth, query, rows, defaults)


def _make_comparison(
    texture: Texture,
    max_depth: float,
    query: ComparisonQuery,
    rows: Sequence[LawRow],
    defaults: tuple[str, ...],
) -> Comparison:
    """Return the comparison of rows, with the recommended one."""
    recommended = recommend(rows)
    nearest = nearest_to_felt(rows) if recommended is None else None
    return Comparison(
        texture=texture,
        device=query.device,
        stiffness=query.stiffness,
        max_depth=max_depth,
        press=query.press,
        speed=query.speed,
        grip=query.grip,
        risk=query.risk,
        rows=tuple(rows),
        recommended_row=recommended,
        nearest_row=nearest,
        defaults=defaults,
    )


def _compared_laws(texture: Texture, laws: str | Sequence[str | Law]) -> tuple[Law, ...]:
    """Return the laws; where all are compared on a baked field, those that have one."""
    chosen = find_laws(laws)
    if texture.baked_numbers and len(chosen) >= len(ALL_LAWS):
        return tuple([law for law in chosen if law.contact.has_potential_field])
    return chosen


def lacks_data(device: Device) -> bool:
    """Return whether a device has too little data to compare laws on it.

    A comparison needs the stiffest smooth wall that held, max_stiffness, or damping, update rate
    and delay, which prove a limit.

    Example:
        >>> lacks_data(load_device("touch")), lacks_data(load_device("2diy"))
        (False, True)
    """
    fields = ("damping", "update_rate", "delay_samples")
    is_provable = all(device.value(field) is not None for field in fields)
    return device.wall_test is None and not is_provable


def recommended_law(
    texture: TextureLike,
    device: DeviceLike = DEFAULT_DEVICE,
    max_depth: float | None = None,
    **arguments: Any,
) -> Law:
    """Return the law recommended by a comparison; where no texture is felt, the nearest to it.

    Args:
        texture: the surface.
        device: see :func:`compare`.
        max_depth: see :func:`compare`.
        **arguments: further arguments of :func:`compare`.

    Raises:
        ParameterError: if no law has a known stable stiffness.
    """
    result = compare(texture, device, max_depth=max_depth, **arguments)
    row = result.recommended_row or result.nearest_row
    if row is None:
        reason = f"is missing, and none can be recommended: {result.recommendation}"
        raise ParameterError("law", reason)
    return row.law


def _make_query(
    texture: Texture,
    device: DeviceLike,
    stiffness: float | None,
    max_depth: float | None,
    speed: float | None,
    rendering: str,
    grip: str | os.PathLike[str] | Grip,
    risk: str,
    press: float | None,
) -> ComparisonQuery:
    """Return the conditions from arguments of :func:`compare`, checked."""
    loaded = load_device(device)
    if stiffness is not None:
        stiffness = check_positive("stiffness", stiffness, "N/m")
    if speed is not None:
        speed = check_positive("speed", speed, "m/s")
    if press is not None:
        press = check_positive("press", press, "N")
        if max_depth is not None:
            raise ParameterError(
                "press", "chooses the depth: leave {max_depth} out", max_depth=None
            )
    if risk not in RISKS:
        raise ParameterError("risk", f"must be {' or '.join(RISKS)}", risk)
    if lacks_data(loaded):
        raise ParameterError(
            "device",
            f'{loaded.id} needs max_stiffness to compare laws: add max_stiffness = "... N/m", the '
            "stiffest smooth wall that held, to its file; or damping, update_rate and "
            "delay_samples",
        )
    return ComparisonQuery(
        device=loaded,
        stiffness=stiffness,
        speed=DEFAULT_SPEED if speed is None else speed,
        part=texture.texture_part(),
        explicit_depth=max_depth is not None or press is not None,
        rendering=rendering,
        grip=load_grip(grip),
        risk=RISKS[risk],
        press=press,
    )


def _precompute_tasks(surfaces: Sequence[Surface], query: ComparisonQuery) -> list[Task | None]:
    """Return one task per law; ``None`` for a law whose results are not shared by the cache."""
    tasks: list[Task | None] = []
    for surface in surfaces:
        is_shared = is_shipped_law(surface.law) and surface_content(surface) is not None
        tasks.append((surface, query) if is_shared else None)
    return tasks
