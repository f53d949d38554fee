"""Comparison of the laws on one surface and one device: the paper's Table II."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from typing import Any

from asperity.analysis.bounds.bound import NORM, ONE_SIDED
from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.leak import find_leak
from asperity.analysis.energy.press import (
    depth_at_press,
    holds_at_any_press,
    mean_press,
    region_of_press,
)
from asperity.analysis.energy.straight_scan import merit as compute_merit
from asperity.analysis.gain.characteristic import cached_number
from asperity.analysis.gain.surface_cache import is_shipped_law, surface_content
from asperity.analysis.limits.limit_rules import DEFAULT_SPEED
from asperity.analysis.limits.perceptibility import Tier, assess_perceptibility
from asperity.analysis.passivity.device_loop import DeviceLoop, make_device_loop
from asperity.analysis.passivity.recommended_stiffness import RISKS, recommend_on_loop
from asperity.analysis.passivity.verdict import assess_loop
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
from asperity.core.units import round_down
from asperity.devices import Device, DeviceLike, load_device
from asperity.laws import LAWS, Law, distribute_parameters, find_laws
from asperity.perception.grip import DEFAULT_GRIP, Grip, load_grip
from asperity.rendering import assess_rendering, is_searched, rendered_surface
from asperity.surface import SURFACE_KEYWORDS, Surface
from asperity.textures.catalogue import TextureLike, as_texture
from asperity.textures.texture import Texture, TexturePart

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
    rows = []
    with precompute(precompute_row, _precompute_tasks(surfaces, query)) as precomputed:
        for surface, _ in zip(surfaces, precomputed, strict=True):
            if progress is not None:
                progress(surface.law.letter)
            rows.append(_render_row(surface, query))
    recommended = recommend(rows)
    nearest = nearest_to_felt(rows) if recommended is None else None
    arguments = {"max_depth": max_depth, "speed": speed}
    return Comparison(
        texture=texture,
        device=query.device,
        stiffness=query.stiffness,
        max_depth=surfaces[0].max_depth,
        press=query.press,
        speed=query.speed,
        grip=query.grip,
        risk=query.risk,
        rows=tuple(rows),
        recommended_row=recommended,
        nearest_row=nearest,
        defaults=tuple([name for name, value in arguments.items() if value is None]),
    )


def _compared_laws(texture: Texture, laws: str | Sequence[str | Law]) -> tuple[Law, ...]:
    """Return the laws; where all are compared on a baked field, those that have one."""
    found = find_laws(laws)
    if texture.baked_numbers and len(found) >= len(ALL_LAWS):
        return tuple([law for law in found if law.contact.has_potential_field])
    return found


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


@dataclass(frozen=True)
class _ComparisonQuery:
    """The conditions under which every law is analysed."""

    device: Device
    stiffness: float | None
    speed: float
    part: TexturePart
    explicit_depth: bool
    rendering: str
    grip: Grip
    risk: float
    press: float | None


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
) -> _ComparisonQuery:
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
    return _ComparisonQuery(
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


Task = tuple[Surface, _ComparisonQuery]


def _precompute_tasks(surfaces: Sequence[Surface], query: _ComparisonQuery) -> list[Task | None]:
    """Return one task per law; ``None`` for a law whose results are not shared by the cache."""
    tasks: list[Task | None] = []
    for surface in surfaces:
        is_shared = is_shipped_law(surface.law) and surface_content(surface) is not None
        tasks.append((surface, query) if is_shared else None)
    return tasks


def precompute_row(task: Task | None) -> None:
    """Compute a row in a worker process, which leaves its numbers in the cache."""
    if task is not None:
        _render_row(*task)


def _render_row(surface: Surface, query: _ComparisonQuery) -> LawRow:
    """Return the row of a law as a loop renders it."""
    greatest_press = None
    if query.press is not None:
        surface, greatest_press = _pressed_surface(surface, query, query.press)
    row = _compute_row(rendered_surface(surface, query.rendering), query)
    if greatest_press is None:
        return row
    none = replace(row.passivity.stability_limit, stiffness=0.0, basis="none")
    return replace(
        row,
        passivity=replace(row.passivity, stability_limit=none),
        recommended_stiffness=0.0,
        perceptibility=None,
        greatest_press=greatest_press,
    )


_PRESS_TOLERANCE = 1e-3
_FIELD_GAIN = 1.1  # of a baked law over the law itself, or less: one field is enough
_RENDERINGS = 4


def _pressed_surface(
    surface: Surface, query: _ComparisonQuery, press: float
) -> tuple[Surface, float | None]:
    """Return a surface for the depth of a press [N]; and the greatest press where none is enough.

    A field that is baked for a depth may have a greater gain, and a smaller start, than the law.
    """
    if query.stiffness is not None:
        stiff = surface.to_stiffness(query.stiffness)
        return surface.to_depth(depth_at_press(stiff, press)), None

    def start(trial: Surface) -> float:
        return recommend_on_loop(_device_loop(trial, query), query.risk).exact_stiffness

    depth, greatest = region_of_press(surface, press, start)
    if depth is None:
        return surface, greatest
    surface = surface.to_depth(depth)
    if is_searched(surface) and query.rendering == FIELD:
        soft = surface.to_stiffness(start(surface) / _FIELD_GAIN)
        surface = surface.to_depth(depth_at_press(soft, press))
    for _ in range(_RENDERINGS):
        stiffness = round_down(start(rendered_surface(surface, query.rendering)))
        stiff = surface.to_stiffness(stiffness)
        if mean_press(stiff) >= press * (1.0 - _PRESS_TOLERANCE):
            break
        surface = surface.to_depth(depth_at_press(stiff, press))
    return surface, None


def _device_loop(surface: Surface, query: _ComparisonQuery) -> DeviceLoop:
    q = cached_number(surface, NORM)
    return make_device_loop(surface, query.device, q, cached_number(surface, ONE_SIDED))


def _compute_row(surface: Surface, query: _ComparisonQuery) -> LawRow:
    device = query.device
    loop = _device_loop(surface, query)
    q = loop.q
    recommended = recommend_on_loop(loop, query.risk)
    if query.stiffness is None:
        surface = surface.to_stiffness(recommended.start)
    leak = find_leak(surface)
    merit = compute_merit(surface)
    perceptibility = None
    if query.stiffness or recommended.stiffness:
        perceptibility = assess_perceptibility(
            surface,
            device,
            query.part,
            rms=merit.ripple * surface.stiffness,
            speed=query.speed,
            explicit_depth=query.explicit_depth,
            grip=query.grip,
        )
    return LawRow(
        surface=surface,
        q=q,
        one_sided=loop.one_sided,
        passivity=assess_loop(loop.with_leak(surface, leak)),
        margin=recommended.margin,
        recommended_stiffness=recommended.stiffness,
        press=mean_press(surface),
        holds_at_any_press=holds_at_any_press(surface),
        perceptibility=perceptibility,
        conservative=surface.facts.conservative,
        conservative_reason=surface.facts.reason,
        leak=leak,
        continuity=continuity(surface, q),
        strength=merit.strength,
        support=merit.support,
        contact_lost=merit.contact_lost,
        ripple=merit.ripple,
        rendering=assess_rendering(surface, query.speed, device.value("update_rate")),
    )
