"""How a loop renders a law: a formula, a search within a budget, or a baked potential field."""

from __future__ import annotations

import math
import os
from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from asperity.contacts.warm_start import MAX_ERROR_BOUND, TRUNCATED_TICKS, new_warm_start
from asperity.core.arguments import DEFAULT_STIFFNESS, FIELD, RENDERING, SEARCH
from asperity.core.cache import get_or_compute
from asperity.core.checks import check_positive
from asperity.core.errors import ParameterError
from asperity.core.files import Serializable, content_digest
from asperity.core.processes import report_fraction
from asperity.core.units import format_quantity, format_stiffness
from asperity.laws import Law
from asperity.surface import Surface
from asperity.textures.catalogue import TextureLike, as_texture
from asperity.textures.fields.bake import BakeGoal, bake_texture
from asperity.textures.fields.field_certificate import Progress
from asperity.textures.meshes.bake_body import bake_body
from asperity.textures.meshes.dilate_body import dilate_body
from asperity.textures.meshes.lay_texture import lay_texture
from asperity.textures.meshes.mesh_body import load_mesh
from asperity.textures.spline.spline_texture import HeightMap
from asperity.textures.texture import Texture

Extent = Sequence[float]
_NODES_PER_WAVE = 16
# Greatest RMS difference of a field whose resolution is given, over that of the texture's force.
_MAX_SHARE = 0.5
DEFAULT_SPEED = 0.1  # [m/s]
_STROKE_SAMPLES = 4000
FORMULA = "formula"
# Greatest size of a field that is baked without being asked for: some ten seconds.
_AUTOMATIC_BYTES = 2**26
_PRESS_POINTS = 256
DEFAULT_PRESS = 5.0
"""Mean normal force to which a field reaches where nothing else is known [N]."""
# Depth that it then has at most: 5 N at 200 N/m, the stiffness of soft devices [m].
_MAX_REACH = 25e-3


def bake(
    surface: Surface,
    resolution: float | None = None,
    *,
    press: float | None = None,
    extent: Extent | None = None,
    progress: Progress | None = None,
    **goal: Any,
) -> Surface:
    """Bake law H of a surface as a potential field, which is rendered without a search.

    Args:
        surface: a surface with law H; the field extends down to min h - max_depth, and to the
            press.
        resolution: maximum spacing of the nodes [m]; by default the coarsest one at which the
            force differs from exact H by the share, within the size.
        press: mean normal force F [N] that the field reaches at the stiffness k of the surface, at
            min h - F/k; 5 N by default, or less where that is below 25 mm.
        extent: width and depth [m], from the origin, of the part of a non-periodic texture to bake;
            it is mirrored at its border.
        progress: called with the finished fraction, from 0 to 1.
        **goal: ``share``, RMS difference from the exact force over the RMS of the texture's force
            at each depth at which the mean force is at least 0.1 N on 3000 N/m, 0.06 (contact then
            also begins at most 10 µm or 2 % of the peak-to-valley height from the surface);
            ``max_gain``, certified q over max(1, c) at which smoothing of the nodes stops, 1.15, or
            ``None`` for no smoothing; ``max_bytes``, greatest size, 256 MB.

    Returns:
        The same surface with a :class:`~asperity.textures.fields.potential_field.PotentialField`
        as its texture; :func:`asperity.save_field` writes it to a file.

    Raises:
        ParameterError: for another law, a texture that neither repeats nor has a border if no
            extent is given, a resolution coarser than the texture, or a field larger than
            ``max_bytes``; the message states what fits.

    Reference:
        docs/theory/split.md.
    """
    if not surface.law.contact.has_potential_field:
        raise ParameterError("surface", f"must have law H to be baked, not {surface.law}")
    bake_goal = _bake_goal(**goal)
    reach = default_reach(surface.stiffness)
    if press is not None:
        reach = check_positive("press", press, "N") / surface.stiffness
    return _bake(surface, reach, bake_goal, resolution, extent, progress)


