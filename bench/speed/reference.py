"""The reference in C: built at run time with gcc, called through ctypes with whole arrays."""

from __future__ import annotations

import ctypes
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from asperity.core.checks import FloatArray
from asperity.textures import HeightMap, Sinusoid
from asperity.textures.texture import Texture
from bench.speed.c_programs import run_command
from bench.speed.cases import Kernel

LAWS = "WABCG"
KINDS = ("sinusoid", "heightmap")
FLAGS = ("-O3", "-shared", "-fPIC")
TOLERANCE = 1e-10  # of the norm; C and asperity must agree before they are timed

_FOLDER = Path(__file__).parent / "c"


class _Sinusoid(ctypes.Structure):
    _fields_ = [
        (name, ctypes.c_double) for name in ("a", "kx", "ky", "phase")
    ]  # ctypes reads a plain list


class _HeightMap(ctypes.Structure):
    _fields_ = [  # ctypes reads a plain list
        ("coefficients", ctypes.c_void_p),
        ("nx", ctypes.c_long),
        ("ny", ctypes.c_long),
        *((name, ctypes.c_double) for name in ("ix", "iy", "x0", "y0")),
        ("periodic", ctypes.c_long),
    ]


class DisagreementError(Exception):
    """C and asperity compute different numbers: nothing is timed."""


def build(directory: Path, extra: Sequence[str] = (), name: str = "reference.c") -> ctypes.CDLL:
    """Return a library of this folder's C, compiled into the directory."""
    source = _FOLDER / name
    library = directory / f"{source.stem}{'_'.join(['', *extra]).replace('=', '-')}.so"
    run_command("gcc", "-std=c11", *FLAGS, *extra, source, "-o", library, "-lm")
    return ctypes.CDLL(str(library))


def compiler() -> str:
    """Return the first line of ``gcc --version``."""
    return run_command("gcc", "--version").splitlines()[0]


def _texture(texture: Texture) -> ctypes.Structure:
    if isinstance(texture, Sinusoid):
        return _Sinusoid(*texture.arguments)
    assert isinstance(texture, HeightMap)
    coefficients, *numbers, periodic = texture.arguments[:6]
    rows, columns = coefficients.shape
    address = coefficients.ctypes.data
    return _HeightMap(address, columns - 3, rows - 3, *numbers, int(periodic))


@dataclass(frozen=True)
class Reference:
    """The C loops of one surface, with arrays of their own.

    Attributes:
        library: the compiled C.
        kernel: what it is measured against; keeps the texture alive.
        texture: the texture as C reads it.
        force: result [N], shape (n, 3).
        jacobian: result [N/m], shape (n, 3, 3).
    """

    library: ctypes.CDLL
    kernel: Kernel
    texture: ctypes.Structure
    force: FloatArray
    jacobian: FloatArray

    def _call(self, what: str, *results: FloatArray) -> None:
        surface, points = self.kernel.surface, self.kernel.points
        name = f"{surface.law.letter.lower()}_{surface.texture.kind}_{what}"
        self.library[name](
            ctypes.c_void_p(points.ctypes.data),
            ctypes.c_long(len(points)),
            ctypes.byref(self.texture),
            ctypes.c_double(surface.stiffness),
            *(ctypes.c_void_p(result.ctypes.data) for result in results),
        )

    def run_force(self) -> None:
        """Compute the forces."""
        self._call("force", self.force)

    def run_jacobian(self) -> None:
        """Compute forces and Jacobians."""
        self._call("jacobian", self.force, self.jacobian)


def reference(library: ctypes.CDLL, kernel: Kernel) -> Reference:
    """Return the C loops of the same surface at the same points."""
    texture = _texture(kernel.surface.texture)
    force, jacobian = np.zeros_like(kernel.force), np.zeros_like(kernel.jacobian)
    return Reference(library, kernel, texture, force, jacobian)


RUNS = ("run_force", "run_jacobian")


def check_agreement(kernel: Kernel, other: Reference, runs: Sequence[str] = RUNS) -> float:
    """Return the greatest difference, norm-wise; forces relative to k max(|h|, |z|).

    Raises:
        DisagreementError: if it exceeds :data:`TOLERANCE`.
    """
    surface, points = kernel.surface, kernel.points
    heights = np.abs(surface.texture.height(points[:, :2]))
    scale = surface.stiffness * np.maximum(heights, np.abs(points[:, 2]))
    differences = []
    for run in runs:
        for side in (kernel, other):
            side.force.fill(np.nan)
            side.jacobian.fill(np.nan)
            getattr(side, run)()
        gap = np.linalg.norm(kernel.force - other.force, axis=1)
        differences.append(float((gap / scale).max()))
    if "run_jacobian" in runs:
        gap = np.linalg.norm(kernel.jacobian - other.jacobian, axis=(1, 2))
        differences.append(float((gap / np.linalg.norm(other.jacobian, axis=(1, 2))).max()))
    worst = float(np.max(differences))  # NaN, a value never written, is passed on
    if not worst <= TOLERANCE:
        text = f"law {surface.law.letter} on {surface.texture.kind}: C differs by {worst:.1e}"
        raise DisagreementError(text)
    return worst
