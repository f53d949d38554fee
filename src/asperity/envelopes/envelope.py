"""Which sinusoids a device renders, by law: borders of the amplitude at each wavelength."""

from __future__ import annotations

import math
import os
from collections.abc import Callable, Iterable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from itertools import chain
from typing import Any

import numpy as np

from asperity.analysis.gain.surface_cache import is_shipped_law
from asperity.analysis.limits.limit_rules import LIMIT_RULES, shortest_wavelengths
from asperity.analysis.limits.spectrum import MIN_SHARE, Wave, compute_spectrum
from asperity.analysis.results.compare import DEFAULT_DEVICE, Progress, lacks_data
from asperity.core.checks import check_array, check_items
from asperity.core.display import Plottable, Reportable, TableFiles, Text
from asperity.core.errors import ParameterError
from asperity.core.files import OMITTED, Serializable, to_plain_data, written
from asperity.core.processes import precompute
from asperity.devices import Device, DeviceLike, load_device
from asperity.envelopes.wave_borders import (
    AMPLITUDE_LIMITS,
    RenderConditions,
    WaveBorders,
    WaveCase,
    find_borders,
    make_conditions,
)
from asperity.laws import REGISTERED_LAWS, Law, distribute_parameters, find_laws
from asperity.surface import Surface
from asperity.textures import Sinusoid
from asperity.textures.catalogue import TextureLike, as_texture

SCHEMA = 1
LISTED = (0.5e-3, 1e-3, 2e-3, 5e-3, 10e-3)
"""Wavelengths of the tables [m]."""
WAVELENGTHS = tuple(sorted({*np.geomspace(0.05e-3, 20e-3, 54).tolist(), *LISTED}))
"""Wavelengths of an envelope by default [m]."""
GENTLE_WAVE = Sinusoid(1e-5, 1e-3)
_MAX_PEAKS = 8
# Least share of the widest region with which a law renders nearly as much.
_NEAR = 0.9
# Ratio of the wavelengths on both sides of an edge. A wave is resolved if it is longer than a
# limit of the device, not if it is as long.
_EDGE = 1.0 + 1e-6


@dataclass(frozen=True)
class LawEnvelope(Serializable):
    """The sinusoids that a device renders with one law.

    Attributes:
        case: law, its parameters, device and conditions.
        letter: letter of the law.
        conservative: whether the law is conservative; if not, the stiffness is that of the wall's
            gain, and the field delivers energy below a speed v* at any stiffness.
        borders: at each wavelength, ascending.
    """

    case: WaveCase = field(metadata=OMITTED)
    letter: str
    conservative: bool
    borders: tuple[WaveBorders, ...]

    @property
    @written
    def decades(self) -> float:
        """Area of the region in decades of amplitude times decades of wavelength."""
        along = np.log10([border.wavelength for border in self.borders])
        widths = np.array([border.decades for border in self.borders])
        return float(np.sum(0.5 * (widths[1:] + widths[:-1]) * np.diff(along)))

    def renders(self, wave: Wave) -> bool:
        """Return whether the device renders a wave alone."""
        return self.case.try_wave(wave.wavelength, wave.amplitude).is_rendered


@dataclass(frozen=True)
class WavelengthLimit(Serializable):
    """A limit of the paper's section II.B on the wavelength alone.

    Attributes:
        number: number in the paper: 1, 2, 3 or 6.
        wavelength: the limit fails for shorter waves [m].
        trusted: whether the number of the device is verified; one that is not bounds no region.
    """

    number: int
    wavelength: float
    trusted: bool