def _bake(
    surface: Surface,
    reach: float,
    bake_goal: BakeGoal,
    resolution: float | None = None,
    extent: Extent | None = None,
    progress: Progress | None = None,
) -> Surface:
    texture = surface.texture
    if extent is not None:
        texture = _finite_part(texture, extent)
    field = bake_texture(
        texture,
        max(surface.max_depth, reach),
        surface.parameter("continuity"),
        resolution=resolution,
        goal=bake_goal,
        progress=progress,
    )
    low, top = texture.extremes
    count = bisect_right(field.accuracy.depths, top - low + surface.max_depth)
    share = min(field.accuracy.shares[: max(count, 1)])
    if resolution is not None and share > _MAX_SHARE:
        lost = f"would differ from law H by {100.0 * share:.0f} % of the texture's force"
        reason = f"is coarser than the texture: {lost} at every depth"
        raise ParameterError("resolution", reason, resolution)
    return surface.to_texture(field)


def bake_mesh(
    path: str | os.PathLike[str],
    unit: str | None = None,
    max_depth: float | None = None,
    resolution: float | None = None,
    *,
    continuity: float = 1.0,
    stiffness: float = DEFAULT_STIFFNESS,
    repair: bool = False,
    texture: TextureLike | None = None,
    texture_side: str = "+z",
    tip_radius: float | None = None,
    progress: Progress | None = None,
    **goal: Any,
) -> Surface:
    """Bake law H of a closed body as a potential field.

    Args:
        path: an STL, OBJ, PLY or glTF file.
        unit: unit of its coordinates, such as ``"mm"``.
        max_depth: depth down to which the force is that of law H [m]; deeper inside it falls to
            zero. By default 1 mm, or the greatest depth of the body if that is less.
        resolution: spacing of the nodes [m]; by default the coarsest one at which the force
            differs from exact H by the share, within the size.
        continuity: c of law H, at least 1.
        stiffness: [N/m].
        repair: whether faults that leave the inside undefined are repaired.
        texture: a texture to lay on the body, by which its surface is displaced along its normals;
            see :func:`~asperity.textures.meshes.lay_texture.lay_texture`.
        texture_side: the side on which it lies, ``"+x"`` to ``"-z"``.
        tip_radius: radius of a ball that probes the body, texture included, in place of a point
            [m]; the position is that of its centre, see
            :func:`~asperity.textures.meshes.dilate_body.dilate_body`.
        progress: called with the finished fraction, from 0 to 1.
        **goal: share, max_gain and max_bytes of :func:`bake`; the share is that of the RMS force.

    Returns:
        A surface with law H. The heights of its texture are those of the body seen from above, and
        ``texture.thin_regions`` are its parts thinner than twice the depth.

    Raises:
        ParameterError: a missing unit, or a depth, a resolution or a texture that does not fit the
            body.
        SurfaceFileError: a file that cannot be read, or a mesh whose inside is undefined.

    Reference:
        docs/theory/split.md.
    """
    body = load_mesh(path, unit, repair=repair)
    bake_goal = _bake_goal(**goal)
    if texture is not None:
        body = lay_texture(body, as_texture(texture), texture_side)
    if tip_radius is not None:
        body = dilate_body(body, tip_radius)
    field = bake_body(
        body, max_depth, continuity, resolution=resolution, goal=bake_goal, progress=progress
    )
    return Surface(field, "H", stiffness, field.max_depth, continuity=continuity)


def default_reach(stiffness: float, press: float = DEFAULT_PRESS) -> float:
    """Return the depth [m] below its least height down to which people press a surface, F/k.

    No point of the surface is lower, so that the mean normal force there is at least F. At most
    25 mm are returned.

    Args:
        stiffness: k [N/m].
        press: F [N]; no more than 5 N count.
    """
    return min(min(press, DEFAULT_PRESS) / stiffness, _MAX_REACH)


def _bake_goal(
    share: float = BakeGoal.share,
    max_gain: float | None = BakeGoal.max_gain,
    max_bytes: int = BakeGoal.max_bytes,
) -> BakeGoal:
    gain = math.inf if max_gain is None else check_positive("max_gain", max_gain)
    size = int(check_positive("max_bytes", max_bytes, "byte"))
    return BakeGoal(check_positive("share", share), gain, size)


