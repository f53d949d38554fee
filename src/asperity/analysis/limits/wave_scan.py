"""The force of each wave of a texture on a scan at constant height, with device and hand."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from asperity.analysis.energy.straight_scan import (
    friction_scan,
    scan_force,
    scan_height,
    sliding_state,
)
from asperity.analysis.gain.surface_cache import cached_result
from asperity.analysis.limits.limit_rules import LimitCase
from asperity.analysis.limits.spectrum import (
    BANDS_PER_OCTAVE,
    Spectrum,
    band_variances,
    compute_spectrum,
)
from asperity.core.checks import FloatArray
from asperity.devices import Device
from asperity.perception.grip import Grip
from asperity.surface import Surface, default_max_depth
from asperity.textures.texture import Texture, TexturePart

ForceFunction = Callable[[Surface, FloatArray], FloatArray]
MASKING_FIELDS = "force_resolution", "friction", "bandwidth", "update_rate", "position_resolution"
"""Device data that may hide a texture."""


@dataclass(frozen=True)
class WaveScan:
    """The waves of a texture on a scan, with the device and the hand that they move.

    Attributes:
        case: device, speed, samples, and the waves.
        components: amplitudes of the force along the wall and along its normal [N], shape (n, 2).
        grip: the hand.
        contact_stiffness: stiffness of the wall along its normal [N/m].
        reach: width of the workspace [m]; longer waves are not felt as such.
    """

    case: LimitCase
    components: FloatArray
    grip: Grip
    contact_stiffness: float
    reach: float = math.inf

    def magnified(self, factor: float) -> WaveScan:
        """Return the scan of the texture magnified in all directions, as deep in proportion."""
        wavelengths = factor * self.case.wavelengths
        case = replace(self.case, wavelengths=wavelengths, forces=factor * self.case.forces)
        return replace(self, case=case, components=factor * self.components)

    def at_stiffness(self, stiffness: float) -> WaveScan:
        """Return the scan at another stiffness [N/m], to which the force is proportional."""
        factor = stiffness / self.contact_stiffness
        case = replace(self.case, forces=factor * self.case.forces)
        components = factor * self.components
        return replace(self, case=case, components=components, contact_stiffness=stiffness)

    def at_speed(self, speed: float) -> WaveScan:
        """Return the scan at another speed [m/s]."""
        return replace(self, case=replace(self.case, speed=speed))

    def with_device(self, field: str, value: float) -> WaveScan:
        """Return the scan on a device with another value of a field."""
        return replace(self, case=replace(self.case, device={**self.case.device, field: value}))


def scan_waves(
    surface: Surface,
    device: Device,
    part: TexturePart,
    grip: Grip,
    *,
    rms: float,
    explicit_depth: bool,
    points: int | None = None,
    **scan: float,
) -> tuple[WaveScan, dict[str, float], float, Surface]:
    """Return the waves of a surface on a scan with the trusted numbers of a device.

    Friction adds to each wave the variation of its slip limit, less what the presliding stiffness
    does not follow, in squares.

    Args:
        surface: texture, law and stiffness.
        device: see :func:`assess_perceptibility`.
        part: see :func:`assess_perceptibility`.
        grip: the hand.
        rms: RMS of the oscillating force of the surface [N].
        explicit_depth: see :func:`assess_perceptibility`.
        points: see :func:`~asperity.analysis.limits.wave_scan.wave_force_components`.
        **scan: see :func:`assess_perceptibility`.

    Returns:
        The waves; the numbers of the device that are not trusted; RMS of the force of the texture;
        the surface without form and waviness, whose scan has that force.
    """
    texture_rms = rms
    scanned = surface
    if part.nesting is not None:
        depth = surface.max_depth if explicit_depth else default_max_depth(part.texture)
        scanned = surface.to_texture(part.texture, depth)
        texture_rms = scan_force(scanned).ripple * surface.stiffness
    spectrum = compute_spectrum(part.texture)
    components = wave_force_components(scanned, spectrum, points)
    forces = np.hypot(*components.T)
    # The waves share the RMS of the scan; their sum differs by what is not periodic in the scan.
    total = math.sqrt(float(forces @ forces))
    scale = math.sqrt(2.0) * texture_rms / total if total > 0.0 else 0.0
    components = scale * components
    forces = scale * forces
    friction = friction_scan(scanned)
    if friction is not None:
        slip = wave_force_components(scanned, spectrum, points, slip_forces) * friction.remaining
        components = np.hypot(components, slip)
        forces = np.hypot(*components.T)
        texture_rms = math.hypot(texture_rms, float(np.linalg.norm(slip)) / math.sqrt(2.0))
    data = {name: datum.value for name, datum in device.data.items()}
    doubtful = {
        name: data.pop(name)
        for name in MASKING_FIELDS
        if name in device.data and not device.data[name].is_trusted
    }
    case = LimitCase(data, spectrum.wavelengths, forces, spectrum.shares, **scan)
    waves = WaveScan(case, components, grip, surface.stiffness, device.workspace_size)
    return waves, doubtful, texture_rms, scanned


# --- the force of each wave -----------------------------------------------------------------------

# Points of the fit to a sum of waves, and of a side of the patch of a map; fewer where every
# force requires a closest-point search.
_FIT_POINTS = {False: 16384, True: 4096}


_LINE_POINTS = {False: 2**15, True: 4096}


_SIDE_POINTS = {False: 1024, True: 96}


# An aperiodic sum is fitted over this many of its longest waves.
_APERIODIC_FIT_LENGTH = 64.0


_GOLDEN_RATIO = 0.5 * (math.sqrt(5.0) - 1.0)


def wave_forces(surface: Surface, spectrum: Spectrum) -> FloatArray:
    """Return the force amplitude of every wave of a texture.

    The squares of the components of :func:`wave_force_components` are added.

    Args:
        surface: texture, law and stiffness.
        spectrum: the spectrum of its texture.

    Returns:
        A_F [N], shape (n,).

    Example:
        >>> from asperity.analysis.limits.spectrum import compute_spectrum
        >>> from asperity.textures.kinds.sinusoid import Sinusoid
        >>> texture = Sinusoid(amplitude=1e-4, period=1e-3)
        >>> wave_forces(Surface(texture, "A", stiffness=500.0), compute_spectrum(texture)).round(9)
        array([0.05])
    """
    return np.asarray(np.hypot(*wave_force_components(surface, spectrum).T))


def scan_forces(surface: Surface, xy: FloatArray) -> FloatArray:
    """Return the forces [N], shape (n, 3), at points (n, 2) [m] of the scan's height."""
    probes = np.column_stack([xy, np.full(len(xy), scan_height(surface))])
    return surface.force(probes, *sliding_state(surface, len(xy))[:1])


