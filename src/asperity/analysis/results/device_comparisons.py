"""Comparison of the laws on one surface, on several devices and at several depths."""

from __future__ import annotations

import dataclasses
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from functools import partial
from typing import Any

from asperity.analysis.results.compare import SCHEMA, Comparison, compare, lacks_data
from asperity.analysis.results.recommendation import LawRow
from asperity.core.checks import check_items
from asperity.core.display import Reportable, Tabular, Text
from asperity.core.errors import ParameterError
from asperity.core.files import OMITTED, Serializable, to_plain_data, written
from asperity.devices import Device, DeviceLike, load_device
from asperity.laws import REGISTERED_LAWS, Law
from asperity.textures.catalogue import TextureLike, as_texture
from asperity.textures.texture import Texture

# Called with the device, the given depth if any, and the letter of the next law.
DeviceProgress = Callable[[Device, float | None, str], None]


@dataclass(frozen=True)
class MissingData(Serializable):
    """A device with too little data to compare laws on it.

    Attributes:
        device: its id.
        field: the missing field of its device file.
        unit: its unit.
    """

    device: str
    field: str = dataclasses.field(default="max_stiffness", metadata=OMITTED)
    unit: str = dataclasses.field(default="N/m", metadata=OMITTED)
    sentence = Text[str]("The missing data and how to supply them.", is_written=False)

    @property
    @written
    def hint(self) -> str:
        """The missing line of the device file."""
        return f'{self.field} = "... {self.unit}"'


@dataclass(frozen=True)
class DeviceComparisons(Reportable, Tabular):
    """A surface on several devices, pressed to several depths.

    Attributes:
        texture: the surface.
        comparisons: one for each device and depth, grouped by device.
        missing_data: the devices that could not be compared.
    """

    texture: Texture
    comparisons: tuple[Comparison, ...]
    missing_data: tuple[MissingData, ...] = ()
    recommendation = Text[str](
        "The best device and law for the texture, and the number of cases by tier."
    )

    @property
    def best_case(self) -> tuple[Comparison, LawRow] | None:
        """The comparison and law of the strongest texture; ``None`` if none is recommended."""
        cases = [
            (comparison, comparison.recommended_row)
            for comparison in self.comparisons
            if comparison.recommended_row is not None
        ]
        return max(
            cases, key=lambda case: (case[1].tier == "felt", case[1].resolved_force), default=None
        )

    def __repr__(self) -> str:
        counts = f"{len(self.comparisons)} compared, {len(self.missing_data)} without data"
        return f"<DeviceComparisons: {counts}>"

    def table_rows(self) -> list[dict[str, Any]]:
        """Return the main numbers of each device, depth and law; SI units."""
        return [row for comparison in self.comparisons for row in comparison.table_rows()]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        return {
            "schema": SCHEMA,
            "texture": self.texture.describe(),
            "recommendation": self.recommendation,
            "comparisons": to_plain_data(self.comparisons),
            "missing_data": to_plain_data(self.missing_data),
        }


def compare_devices(
    texture: TextureLike,
    devices: DeviceLike | Sequence[DeviceLike],
    max_depths: float | Sequence[float] | None = None,
    laws: str | Sequence[str | Law] | None = None,
    *,
    progress: DeviceProgress | None = None,
    **arguments: Any,
) -> DeviceComparisons:
    """Compare laws on each of several devices, at each of several depths.

    Args:
        texture: the surface, or what names it; see
            :func:`~asperity.analysis.results.compare.compare`.
        devices: ids of the catalogue, TOML files, or devices.
        max_depths: depths to which the surface is pressed [m]; by default that of
            :func:`~asperity.analysis.results.compare.compare`.
        laws: letters or names; all by default.
        progress: called before each law.
        **arguments: further arguments of :func:`~asperity.analysis.results.compare.compare`.

    Raises:
        ParameterError: without any device, and as for ``compare``. A device with too little data
            is part of the result, not an error.

    Example:
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> result = compare_devices(Sinusoid(2e-4, 2e-3), ["omega.3", "2diy"], [2e-4, 4e-4], "WC")
        >>> [(case.device.id, case.max_depth, case.recommended) for case in result.comparisons]
        [('omega.3', 0.0002, 'C'), ('omega.3', 0.0004, 'C')]
        >>> [data.device for data in result.missing_data]
        ['2diy']
    """
    loaded = [load_device(device) for device in check_items("device", devices)]
    laws = tuple(REGISTERED_LAWS.values()) if laws is None else laws
    depths = [None] if max_depths is None else check_items("max_depth", max_depths)
    if len(set(depths)) < len(depths):
        raise ParameterError("max_depth", "contains a depth twice", list(depths))
    texture = as_texture(texture)
    comparisons = []
    missing_data = []
    for device in loaded:
        if lacks_data(device):
            missing_data.append(MissingData(device.id))
            continue
        for depth in depths:
            on_law = progress and partial(progress, device, depth)
            comparisons.append(
                compare(texture, device, laws, max_depth=depth, progress=on_law, **arguments)
            )
    return DeviceComparisons(texture, tuple(comparisons), tuple(missing_data))
