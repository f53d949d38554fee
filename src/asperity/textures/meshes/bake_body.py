"""Law H of a closed body, baked as a potential field."""

from __future__ import annotations

import numpy as np

from asperity.contacts import split_optimality, split_solver
from asperity.core.checks import FloatArray, check_positive
from asperity.core.errors import ParameterError, SurfaceFileError
from asperity.measured.lengths import format_length, format_lengths
from asperity.textures.fields import bake
from asperity.textures.fields.field_certificate import Progress
from asperity.textures.fields.field_grid import FieldGrid
from asperity.textures.fields.node_potentials import compute_potentials
from asperity.textures.fields.potential_field import PotentialField, ThinRegion
from asperity.textures.meshes import mesh_potential, triangle_tree
from asperity.textures.meshes.mesh_body import (
    INTERSECTING,
    TOUCHING,
    MeshBody,
    MeshFault,
    make_fault,
)
from asperity.textures.meshes.mesh_potential import (
    DEEPEST,
    FAULT_Z,
    GREATEST_WINDING,
    HEIGHT,
    LEAST_WINDING,
    THIN,
    THIN_Z,
    BodyLaw,
)
from asperity.textures.spline.spline_texture import HeightMap

# Greatest default of the depth to which the field of a body is exact [m].
DEFAULT_DEPTH = 1e-3
# Greatest depth [m] with which a body is not felt: 3 mN at 3000 N/m.
_LEAST_DEPTH = 1e-6
# RMS error of the force at every depth, over its RMS, of a field that has hardly any force.
_GREATEST_SHARE = 0.9
DEFAULT_GOAL = bake.BakeGoal()
_MOST_CROSSINGS = 4096
_LEAST_CELLS = 4
_DIGITS = 12  # of places and thickness of thin parts [m]
# Duality gap in squared spacings: it adds less than 4 times as much to the gain.
_GAP = 1e-4
# Gap below which parts touch over the size of the body, and radius around a sample over the gap.
_TOUCHING_GAP = 1e-6
_TOUCHING_RADIUS = 30.0
_TOUCHING_SAMPLES = 2**14
_TOUCHING_DIRECTIONS = 64


def bake_body(
    body: MeshBody,
    max_depth: float | None = None,
    continuity: float = 1.0,
    *,
    resolution: float | None = None,
    goal: bake.BakeGoal = DEFAULT_GOAL,
    progress: Progress | None = None,
) -> PotentialField:
    """Return law H of a closed body as a baked potential field.

    The potential is exact, up to the spline, where the probe is at most ``max_depth`` deep. Deeper
    inside the force falls to zero, at about e times this depth. There is no force outside. The
    source of the field is the height map of the body seen from above, +z.

    Args:
        body: the body.
        max_depth: [m]; by default 1 mm, or the greatest depth of the body if that is less.
        continuity: c of law H, at least 1.
        resolution: spacing of the nodes [m]; by default the coarsest one that reaches the goal,
            where the share is that of the RMS force.
        goal: what the field must reach.
        progress: called with the finished fraction, from 0 to 1.

    Raises:
        ParameterError: for a depth that the body does not have, a resolution coarser than the body,
            or a field that is larger than allowed, or without a force that is felt.
        SurfaceFileError: if the mesh overlaps itself, or parts of it touch and are not united.
    """
    if not continuity >= 1.0:
        raise ParameterError("continuity", "must be at least 1 for a body", continuity)
    depth = DEFAULT_DEPTH if max_depth is None else check_positive("max_depth", max_depth, "m")
    loops = BodyLoops(body, BodyLaw(continuity, depth, np.inf))
    _check_faults(body, loops.find_contacts())
    deepest = loops.sample_depth()
    if max_depth is None and deepest > 0.0:
        depth = min(depth, deepest)
    if depth < _LEAST_DEPTH:
        reason = f"{format_length(depth)} is too small to be felt: check the unit of the body"
        raise ParameterError("max_depth", reason)
    plan = _BodyPlan(body, depth, continuity, goal)
    plan.deepest = deepest
    if resolution is None:
        return _checked_force(plan.bake_coarsest(progress))
    return _checked_force(plan.bake(check_positive("resolution", resolution, "m"), progress))


