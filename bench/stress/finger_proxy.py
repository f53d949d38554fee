"""The finger-proxy (god-object) beside law H baked, on the same closed meshes.

``python -m bench.stress.finger_proxy`` moves a probe along random closed paths that stay near a
corner of a block, and through a thin plate. The proxy is that of Zilles and Salisbury (1995), a
point as in Ruspini, Kolarov and Khatib (1997) with a radius of zero: it moves from its last place
towards the probe, along at most three planes that it meets. It searches all triangles of its small
meshes, so that its time is no measure of a proxy with a tree.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numba
import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.core.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.meshes.bake_body import bake_body
from asperity.textures.meshes.mesh_body import MeshBody
from bench.speed import cases
from bench.speed.timing import seconds

LOOPS, TICKS = 100, 1000
SIDES = {"block of 4 mm": (4e-3, 4e-3, 4e-3), "plate of 0.4 mm": (4e-3, 4e-3, 0.4e-3)}
DEPTH = 0.5e-3
_CLEAR = 1e-10


@numba.njit
def proxy_forces(path: Any, corners: Any, normals: Any, out: Any) -> None:
    """Write the vectors from the probe to the proxy [m] along a path that starts outside."""
    proxy = path[0].copy()
    used = np.zeros((3, 3))
    for n in range(len(path)):
        goal = path[n].copy()
        count = 0
        for _step in range(4):
            move = goal - proxy
            first, face = 1.0, -1
            for t in range(len(corners)):
                speed = normals[t] @ move
                gap = normals[t] @ (proxy - corners[t, 0])
                if speed >= 0.0 or gap < -_CLEAR:
                    continue
                s = max(-(gap - _CLEAR) / speed, 0.0)
                if s >= first:
                    continue
                hit = proxy + s * move
                inside = True
                for k in range(3):
                    side = corners[t, (k + 1) % 3] - corners[t, k]
                    inside &= np.cross(side, hit - corners[t, k]) @ normals[t] >= -1e-13
                if inside:
                    first, face = s, t
            proxy = proxy + first * move
            if face < 0 or count == 3:
                break
            # The goal is the place closest to the probe on all planes met so far.
            row = normals[face].copy()
            for k in range(count):
                row -= (row @ used[k]) * used[k]
            size = np.sqrt(row @ row)
            if size < 1e-6:
                break
            used[count] = row / size
            count += 1
            goal = path[n].copy()
            for k in range(count):
                goal -= (used[k] @ (goal - proxy)) * used[k]
        out[n] = proxy - path[n]


def block(sides: tuple[float, float, float]) -> MeshBody:
    """Return a block whose centre is the origin."""
    from trimesh.creation import box

    mesh = box(sides)
    return MeshBody(np.array(mesh.vertices)[np.array(mesh.faces)], "block")


def closed_paths(sides: tuple[float, float, float]) -> list[FloatArray]:
    """Return closed paths (n, 3) [m] around a corner, from outside and back, half of them inside.

    They are sums of two harmonics and reach ``DEPTH`` below the top.
    """
    rng = np.random.default_rng(cases.SEED)
    turn = np.linspace(0.0, 2.0 * np.pi, TICKS + 1)[:, None]
    paths = []
    for _loop in range(LOOPS):
        wave = rng.uniform(-0.5, 0.5, 3) * np.sin(turn) + rng.uniform(-0.3, 0.3, 3) * np.sin(
            2.0 * turn
        )
        lift = np.array([1.0, 1.0, 1.0]) * (0.1 - 0.55 * (1.0 - np.cos(turn)))
        corner = 0.5 * np.array(sides)
        paths.append(np.ascontiguousarray(corner + (wave + lift) * DEPTH))
    return [path for path in paths if (path[0] > 0.5 * np.array(sides)).all()]


def measure(path: FloatArray, force: FloatArray) -> tuple[float, float]:
    """Return the greatest step of force over that of the path, and the work on the hand [m²]."""
    step = np.diff(path, axis=0)
    jump = np.linalg.norm(np.diff(force, axis=0), axis=1) / np.linalg.norm(step, axis=1)
    work = np.einsum("nk,nk->", 0.5 * (force[1:] + force[:-1]), step)
    return float(jump.max()), float(work)


def main() -> None:
    table = Table("body", "law", "step of force / k·step", "gain mean", "greatest", "µs", box=None)
    for name, sides in SIDES.items():
        body, paths = block(sides), closed_paths(sides)
        corners = np.ascontiguousarray(body.triangles)
        normals = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        field = bake_body(body, None if sides[2] < 2 * DEPTH else DEPTH, resolution=5e-5)
        surface = Surface(field, "H", 1.0, field.max_depth)
        buffer = np.empty_like(paths[0])

        def proxy(
            path: FloatArray, out: FloatArray = buffer, mesh: Any = (corners, normals)
        ) -> Any:
            proxy_forces(path, *mesh, out)
            return out.copy()

        for law, force in (("proxy", proxy), ("H baked", surface.force)):
            force(paths[0])
            found = np.array([measure(path, force(path)) for path in paths])
            time = min(seconds(partial(force, paths[0])) for _turn in range(5))
            gains = found[:, 1] / DEPTH**2
            table.add_row(
                name,
                law,
                f"{found[:, 0].max():.1f}",
                f"{gains.mean():.1e}",
                f"{gains.max():.1e}",
                f"{time / len(paths[0]) * 1e6:.2f}",
            )
        pressed = np.column_stack([np.zeros((TICKS, 2)), np.linspace(0.3e-3, -1e-3, TICKS)])
        pressed[:, 2] += 0.5 * sides[2]
        down = [force(pressed)[:, 2] for force in (proxy, surface.force)]
        text = [f"{np.min(values) * 1e6:.0f}" for values in down]
        print(
            f"{name}, pressed through from above: least vertical force over k [um]: "
            f"proxy {text[0]}, H {text[1]}"
        )
    console = Console(width=100, highlight=False)
    console.print(table)
    console.print(f"gain: work on the hand per closed path over k·({DEPTH * 1e3:g} mm)²")


if __name__ == "__main__":
    main()
