"""The main job for several devices and depths at once: which of them, and with which law?"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import Any

from asperity.analysis.compare import SCHEMA, Comparison, compare, line_to_add
from asperity.analysis.words.several import Case, several_answer
from asperity.devices import Device, load_device
from asperity.display import Reported
from asperity.errors import ParameterError
from asperity.files import Record, plain
from asperity.laws import KNOWN_LAWS, Law
from asperity.textures.naming import TextureLike, as_texture
from asperity.textures.texture import Texture

# Is told the device, the depth, if one was asked for, and the letter of the law that is next.
Told = Callable[[Device, float | None, str], None]


@dataclass(frozen=True)
class Lacking(Record):
    """A device of which too little is known to compare laws on it.

    Attributes:
        device: its id.
        add: the line of a device file that would be enough.
    """

    written = "device add"

    device: str
    add: str

    @property
    def sentence(self) -> str:
        """What to do."""
        option = self.add.replace(" = ", "=").replace('"', "").replace(" ", "")
        return (
            f"{self.device}: nobody says which smooth wall it held; measure it, and add {self.add}"
            f" to its file, or give --set {option}"
        )


@dataclass(frozen=True)
class Comparisons(Reported):
    """A surface on several devices, pressed to several depths.

    Attributes:
        texture: the surface.
        comparisons: one for each device and depth, devices first.
        lacking: the devices that could not be compared.
    """

    texture: Texture
    comparisons: tuple[Comparison, ...]
    lacking: tuple[Lacking, ...] = ()

    @property
    def recommendation(self) -> str:
        """Where the texture comes out best and with which law, and in how many cases it is felt."""
        cases = [
            Case(one.device.name, one.max_depth, row or one.nearest_row, row is not None)
            for one in self.comparisons
            for row in (one.recommended_row,)
        ]
        return several_answer(cases, [one.device for one in self.lacking])

    def __repr__(self) -> str:
        return f"<Comparisons: {len(self.comparisons)} answered, {len(self.lacking)} lacking>"

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        return {
            "schema": SCHEMA,
            "texture": self.texture.describe(),
            "recommendation": self.recommendation,
            "comparisons": plain(self.comparisons),
            "lacking": plain(self.lacking),
        }


def compare_several(
    texture: TextureLike,
    devices: Sequence[str | os.PathLike[str] | Device],
    max_depths: Sequence[float] | None = None,
    laws: str | Sequence[str | Law] | None = None,
    *,
    progress: Told | None = None,
    **arguments: Any,
) -> Comparisons:
    """Return the laws compared on each of several devices, at each of several depths.

    Args:
        texture: the surface, or what names it; see :func:`~asperity.analysis.compare.compare`.
        devices: ids of the catalogue, TOML files, or devices.
        max_depths: to which the surface is pressed [m]; by default the one of
            :func:`~asperity.analysis.compare.compare`.
        laws: letters or names; all by default.
        progress: called before each law.
        **arguments: others of :func:`~asperity.analysis.compare.compare`.

    Raises:
        ParameterError: for no device at all, or what ``compare`` refuses. A device of which too
            little is known is an answer, not an error.

    Example:
        >>> from asperity.textures.sinusoid import Sinusoid
        >>> found = compare_several(Sinusoid(2e-4, 2e-3), ["omega.3", "2diy"], [2e-4, 4e-4], "WC")
        >>> [(one.device.id, one.max_depth, one.recommended) for one in found.comparisons]
        [('omega.3', 0.0002, 'C'), ('omega.3', 0.0004, 'C')]
        >>> [one.device for one in found.lacking]
        ['2diy']
    """
    known = [load_device(device) for device in devices]
    if not known:
        raise ParameterError("device", "must be one or several")
    chosen = tuple(KNOWN_LAWS.values()) if laws is None else laws
    depths: Sequence[float | None] = [None] if max_depths is None else max_depths
    if not depths:
        raise ParameterError("max_depth", "must be one or several depths")
    if len(set(depths)) < len(depths):
        raise ParameterError("max_depth", "names one depth twice", list(depths))
    made, found, lacking = as_texture(texture), [], []
    for device in known:
        if line := line_to_add(device):
            lacking.append(Lacking(device.id, line))
            continue
        for depth in depths:

            def step(letter: str, device: Device = device, depth: float | None = depth) -> None:
                if progress is not None:
                    progress(device, depth, letter)

            found.append(compare(made, device, chosen, max_depth=depth, progress=step, **arguments))
    return Comparisons(made, tuple(found), tuple(lacking))