def _checked_force(field: PotentialField) -> PotentialField:
    if min(field.accuracy.shares) > _GREATEST_SHARE:
        nodes = f"nodes {format_length(field.resolution)} apart give hardly any force"
        reason = f"{format_length(field.max_depth)} is too small: {nodes}; check the unit"
        raise ParameterError("max_depth", reason)
    return field


def _check_faults(body: MeshBody, faults: list[MeshFault]) -> None:
    if faults:
        raise SurfaceFileError(f"{body.name} has no defined inside: {faults[0]}")


class BodyLoops:
    """The compiled loops on one body, and what they find at the columns of a grid."""

    def __init__(self, body: MeshBody, law: BodyLaw) -> None:
        from asperity.kernels.fuse import fuse_module

        self._loops = fuse_module(mesh_potential, triangle_tree, split_solver, split_optimality)
        self.body = body
        self.law = law
        self._tolerance = 1e-9 * float(np.ptp(np.array(body.box), axis=0).max())

    def evaluate(self, points: FloatArray) -> FloatArray:
        """Return potential [m²], force over stiffness [m] and depth [m] at points, (n, 5)."""
        out = np.empty((len(points), 5))
        crossings = np.empty((_MOST_CROSSINGS, 2))
        self._loops.point_batch(points, self.law, out, crossings, self.body.tree)
        return out

    def columns(self, xy: FloatArray, z: FloatArray, margin: float, out: FloatArray) -> FloatArray:
        """Write the depths of columns of nodes; return the summary of each, (n, 7)."""
        summary = np.zeros((len(xy), 7))
        crossings = np.empty((_MOST_CROSSINGS, 2))
        self._loops.column_batch(
            np.ascontiguousarray(xy),
            np.ascontiguousarray(z),
            self.law,
            self._tolerance,
            margin,
            out,
            summary,
            crossings,
            self.body.tree,
        )
        return summary

    def sample_depth(self) -> float:
        """Return the greatest distance from the outside [m] found on a coarse lattice."""
        lower, upper = self.body.box
        ticks = [np.linspace(a, b, 19)[1:-1] for a, b in zip(lower, upper, strict=True)]
        points = np.stack(np.meshgrid(*ticks, indexing="ij"), axis=-1).reshape(-1, 3)
        return float(self.evaluate(points)[:, 4].max())

    def find_contacts(self) -> list[MeshFault]:
        """Return where parts of the mesh touch.

        There, and where they overlap, a point just outside of a part and all around it are inside,
        unlike at a concave edge.
        """
        gap = _TOUCHING_GAP * float(np.ptp(np.array(self.body.box), axis=0).max())
        places = self.surface_probes(np.full(_TOUCHING_SAMPLES, -gap))
        places = places[self.evaluate(places)[:, 4] > 0.0]
        around = np.random.default_rng(1).normal(size=(_TOUCHING_DIRECTIONS, 1, 3))
        around *= _TOUCHING_RADIUS * gap / np.linalg.norm(around, axis=2, keepdims=True)
        depths = self.evaluate((places + around).reshape(-1, 3))[:, 4]
        return make_fault(TOUCHING, places[(depths.reshape(len(around), -1) > 0.0).all(axis=0)])

    def surface_probes(self, depths: FloatArray) -> FloatArray:
        """Return random points of the surface, moved inward by depths [m], (n, 3) [m]."""
        # The areas of all triangles of a large mesh would take much memory.
        rng = np.random.default_rng(0)
        step = 1 + len(self.body.triangles) // 2**16
        corners = self.body.triangles[::step]
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        areas = np.linalg.norm(normals, axis=1)
        chosen = np.searchsorted(np.cumsum(areas), rng.uniform(0.0, areas.sum(), len(depths)))
        chosen = np.minimum(chosen, len(areas) - 1)
        weights = rng.dirichlet(np.ones(3), len(chosen))
        inward = -normals[chosen] / np.maximum(areas[chosen], 1e-300)[:, None]
        points = np.einsum("nk,nkd->nd", weights, corners[chosen])
        return np.asarray(points + inward * depths[:, None])

    def set_tolerance(self, grid: FieldGrid) -> None:
        """Set the duality gap [m²] that suits the nodes of a grid."""
        self.law = self.law._replace(tolerance=_GAP * grid.spacing[0] ** 2)

    def prepare(self, grid: FieldGrid) -> None:
        """Set the grid, and check that no column of nodes finds the mesh overlapping itself."""
        self.grid = grid
        self.set_tolerance(grid)
        width, depth, _levels = grid.node_counts
        index = np.stack(np.unravel_index(np.arange(width * depth), (width, depth)), axis=-1)
        self._xy = grid.positions(index)
        empty = np.zeros((len(self._xy), 0))
        self._summary = self.columns(self._xy, np.empty(0), grid.margin, empty)
        wrong = (self._summary[:, LEAST_WINDING] < 0.0) | (self._summary[:, GREATEST_WINDING] > 1.0)
        places = np.column_stack([self._xy, self._summary[:, FAULT_Z]])[wrong]
        _check_faults(self.body, make_fault(INTERSECTING, places))

    def record_columns(self, xy: FloatArray, z: FloatArray, margin: float, out: FloatArray) -> None:
        """Write the depths of columns of the grid, and keep their summaries."""
        steps = np.rint((xy - self.grid.start) / self.grid.spacing[0]).astype(np.intp)
        rows = steps[:, 0] * self.grid.node_counts[1] + steps[:, 1]
        self._summary[rows] = self.columns(xy, z, margin, out)

    def upper_envelope(
        self, body: MeshBody, thin: tuple[ThinRegion, ...]
    ) -> tuple[HeightMap, float]:
        """Return the body seen from above, its least height around it, and its greatest depth."""
        deepest = float(self._summary[:, DEEPEST].max())
        heights = self._summary[:, HEIGHT].reshape(self.grid.node_counts[:2]).T
        missing = ~np.isfinite(heights)
        if missing.all() or deepest == 0.0:
            raise ParameterError("resolution", "is coarser than the body", self.grid.spacing[0])
        filled = np.where(missing, heights[~missing].min(), heights)
        sides = format_lengths([float(side) for side in np.ptp(np.array(body.box), axis=0)])
        text = f"body {body.name}, seen from above: {len(body.triangles)} triangles, {sides}"
        notes = [*body.notes, *(f"accepted: {fault}" for fault in body.faults)]
        notes += [f"repaired: {fault}" for fault in body.repaired]
        if thin:
            half = format_length(thin[0].half_thickness)
            place = ", ".join(map(format_length, thin[0].at))
            notes.append(
                f"parts thinner than twice the depth: {len(thin)}, the thinnest at ({place});"
                f" pressed deeper than {half} there, the probe is pulled to the other side"
            )
        envelope = HeightMap(
            filled,
            self.grid.spacing[:2],
            origin=self.grid.start.tolist(),
            preparation=(text, *notes),
            filled_mask=missing if missing.any() else None,
        )
        return envelope, deepest

    def thin_map(self, max_depth: float) -> FloatArray:
        """Return half thickness [m] below the depth, but for rounding; NaN elsewhere."""
        half = self._summary[:, THIN].reshape(self.grid.node_counts[:2]).T
        return np.where(half < (1.0 - 1e-9) * max_depth, np.round(half, _DIGITS), np.nan)

    def thin_regions(self, thin_map: FloatArray) -> tuple[ThinRegion, ...]:
        """Return the connected parts of a map, the thinnest first."""
        from scipy import ndimage

        labels, count = ndimage.label(np.isfinite(thin_map.T), structure=np.ones((3, 3)))
        regions = []
        for label in range(1, count + 1):
            rows = np.flatnonzero(labels.ravel() == label)
            thinnest = rows[np.argmin(self._summary[rows, THIN])]
            numbers = [*self._xy[thinnest], *self._summary[thinnest, [THIN, THIN_Z]]]
            x, y, half, z = np.round(numbers, _DIGITS).tolist()
            regions.append(ThinRegion((x, y, z), half, len(rows)))
        return tuple(sorted(regions, key=lambda region: region.half_thickness))


