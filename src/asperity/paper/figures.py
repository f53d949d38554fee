"""Data of the paper's figures 2 and 3, computed from the laws."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from asperity.analysis.energy.field_energy import loop_work
from asperity.core.checks import FloatArray
from asperity.core.files import Serializable
from asperity.paper.cases import PAPER_LAWS, SCANNING
from asperity.surface import Surface

_COLUMNS = 33
_ROWS = 13
_PROFILE = 401
_HANDLE_DEPTH = 0.6e-3  # of the handles in figure 2 [m]
_STEPS_PER_SEGMENT = 400  # on each leg of a path of figure 3
_EQUATIONS = {"B": "(12)", "F": "(27)", "G": "(29)"}  # that give the energies of figure 3


@dataclass(frozen=True)
class ForceField(Serializable):
    """One panel of figure 2: a law's force in the x-z plane.

    Attributes:
        law: its letter.
        name: in words.
        x: of the profile [m], shape (n,).
        height: of the texture there [m], shape (n,).
        points: of a grid [m], shape (rows, columns, 2), x and z.
        forces: at the grid [N], shape (rows, columns, 2), f_x and f_z; zero outside the body.
        handle_positions: two positions of the handle [m], shape (2, 2).
        handle_forces: [N], shape (2, 2).
    """

    law: str
    name: str
    x: FloatArray
    height: FloatArray
    points: FloatArray
    forces: FloatArray
    handle_positions: FloatArray
    handle_forces: FloatArray


@dataclass(frozen=True)
class LoopEnergy(Serializable):
    """One panel of figure 3: a closed path and the energy that a law gives along it.

    Attributes:
        law: its letter.
        name: in words.
        x: of the profile [m], shape (n,).
        height: of the texture there [m], shape (n,); zero for law F, whose path has no texture.
        vertices: of the path [m], shape (m, 2), x and z; the last is joined to the first.
        arc_length: length along the path [m], shape (p,).
        work: of the force on the probe up to there [J], shape (p,).
        energy: around the whole path [J], by quadrature.
        equation: of the paper that gives it; empty where it gives none.
    """

    law: str
    name: str
    x: FloatArray
    height: FloatArray
    vertices: FloatArray
    arc_length: FloatArray
    work: FloatArray
    energy: float
    equation: str


def _profile() -> tuple[FloatArray, FloatArray]:
    x = np.linspace(-0.25, 1.25, _PROFILE) * SCANNING.period
    return x, SCANNING.texture.height(np.column_stack([x, 0 * x]))


def _plane_force(surface: Surface, points: FloatArray) -> FloatArray:
    """Return (f_x, f_z) at points (n, 2); for law F while the handle slides towards +x."""
    probes = np.column_stack([points[:, 0], 0 * points[:, 0], points[:, 1]])
    if not surface.law.stateful:
        return surface.force(probes)[:, [0, 2]]
    dragged = np.tile([surface.max_deflection, 0.0], (len(probes), 1))
    return surface.force(probes, deflection=dragged)[:, [0, 2]]


def force_fields() -> tuple[ForceField, ...]:
    """Return the force fields of laws A to G on the texture of section V.B.

    Each with the force at two positions of the handle, on either flank of a crest.

    Reference:
        The paper's Fig. 2.

    Example:
        >>> [panel.law for panel in force_fields()]
        ['A', 'B', 'C', 'D', 'E', 'F', 'G']
    """
    x, height = _profile()
    length = SCANNING.period
    top = SCANNING.amplitude
    columns = np.linspace(0.0, 1.0, _COLUMNS) * length
    rows = np.linspace(-top - _HANDLE_DEPTH, top, _ROWS)
    points = np.stack(np.meshgrid(columns, rows), axis=-1)
    handles = np.array([[0.1, 0.0], [0.4, 0.0]]) * length - [0.0, _HANDLE_DEPTH]
    panels = []
    for law in PAPER_LAWS:
        surface = SCANNING.surface(law)
        forces = _plane_force(surface, points.reshape(-1, 2)).reshape(points.shape)
        handle_forces = _plane_force(surface, handles)
        panels.append(
            ForceField(law, surface.law.name, x, height, points, forces, handles, handle_forces)
        )
    return tuple(panels)


def loop_energies() -> tuple[LoopEnergy, ...]:
    """Return the paths of figure 3 and the energy along them, for the numbers of section V.B.

    C and D, which the figure does not show, go along the path of A: they return what they took.
    F is without texture, with the paper's h = 0.

    Reference:
        The paper's Fig. 3, (12), (27), (29).

    Example:
        >>> [f"{panel.law} {panel.energy * 1e3 + 0.0:.3f} mJ" for panel in loop_energies()][:2]
        ['A 0.320 mJ', 'B 0.147 mJ']
    """
    return tuple(map(_loop_energy, PAPER_LAWS))


def _loop_energy(law: str) -> LoopEnergy:
    x, height = _profile()
    surface = SCANNING.surface(law)
    if law == "F":
        surface = SCANNING.untextured_friction()
        height = np.zeros_like(height)
    corners = SCANNING.loop_path(law)
    legs = zip(corners, np.roll(corners, -1, axis=0), strict=True)
    share = np.linspace(0.0, 1.0, _STEPS_PER_SEGMENT, endpoint=False)[:, None]
    path = np.concatenate([*[a + share * (b - a) for a, b in legs], corners[:1]])
    step = np.diff(path, axis=0)
    # By midpoints: corners of the path may lie where the force jumps.
    dense = np.empty((2 * len(path) - 1, 3))
    dense[::2] = path
    dense[1::2] = path[:-1] + 0.5 * step
    work = np.sum(surface.trace(dense)[1::2] * step, axis=1)
    return LoopEnergy(
        law=law,
        name=surface.law.name,
        x=x,
        height=height,
        vertices=corners[:, [0, 2]],
        arc_length=np.concatenate([[0.0], np.cumsum(np.linalg.norm(step, axis=1))]),
        work=np.concatenate([[0.0], np.cumsum(work)]),
        energy=loop_work(surface, corners, 1e-10),
        equation=_EQUATIONS.get(law, ""),
    )
