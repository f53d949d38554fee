"""Which of the laws compared to use."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

from asperity.analysis.row import LawRow
from asperity.devices import Device

# A texture force below this is taken as not felt where the device's resolution is unknown [N].
DEFAULT_FELT_FORCE = 0.01


@dataclass(frozen=True)
class Recommendation:
    """The recommended law, and what it was chosen from.

    Attributes:
        row: of the recommended law; ``None`` if no law renders a texture at a known stiffness.
        rows: of all laws compared.
        sound: whether it is conservative and continuous; else it leaks least.
        textured: the laws that render a texture.
        felt: those whose texture can be felt; all of them if none can.
        threshold: force below which a texture is not felt [N].
    """

    row: LawRow | None
    rows: tuple[LawRow, ...]
    sound: bool
    textured: tuple[LawRow, ...]
    felt: tuple[LawRow, ...]
    threshold: float


def recommend(rows: Sequence[LawRow], device: Device) -> Recommendation:
    """Return which law to use.

    A law that is conservative and continuous gives no net energy on any closed path and no jump of
    force; of those the one with the strongest texture at the stiffness that it is allowed is
    recommended, if it can be felt. Else, of the continuous laws that can be felt, the one that
    leaks least for its texture force. A law of which no stiffness is known to do is never
    recommended.
    """
    textured = tuple(row for row in rows if row.texture_force > 0.0)
    threshold = felt_force(device)
    felt = tuple(row for row in textured if row.texture_force >= threshold) or textured
    sound = [row for row in felt if not (row.leaks or row.jumps)]
    best = None
    if sound:
        best = _soundest(sound)
    elif felt:
        best = min([row for row in felt if not row.jumps] or felt, key=_aliveness)
    return Recommendation(best, tuple(rows), bool(sound), textured, felt, threshold)


def felt_force(device: Device) -> float:
    """Return the texture force below which nothing is felt [N]: the device's resolution."""
    known = device.value("force_resolution")
    return DEFAULT_FELT_FORCE if known is None else known


def _soundest(sound: Sequence[LawRow]) -> LawRow:
    """Return the strongest law; of nearly equal ones one whose force cannot jump at any depth."""
    strongest = max(row.texture_force for row in sound)
    equal = [row for row in sound if row.texture_force >= 0.98 * strongest]
    return min(equal, key=lambda row: not row.surface.law.contact.single_valued)


def _aliveness(row: LawRow) -> float:
    """Leak at the stiffness that the law is allowed, over texture force times length [1]."""
    return row.safe_leak / (row.texture_force * row.leak.line.length)