class _BodyPlan(bake.BakePlan):
    """A field of a body to bake; ``deepest`` is a depth [m] that it is known to have."""

    deepest = 0.0

    def __init__(
        self, body: MeshBody, max_depth: float, continuity: float, goal: bake.BakeGoal
    ) -> None:
        self.max_depth = max_depth
        self.continuity = continuity
        self.goal = goal
        self.gain = continuity
        self.lipschitz = continuity + 1.0
        self._law_arguments = (1.0, 0.0, 1.0, max_depth, 0.0, continuity)
        self.loops = BodyLoops(body, BodyLaw(continuity, max_depth, 0.0))
        thinnest = float(np.ptp(np.array(body.box), axis=0).min())
        self.coarsest = min(thinnest / _LEAST_CELLS, body.coarsest)
        self.onset_limit = np.inf  # it would ask of edges what few bodies need
        depths = max_depth * np.geomspace(bake.LEAST_DEPTH, 1.0, bake.DEPTHS)
        rows = np.repeat(np.arange(bake.DEPTHS), bake.PROBES)
        points = self.loops.surface_probes(depths[rows])
        inside = self.exact_depth(points) > 0.0
        if not inside.any():
            raise ParameterError("max_depth", "finds no point inside the body", max_depth)
        self.set_probes(points[inside], rows[inside], depths)
        # In the mean of forces all around a body they cancel.
        sizes = np.linalg.norm(self.force, axis=1)
        self.presses = np.bincount(self.rows, sizes) / np.bincount(self.rows)
        points = self.loops.surface_probes(np.full(bake.PROBES, bake.SHALLOW * max_depth))
        self.set_shallow(points[self.exact_depth(points) > 0.0])

    def exact_force(self, points: FloatArray) -> FloatArray:
        """See :class:`BakePlan`."""
        return self.loops.evaluate(points)[:, 1:4]

    def exact_depth(self, points: FloatArray) -> FloatArray:
        """See :class:`BakePlan`."""
        potential = self.loops.evaluate(points)[:, 0]
        return np.sqrt(np.maximum(2.0 * potential, 0.0))

    def trial(self, resolution: float, progress: Progress | None) -> PotentialField:
        """See :class:`BakePlan`."""
        grid = self.checked_grid(resolution)
        loops = self.loops
        loops.prepare(grid)
        part = bake.scale_progress(progress, 0.05, 0.95)
        depths = compute_potentials(loops.record_columns, loops.grid, part)
        thin_map = loops.thin_map(self.max_depth)
        thin = loops.thin_regions(thin_map)
        self.texture, deepest = loops.upper_envelope(loops.body, thin)
        deepest = max(self.deepest, deepest)
        if self.max_depth > deepest:
            reason = f"must be at most {format_length(deepest)}, the greatest depth of the body"
            raise ParameterError("max_depth", reason, self.max_depth)
        field = self.measure(depths, grid)
        field.thin_regions = thin
        field.thin_map = thin_map if thin else None
        return field

    def foresee(
        self,
        tried: list[tuple[float, FloatArray]],
        limits: list[float],  # noqa: ARG002 - of samples, which are not taken of a body
    ) -> float:
        """See :class:`BakePlan`; from the errors of the trials."""
        return bake.next_resolution(tried)

    def grid(self, resolution: float) -> FieldGrid:
        """Return the grid around the body.

        Smoothed depths are means over points around a place, of a standard deviation of at most 2.0
        spacings after 15 passes: half a spacing outside of the box they are still negative.
        """
        return FieldGrid.around(*self.loops.body.box, min(resolution, self.coarsest))

    def checked_grid(self, resolution: float) -> FieldGrid:
        """Return the grid of a resolution that suits the body and the size allowed."""
        if resolution > self.coarsest * (1.0 + 1e-9):
            textured = self.coarsest == self.loops.body.coarsest
            what = "shortest wave of the texture" if textured else "thinnest side of the body"
            reason = f"must be at most {self.coarsest:.3g} m, a quarter of the {what}"
            raise ParameterError("resolution", reason, resolution)
        grid = self.grid(resolution)
        self.check_size(grid)
        return grid
