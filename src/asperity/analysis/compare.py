"""The main job: the paper's Table II for your surface on your device."""

from __future__ import annotations

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

from asperity.analysis.energy.continuity import continuity
from asperity.analysis.energy.leak import worst_loop
from asperity.analysis.energy.merit import merit
from asperity.analysis.gain.characteristic import characteristic_number, one_sided_number
from asperity.analysis.recommendation import recommend
from asperity.analysis.row import LawRow
from asperity.analysis.words.comparison import assumptions, recommendation, verdict
from asperity.arguments import DEFAULT_STIFFNESS
from asperity.checks import positive
from asperity.derive.facts import law_facts
from asperity.devices import Device, load_device
from asperity.files import plain, record
from asperity.laws import LAWS, Law, find_laws, shared_out
from asperity.notebook import as_html
from asperity.surface import Surface
from asperity.textures.texture import Texture

SCHEMA = 1
DEFAULT_DEVICE = "omega.3"
ALL_LAWS = "".join(LAWS)

Progress = Callable[[str], None]


@dataclass(frozen=True)
class Comparison:
    """The laws compared on one surface and one device.

    Attributes:
        texture: the texture.
        device: the device.
        stiffness: the stiffness that was asked for [N/m].
        max_depth: the depth to which the surface is pressed [m].
        rows: one per law, in the order asked for.
        recommended_row: of the recommended law; ``None`` if none can be recommended.
        recommendation: the recommendation with its reason, in words.
        assumptions: what was assumed, in sentences: defaults, unverified device data, the steps
            of preparing the surface, regions and resolutions of sampling.
    """

    texture: Texture
    device: Device
    stiffness: float
    max_depth: float
    rows: tuple[LawRow, ...]
    recommended_row: LawRow | None
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

    def _repr_html_(self) -> str:
        """Return the answer and a table for a notebook."""
        head = ["law", "q", "q⁺", "stiffness up to [N/m]", "conservative", "continuous", "verdict"]
        rows = [
            [
                row.law.letter,
                f"{row.q.value:.4g} ({row.q.method})",
                f"{row.one_sided.value:.4g} ({row.one_sided.method})",
                f"{row.safe_stiffness:.4g}",
                "yes" if row.conservative else "no",
                "yes" if row.continuous else "no",
                row.verdict,
            ]
            for row in self.rows
        ]
        return as_html(self.recommendation, (head, rows))

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        return {
            "schema": SCHEMA,
            "texture": self.texture.describe(),
            **record(self, "device", "stiffness", "max_depth"),
            "laws": plain(self.rows),
            **record(self, "recommended", "recommendation", "assumptions"),
        }


def compare(
    texture: Texture,
    device: str | os.PathLike[str] | Device = DEFAULT_DEVICE,
    laws: str | Sequence[str | Law] = ALL_LAWS,
    stiffness: float | None = None,
    max_depth: float | None = None,
    *,
    progress: Progress | None = None,
    law_parameters: Mapping[str, float] | None = None,
    **surface_arguments: Any,
) -> Comparison:
    """Return which laws render a surface on a device, at which stiffness, and what goes wrong.

    For every law: q and q⁺, the stiffness that the device can still render (K₀/q, the paper's
    III.B; K₀/q⁺ for a conservative law), whether the field is conservative and what its worst
    loop gains, whether the force is continuous, strength and support, and a verdict.

    Args:
        texture: the surface.
        device: id of the catalogue, TOML file, or a :class:`~asperity.devices.Device`.
        laws: letters or names, or laws of your own.
        stiffness: the stiffness that you want [N/m]; 1000 by default.
        max_depth: the depth to which the surface is pressed [m]; by default its peak-to-valley
            height, at most 1 mm.
        progress: called with the letter of each law before it is analysed.
        law_parameters: values of laws' parameters by name; each goes to the laws that declare it.
        **surface_arguments: further arguments of :class:`~asperity.surface.Surface`.

    Raises:
        ParameterError: for a value that cannot be used, or a parameter that none of the laws
            declares; it names the argument.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> result = compare(Sinusoid(amplitude=0.8e-3, period=1e-3), laws="WA")
        >>> [f"{row.law.letter} {row.safe_stiffness:.0f} N/m" for row in result.rows]
        ['W 5000 N/m', 'A 976 N/m']
    """
    chosen = find_laws(list(laws) if not isinstance(laws, str) else laws)
    known_device = load_device(device)
    asked = DEFAULT_STIFFNESS if stiffness is None else positive("stiffness", stiffness, "N/m")
    limit = known_device.max_stiffness
    shares = shared_out(law_parameters or {}, chosen)
    surfaces = [
        Surface(texture, law, asked, max_depth, law_parameters=own, **surface_arguments)
        for law, own in zip(chosen, shares, strict=True)
    ]
    rows = []
    for surface in surfaces:
        if progress is not None:
            progress(surface.law.letter)
        rows.append(_row(surface, limit))
    chosen_one = recommend(rows, known_device)
    defaults = {"stiffness": stiffness is None, "max_depth": max_depth is None}
    return Comparison(
        texture=texture,
        device=known_device,
        stiffness=asked,
        max_depth=surfaces[0].max_depth,
        rows=tuple(rows),
        recommended_row=chosen_one.row,
        recommendation=recommendation(chosen_one, known_device),
        assumptions=assumptions(rows, known_device, defaults),
    )


def _row(surface: Surface, limit: float) -> LawRow:
    facts = law_facts(surface.law)
    q, one_sided = characteristic_number(surface), one_sided_number(surface)
    scan = merit(surface)
    smooth = continuity(surface, q)
    safe = limit / (one_sided if facts.conservative else q).value
    row = LawRow(
        surface=surface,
        q=q,
        one_sided=one_sided,
        safe_stiffness=safe,
        conservative=facts.conservative,
        conservative_reason=facts.reason,
        leak=worst_loop(surface),
        continuous=smooth.continuous,
        continuous_reason=smooth.reason,
        strength=scan.strength,
        support=scan.support,
        contact_lost=scan.contact_lost,
        texture_force=scan.ripple * safe,
        verdict="",
    )
    return replace(row, verdict=verdict(row))