@dataclass(frozen=True)
class DeviceEnvelope(Serializable):
    """The sinusoids that one device renders, by law.

    Attributes:
        device: the device.
        laws: the laws.
        limits: limits 1, 2, 3 and 6 at this speed, the shortest wavelength first.
    """

    device: Device
    laws: tuple[LawEnvelope, ...]
    limits: tuple[WavelengthLimit, ...]

    @property
    def widest(self) -> LawEnvelope:
        """The law with the largest region, of conservative laws if one renders anything."""
        sound = [law for law in self.laws if law.conservative and law.decades]
        return max(sound or self.laws, key=lambda law: law.decades)

    @property
    def near_widest(self) -> list[LawEnvelope]:
        """Further conservative laws whose region is at least 0.9 times the widest one."""
        widest = self.widest
        least = _NEAR * widest.decades
        others = [law for law in self.laws if law is not widest and law.conservative]
        return [law for law in others if law.decades and law.decades >= least]

    def has_line(self, number: int) -> bool:
        """Return whether a limit of the paper lies within the wavelengths and amplitudes."""
        borders = [border for law in self.laws for border in law.borders]
        if number in AMPLITUDE_LIMITS:
            places = [getattr(border, AMPLITUDE_LIMITS[number]) for border in borders]
            return any(np.isfinite(places))
        lengths = {limit.number: limit.wavelength for limit in self.limits}
        if number == 3 and number not in lengths:  # equal to 2
            number = 2
        return lengths.get(number, 0.0) > borders[0].wavelength

    def __getitem__(self, letter: str) -> LawEnvelope:
        """Return the envelope of a law by its letter."""
        return {law.letter: law for law in self.laws}[letter]


@dataclass(frozen=True)
class SurfacePeaks(Serializable):
    """The greatest waves of a surface.

    Attributes:
        name: what names the surface.
        waves: waves of the spectrum that are greater than their neighbours, the longest first.
        rendered_by: for each device, in each wave the letters of the laws that render it.
    """

    name: str
    waves: tuple[Wave, ...]
    rendered_by: tuple[tuple[str, ...], ...]