def slip_forces(surface: Surface, xy: FloatArray) -> FloatArray:
    """Return the friction [N] there of a surface that slides along its scan line, at the limit."""
    probes = np.column_stack([xy, np.full(len(xy), scan_height(surface))])
    friction = surface.contact_friction
    axes = 2 if friction is None else friction.axes
    beyond = np.zeros((len(xy), axes))
    beyond[:, :2] = surface.texture.scan_line().direction
    return surface.force(probes, beyond) - surface.force(probes)


def wave_force_components(
    surface: Surface,
    spectrum: Spectrum,
    points: int | None = None,
    evaluate: ForceFunction = scan_forces,
) -> FloatArray:
    """Return the force amplitude of every wave of a texture, along the wall and along its normal.

    The probe moves at constant height, as deep as
    :func:`~asperity.analysis.energy.straight_scan.merit` scans; a law with state slides at full
    deflection. With ``slip_forces`` it is the force of friction. For a sum of waves the force is
    fitted by the same waves (least squares). For bands it is the amplitude of the band times the
    square root of the ratio of force variance to height variance on the same patch.

    Returns:
        Amplitudes [N], shape (n, 2): of the components along x and y, their squares added; and of
        the component along z.
    """
    if not spectrum.waves:
        return np.zeros((0, 2))
    if points is not None and spectrum.exact:
        return _fit_waves(surface, spectrum, evaluate, points)
    compute = _fit_waves if spectrum.exact else _band_force_amplitudes
    key = [repr((spectrum.exact, spectrum.waves))]
    if evaluate is slip_forces:
        key.append(repr(surface.friction_values))
    forces = cached_result(
        "wave forces", surface, lambda unit: compute(unit, spectrum, evaluate), *key
    )
    return np.asarray(forces) * surface.stiffness