def is_searched(surface: Surface) -> bool:
    """Return whether law H is rendered by a search: the texture has no closed form of it."""
    return surface.law.contact.has_potential_field and not surface.texture.finds_contacts


def rendered_surface(
    surface: Surface,
    rendering: str = FIELD,
    extent: Extent | None = None,
    progress: Progress = report_fraction,
    *,
    reach: float | None = None,
) -> Surface:
    """Return the surface as a loop renders it: law H baked where it would be searched.

    A field is made on first use and kept in the cache. A texture that never repeats is searched
    unless an extent is given.

    Args:
        surface: the surface.
        rendering: ``"field"`` or ``"search"``.
        extent: see :func:`bake`.
        progress: see :func:`bake`.
        reach: depth of the field below the least height [m], if that is more than ``max_depth``; by
            default that of 5 N at the stiffness of the surface. With a device, see
            :func:`~asperity.analysis.passivity.recommended_stiffness.render_on_device`.

    Raises:
        ParameterError: see :func:`bake`.
    """
    if rendering not in RENDERING.choices:
        RENDERING.validate(rendering)
    if rendering == SEARCH or not is_searched(surface):
        return surface
    texture = surface.texture
    if not (texture.domain.periodic or texture.is_mirrored or extent is not None):
        return surface
    depth = max(surface.max_depth, reach or default_reach(surface.stiffness))
    content = texture.digest and content_digest(
        texture.digest, depth, surface.parameter("continuity"), *(extent or ())
    )

    def compute() -> Texture:
        goal = BakeGoal(max_bytes=_AUTOMATIC_BYTES)
        return _bake(surface, depth, goal, extent=extent, progress=progress).texture

    return surface.to_texture(get_or_compute("field", content, compute))


def coarsened_surface(surface: Surface, share: float) -> Surface | None:
    """Return a surface with about a share of the nodes of its texture along each axis of the plane.

    A field is baked again within the square of the share of its size.

    Returns:
        The surface, whose last step of preparation states what is lost; ``None`` for a texture
        without nodes, or with too few left, and for the field of a body, which has no mesh.
    """
    field: Any = surface.texture
    if not field.baked_numbers:
        texture = field.coarsened(share)
        return texture and surface.to_texture(texture, surface.max_depth)
    if field.is_body:  # its mesh is not part of the field
        return None
    goal = BakeGoal(max_bytes=int(share**2 * field.bytes))
    try:
        texture = bake_texture(field.source, field.max_depth, field.continuity, goal=goal)
    except ParameterError:  # the coarsest is larger
        return None
    return surface.to_texture(texture)


@dataclass(frozen=True)
class Rendering(Serializable):
    """How a loop renders a law, and how far that may be from the law.

    Attributes:
        method: ``"formula"``, ``"field"`` or ``"search"``.
        samples: samples of the stroke on which a search was tried; 0 for none.
        truncated: samples in which it was truncated.
        error_bound: greatest error bound of a truncated search [m]; of the force over the
            stiffness for H, of the distance to the closest point for D and E.
        speed: of the stroke [m/s].
        update_rate: of the loop [Hz].
    """

    method: str
    samples: int = 0
    truncated: int = 0
    error_bound: float = 0.0
    speed: float = 0.0
    update_rate: float = 0.0

    def sentence(self, law: Law) -> str:
        """Return what the search does to statements about the law; empty for no search."""
        if self.method != SEARCH:
            return ""
        stroke = f"{self.samples} samples of a stroke at {format_quantity(self.speed, 'm/s')}"
        text = f"Law {law.letter} finds its contact by a search within the time of a sample:"
        if not self.truncated:
            return f"{text} it was complete in all of {stroke}"
        part = self.truncated / self.samples
        bound = format_quantity(self.error_bound, "m")
        return (
            f"{text} it was truncated in {100.0 * part:.2g} % of {stroke}, with an error of up to "
            f"{bound} in the contact; there, statements about the law do not hold for its rendering"
        )