@dataclass(frozen=True)
class Envelope(Plottable, Reportable, TableFiles):
    """The sinusoids that devices render: borders by device, law and wavelength.

    Attributes:
        devices: one envelope per device.
        conditions: what rendering means: speed, least stiffness, hand.
        surfaces: peaks of measured surfaces.
    """

    devices: tuple[DeviceEnvelope, ...]
    conditions: RenderConditions
    surfaces: tuple[SurfacePeaks, ...]
    assumptions = Text[tuple[str, ...]]("Assumptions, in sentences.")

    def __getitem__(self, device: str) -> DeviceEnvelope:
        """Return the envelope of a device by its id."""
        return {envelope.device.id: envelope for envelope in self.devices}[device]

    def __repr__(self) -> str:
        regions = [f"{part.device.id}: law {part.widest.letter} widest" for part in self.devices]
        return f"<Envelope, {'; '.join(regions)}>"

    def iterate_rows(self) -> Iterator[dict[str, Any]]:
        """Yield a row per device, law and wavelength; SI units, ``None`` where there is none."""
        yield from [
            {"device": part.device.id, "law": law.letter} | _border_row(border)
            for part in self.devices
            for law in part.laws
            for border in law.borders
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        names = ("conditions", "devices", "surfaces", "assumptions")
        return {"schema": SCHEMA} | {name: to_plain_data(getattr(self, name)) for name in names}


_COLUMNS = {
    "wavelength [m]": "wavelength",
    "rendered from amplitude [m]": "felt_from",
    "rendered up to amplitude [m]": "felt_up_to",
    "stiff enough up to amplitude [m]": "firm_up_to",
    "limit 4 from amplitude [m]": "force_limit",
    "limit 5 up to amplitude [m]": "gain_limit",
    "recommended stiffness [N/m]": "stiffness",
}


def _border_row(border: WaveBorders) -> dict[str, float | None]:
    row = {column: getattr(border, name) for column, name in _COLUMNS.items()}
    return {column: None if math.isnan(value) else value for column, value in row.items()}


def envelope(
    device: DeviceLike | Sequence[DeviceLike] = DEFAULT_DEVICE,
    laws: str | Sequence[str | Law] | None = None,
    *,
    surface: TextureLike | Sequence[TextureLike] | None = None,
    wavelengths: Sequence[float] | None = None,
    law_parameters: Mapping[str, float] | None = None,
    progress: Progress | None = None,
    **conditions: Any,
) -> Envelope:
    """Compute which sinusoids devices render, by law.

    A device renders a texture with a law if the recommended stiffness is at least ``min_stiffness``
    and the texture is felt at that stiffness on a scan, as in
    :func:`~asperity.analysis.results.compare.compare`. Borders are roots of these conditions in the
    amplitude at each wavelength.

    Args:
        device: one or several devices; see :func:`~asperity.analysis.results.compare.compare`.
        laws: letters or names; by default all with a texture.
        surface: one or several surfaces, of which the greatest waves are located.
        wavelengths: [m], ascending; by default 60 from 0.05 mm to 20 mm.
        law_parameters: parameters of laws by name.
        progress: called with device and law before each.
        **conditions: ``speed`` of the scan [m/s], 0.1 by default; ``min_stiffness``, least
            stiffness of the wall [N/m], 100 by default; ``max_depth`` to which textures are pressed
            [m], by default the peak-to-valley height of each, at most 1 mm; ``time_samples``,
            ``position_samples`` and ``force_steps`` as in
            :func:`~asperity.analysis.results.check_limits.limits`; ``grip``, the hand.

    Raises:
        ParameterError: for a value that cannot be used, or a device with too little data.

    Reference:
        docs/theory/envelopes.md.

    Example:
        >>> result = envelope("touch", "C", wavelengths=[1e-3, 2e-3])
        >>> [f"{one.felt_from * 1e6:.1f} to {one.felt_up_to * 1e6:.0f} µm"
        ...  for one in result["touch"]["C"].borders]
        ['20.5 to 201 µm', '18.7 to 403 µm']
    """
    cases = make_cases(device, laws, law_parameters, envelope, conditions)
    devices = list(dict.fromkeys(case.device.id for case in cases))
    checked = cases[0].conditions
    sources = [] if surface is None else check_items("surface", surface)
    textures = [(_surface_name(source), as_texture(source)) for source in sources]
    lengths = WAVELENGTHS if wavelengths is None else _check_wavelengths(wavelengths)
    envelopes = _compute(cases, lengths, progress)
    regions = tuple(
        _device_envelope([law for law in envelopes if law.case.device.id == name])
        for name in devices
    )
    peaks = tuple(
        _locate_peaks(name, compute_spectrum(texture).waves, regions) for name, texture in textures
    )
    return Envelope(regions, checked, peaks)


def _device_envelope(laws: Sequence[LawEnvelope]) -> DeviceEnvelope:
    case = laws[0].case
    return DeviceEnvelope(case.device, tuple(laws), _wavelength_limits(case))


def _surface_name(surface: TextureLike) -> str:
    if isinstance(surface, (str, os.PathLike)):
        return os.path.basename(surface)
    return repr(surface)


def _check_wavelengths(wavelengths: Sequence[float]) -> tuple[float, ...]:
    lengths = check_array("wavelengths", wavelengths, (None,), "m")
    if not len(lengths) or lengths.min() <= 0.0 or np.any(np.diff(lengths) <= 0.0):
        raise ParameterError("wavelengths", "must be positive and ascending [m]")
    return tuple(lengths.tolist())


def textured_laws() -> tuple[Law, ...]:
    """Return the registered laws whose force depends on the texture."""
    return tuple(
        law for law in REGISTERED_LAWS.values() if Surface(GENTLE_WAVE, law).depends_on_texture
    )


def make_cases(
    device: DeviceLike | Sequence[DeviceLike],
    laws: str | Sequence[str | Law] | None,
    law_parameters: Mapping[str, float] | None,
    function: Callable[..., Any],
    conditions: Mapping[str, Any],
) -> list[WaveCase]:
    """Return the cases of each device and law from the arguments of a function.

    Raises:
        ParameterError: for an argument that cannot be used, or a device with too little data.
    """
    devices = [load_device(name) for name in check_items("device", device)]
    for known in devices:
        if lacks_data(known):
            raise ParameterError(
                "device",
                f'{known.id} needs max_stiffness: add max_stiffness = "... N/m" to its file',
            )
    names = [known.id for known in devices]
    if len(set(names)) < len(names):
        raise ParameterError("device", "names one device twice", names)
    chosen = textured_laws() if laws is None else find_laws(laws)
    parameters = distribute_parameters(law_parameters or {}, chosen)
    checked = make_conditions(function, **conditions)
    return [
        WaveCase(law.letter if is_shipped_law(law) else law, own, known, checked)
        for known in devices
        for law, own in zip(chosen, parameters, strict=True)
    ]


def _wavelength_limits(case: WaveCase) -> tuple[WavelengthLimit, ...]:
    device = case.device
    conditions = case.conditions
    samples = conditions.speed, conditions.time_samples, conditions.position_samples
    fields = {rule.number: rule.device_field for rule in LIMIT_RULES}
    return tuple(
        WavelengthLimit(number, length, datum.is_trusted)
        for length, number, _words in shortest_wavelengths(device, *samples)
        for datum in [device.data[fields[number]]]
    )


Task = tuple[WaveCase, tuple[float, ...]]


def compute_task(task: Task) -> tuple[WaveBorders, ...]:
    """Compute the borders of a task, in a worker process."""
    return find_borders(*task)


def _compute(
    cases: Sequence[WaveCase], lengths: Sequence[float], progress: Progress | None
) -> list[LawEnvelope]:
    tasks = [(case, _with_edges(case, lengths)) for case in cases]
    # A user-defined law cannot be sent to another process.
    shared = [task if isinstance(task[0].law, str) else None for task in tasks]
    results = []
    with precompute(compute_task, shared) as precomputed:
        for (case, wavelengths), computed in zip(tasks, precomputed, strict=True):
            surface = Surface(GENTLE_WAVE, case.law)
            letter = surface.law.letter
            is_conservative = surface.facts.conservative
            if progress is not None:
                progress(f"{case.device.id}, law {letter}")
            borders = computed or find_borders(case, wavelengths)
            results.append(LawEnvelope(case, letter, is_conservative, borders))
    return results


def _with_edges(case: WaveCase, lengths: Sequence[float]) -> tuple[float, ...]:
    """Return the wavelengths with those on both sides of what bounds the region.

    These are the limits of the device and the frequencies between which the grip has thresholds.
    """
    edges = [limit.wavelength for limit in _wavelength_limits(case) if limit.trusted]
    grip = case.conditions.grip
    ends = [case.conditions.speed / grip.frequency[place] for place in (0, -1)]
    pairs = [(edge, edge * _EDGE) for edge in edges] + [(end / _EDGE, end * _EDGE) for end in ends]
    inner = [pair for pair in pairs if lengths[0] < pair[0] and pair[1] < lengths[-1]]
    return tuple(sorted({*lengths, *chain.from_iterable(inner)}))


def _locate_peaks(
    name: str, waves: Sequence[Wave], regions: Iterable[DeviceEnvelope]
) -> SurfacePeaks:
    """Return the waves that are greater than their neighbours, and the laws that render them."""
    sizes = [0.0, *(wave.amplitude for wave in waves), 0.0]
    peaks = [
        wave
        for index, wave in enumerate(waves, start=1)
        if sizes[index] >= max(sizes[index - 1], sizes[index + 1]) and wave.share >= MIN_SHARE
    ]
    largest = sorted(peaks, key=lambda wave: -wave.share)[:_MAX_PEAKS]
    peaks = [wave for wave in peaks if wave in largest]
    rendered = tuple(
        tuple("".join(law.letter for law in part.laws if law.renders(wave)) for wave in peaks)
        for part in regions
    )
    return SurfacePeaks(name, tuple(peaks), rendered)