def _fit_waves(
    surface: Surface, spectrum: Spectrum, evaluate: ForceFunction, points: int | None = None
) -> FloatArray:
    """Return the amplitudes of the least-squares fit of waves to the force."""
    count = points or _FIT_POINTS[surface.law.contact.requires_search]
    xy = _fit_points(surface.texture, spectrum, count)
    vectors = np.array([wave.vector for wave in spectrum.waves])
    angles = xy @ vectors.T + np.array([wave.phase for wave in spectrum.waves])
    columns = np.hstack([np.ones((len(xy), 1)), np.sin(angles), np.cos(angles)])
    fit = np.linalg.lstsq(columns, evaluate(surface, xy), rcond=None)[0][1:]
    squares = fit[: len(vectors)] ** 2 + fit[len(vectors) :] ** 2
    pairs = np.column_stack([squares[:, 0] + squares[:, 1], squares[:, 2]])
    return np.asarray(np.sqrt(pairs))


def _fit_points(texture: Texture, spectrum: Spectrum, count: int) -> FloatArray:
    """Return points (n, 2) [m] spread evenly over one period, or over many wavelengths."""
    domain = texture.domain
    steps = np.arange(count)
    spans = domain.spans
    if not domain.periodic:
        side = _APERIODIC_FIT_LENGTH * float(spectrum.wavelengths.max())
        spans = side * spans / np.hypot(*spans.T)[:, None]
    # Equal steps along the first span, the golden ratio across: a low-discrepancy lattice.
    fractions = [(steps + 0.5) / count, (steps * _GOLDEN_RATIO) % 1.0][: len(spans)]
    return np.asarray(domain.origin + np.stack(fractions, axis=-1) @ spans)


def _band_force_amplitudes(
    surface: Surface, spectrum: Spectrum, evaluate: ForceFunction
) -> FloatArray:
    """Return the amplitude of each band, from the ratio of force to height on a patch."""
    texture = surface.texture
    costly = surface.law.contact.requires_search
    max_count = (_LINE_POINTS if texture.is_profile else _SIDE_POINTS)[costly]
    points, spacing, repeats = texture.domain.grid(texture.grid_counts(), max_count)
    flat = points.reshape(-1, 2)
    shape = points.shape[:2]
    pushed = evaluate(surface, flat)
    if not pushed.any():  # nothing is touched here: take the patch around the highest point
        flat = flat + _highest_point(texture) - flat.mean(axis=0)
        pushed = evaluate(surface, flat)
    heights = band_variances(texture.height(flat).reshape(1, *shape), spacing, repeats)
    forces = np.ascontiguousarray(pushed.T).reshape(3, *shape)
    along, normal = (band_variances(part, spacing, repeats) for part in (forces[:2], forces[2:]))
    known = heights.variance > 1e-12 * heights.variance.max()
    variances = np.column_stack([along.variance, normal.variance])
    ratio = np.sqrt(variances[known] / heights.variance[known, None])
    wanted = np.floor(BANDS_PER_OCTAVE * np.log2(1.0 / spectrum.wavelengths))
    # A wave longer than the patch has the force ratio of the longest wave in it.
    nearest = np.abs(heights.number[known] - wanted[:, None]).argmin(axis=1)
    return np.asarray(spectrum.amplitudes[:, None] * ratio[nearest])


def _highest_point(texture: Texture) -> FloatArray:
    """Return the highest sample (x, y) [m] of a texture."""
    counts = texture.grid_counts()
    points = texture.domain.grid(counts, max(counts))[0].reshape(-1, 2)
    return np.asarray(points[np.argmax(texture.height(points))])