def assess_rendering(
    surface: Surface, speed: float = DEFAULT_SPEED, update_rate: float | None = None
) -> Rendering:
    """Return how a loop renders a surface; a search is tried on a stroke.

    The stroke runs along the scan line of the texture at the greatest height minus ``max_depth``.

    Args:
        surface: the surface as it is rendered.
        speed: of the stroke [m/s].
        update_rate: of the loop [Hz]; 1 kHz where it is not known.
    """
    texture = surface.texture
    contact = surface.law.contact
    if texture.baked_numbers:
        return Rendering(FIELD)
    if not contact.has_warm_start or texture.finds_contacts:
        return Rendering(FORMULA)
    update_rate = update_rate or 1000.0
    shape = surface.max_depth, *surface.law_parameters.values(), speed, update_rate
    content = texture.digest and content_digest(texture.digest, contact.name, *shape)
    samples, truncated, bound = get_or_compute(
        "search", content, lambda: _try_search(surface, speed / update_rate)
    )
    return Rendering(SEARCH, samples, truncated, bound, speed, update_rate)


def _try_search(surface: Surface, step: float) -> tuple[int, int, float]:
    """Return the samples of a stroke, those with a truncated search, and its error bound [m]."""
    line = surface.texture.scan_line()
    top = surface.texture.extremes[1]
    along = step * np.arange(_STROKE_SAMPLES)
    path = np.full((_STROKE_SAMPLES, 3), top - surface.max_depth)
    path[:, :2] = line.start + along[:, None] * line.direction
    state = new_warm_start(surface.law.contact.max_evaluations)
    surface.trace(path, state)
    return _STROKE_SAMPLES, int(state[TRUNCATED_TICKS]), float(state[MAX_ERROR_BOUND])


def rendering_sentences(surface: Surface) -> tuple[str, ...]:
    """Return how a surface is rendered, where law H was baked: its field, and range of force."""
    texture: Any = surface.texture
    if not texture.baked_numbers:
        return ()
    return (*texture.preparation[-1:], *_force_range(surface, texture.accuracy.depths))


def _force_range(surface: Surface, depths: Sequence[float]) -> tuple[str, ...]:
    """Return the mean forces, of the field itself, between which its error is known."""
    texture = surface.texture
    if texture.is_body or not depths:
        return ()
    field = Surface(texture, "H", surface.stiffness, continuity=surface.parameter("continuity"))
    size = (_PRESS_POINTS, len(texture.domain.spans))
    xy = texture.domain.points(np.random.default_rng(0).uniform(size=size))
    ends = []
    for depth in (min(depths), max(depths)):
        points = np.column_stack([xy, np.full(len(xy), texture.extremes[1] - depth)])
        ends.append(format_quantity(float(field.force(points)[:, 2].mean()), "N"))
    k = format_stiffness(surface.stiffness)
    return (f"At {k} its error is known for presses of {ends[0]} to {ends[1]}",)


def _finite_part(texture: Texture, extent: Extent) -> Texture:
    """Return the spline through a texture on a rectangle from the origin, mirrored at its border.

    Raises:
        ParameterError: for an extent that is not two positive lengths.
    """
    if len(extent) != 2:
        raise ParameterError("extent", "must be (width, depth) [m]", extent)
    sides = [check_positive("extent", side, "m") for side in extent]
    slope, hessian = texture.bounds
    wave = 2.0 * math.pi * slope / hessian if hessian > 0.0 else min(sides)
    counts = [max(math.ceil(side / wave * _NODES_PER_WAVE), 8) for side in sides]
    x = np.linspace(0.0, sides[0], counts[0] + 1)
    y = np.linspace(0.0, sides[1], counts[1] + 1)
    points = np.stack(np.meshgrid(x, y), axis=-1).reshape(-1, 2)
    heights = texture.height(points).reshape(len(y), len(x))
    pitch = (sides[0] / counts[0], sides[1] / counts[1])
    return HeightMap(heights, pitch, preparation=texture.preparation)
