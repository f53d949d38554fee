"""Generic probes inside the body, with exact forces and closest points in the x-z plane."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.kinds.fourier import Fourier

Potential = Callable[[Any, Any], Any]

_DIGITS = 25


@dataclass(frozen=True)
class ProbePoint:
    """A probe inside the body, with the quantities that the paper's formulas use, SI.

    Attributes:
        surface: law, texture and stiffness.
        x: x coordinate of the probe.
        z: z coordinate of the probe.
        contact_x: x coordinate of the contact point: that of the probe or of the closest point.
        h: height there.
        slope: h' there.
        second_derivative: h'' there.
    """

    surface: Surface
    x: float
    z: float
    contact_x: float
    h: float
    slope: float
    second_derivative: float

    @property
    def k(self) -> float:
        """κ₀ [N/m]."""
        return self.surface.stiffness

    @property
    def d(self) -> float:
        """The paper's penetration d^z = p^z - h, negative inside."""
        return self.z - self.h

    @property
    def from_closest_point(self) -> FloatArray:
        """Vector from the closest point to the probe [m]."""
        return np.array([self.x - self.contact_x, self.z - self.h])

    @property
    def distance(self) -> float:
        """|p - p_h| [m]."""
        return math.hypot(*self.from_closest_point)

    def profile(self) -> Callable[[Any, int], Any]:
        """Return the function h(x, order of the derivative) in mpmath."""
        return _profile(self.surface)

    def force(self) -> FloatArray:
        """Return (f_x, f_z) by the definition in 25 digits [N]."""
        from asperity.paper.reference import exact_force

        exact = exact_force(self.surface, [self.x, 0.0, self.z], digits=_DIGITS)
        return np.array([float(exact[0]), float(exact[2])])

    def jacobian(self) -> FloatArray:
        """Return the Jacobian in x and z by central differences of the definition [N/m]."""
        from asperity.paper.reference import exact_jacobian

        exact = exact_jacobian(self.surface, [self.x, 0.0, self.z], digits=_DIGITS)
        return np.array([[float(exact[i, j]) for j in (0, 2)] for i in (0, 2)])

    def compiled_force(self) -> FloatArray:
        """Return (f_x, f_z) by the compiled kernel [N]."""
        return np.asarray(self.surface.force([[self.x, 0.0, self.z]])[0, [0, 2]])

    def compiled_jacobian(self) -> FloatArray:
        """Return the Jacobian in x and z by the compiled kernel [N/m]."""
        whole = self.surface.jacobian([[self.x, 0.0, self.z]])[0]
        return np.asarray(whole[::2, ::2])

    def references(self, quantity: str) -> tuple[ArrayLike, ArrayLike]:
        """Return a "force", "jacobian" or "norm" by the definition and by the kernel."""
        if quantity == "force":
            return self.force(), self.compiled_force()
        if quantity == "jacobian":
            return self.jacobian(), self.compiled_jacobian()
        definition, kernel = self.norms()
        return definition, kernel

    def norms(self) -> FloatArray:
        """Return ‖J‖ by the definition and by the kernel [N/m], shape (2,)."""
        both = [self.jacobian(), self.compiled_jacobian()]
        return np.asarray(np.linalg.norm(both, 2, axis=(1, 2)))


def generic_profile(seed: int = 5) -> Fourier:
    """Return h(x) of three waves in arbitrary phases, without symmetry that could hide an error."""
    draw = np.random.default_rng(seed)
    base = 2.0 * math.pi / draw.uniform(1e-3, 3e-3)
    waves = base * np.array([1.0, 2.0, 3.0])
    slopes = draw.uniform(0.2, 0.5, 3)
    return Fourier(slopes / waves, waves, draw.uniform(0.0, 6.0, 3))


def generic_probes(law: str, count: int = 4, seed: int = 5) -> Iterator[ProbePoint]:
    """Yield generic probes inside the body of a generic profile, with a unique closest point.

    Depths reach 0.7 of the least radius of curvature, so that curvature matters.
    """
    texture = generic_profile(seed)
    surface = Surface(texture, law, stiffness=731.0)
    profile = _profile(surface)
    draw = np.random.default_rng(seed)
    radius = 1.0 / texture.bounds[1]
    for _ in range(count):
        contact = draw.uniform(0.0, 3e-3)
        h = float(profile(contact, 0))
        slope = float(profile(contact, 1))
        depth = radius * draw.uniform(0.2, 0.7)
        size = math.hypot(1.0, slope)
        x = contact + depth * slope / size
        z = h - depth / size
        if law in "FG":
            z = -depth
        at = float(find_closest_point(surface, x, z)[0]) if law in "DE" else x
        derivatives = [float(profile(at, order)) for order in (0, 1, 2)]
        yield ProbePoint(surface, x, z, at, *derivatives)


def _profile(surface: Surface) -> Callable[[Any, int], Any]:
    height = surface.texture.exact_height()
    return lambda x, order: height(x, 0.0, order, 0)


def find_closest_point(surface: Surface, x: Any, z: Any, digits: int = _DIGITS) -> tuple[Any, Any]:
    """Return the closest point (p_h^x, p_h^z) in mpmath, by a scan and secants."""
    import mpmath

    profile = _profile(surface)
    with mpmath.workdps(digits):
        reach = 4.0 * surface.texture.peak_to_valley
        grid = float(x) + np.linspace(-reach, reach, 4001)
        heights = surface.texture.height(np.column_stack([grid, 0 * grid]))
        start = float(grid[np.argmin((grid - float(x)) ** 2 + (heights - float(z)) ** 2)])

        def slope_of_distance(at: Any) -> Any:
            return at - x + (profile(at, 0) - z) * profile(at, 1)

        closest = mpmath.findroot(slope_of_distance, (start, start + 1e-9))
        return closest, profile(closest, 0)


def numerical_gradient(potential: Potential, at_x: float, at_z: float) -> list[float]:
    """Return the gradient by central differences in 60 digits."""
    import mpmath

    with mpmath.workdps(60):
        return [
            float(mpmath.diff(potential, (at_x, at_z), order, h=1e-20))
            for order in ((1, 0), (0, 1))
        ]


def _closest_point_gradient(probe: ProbePoint, axis: int) -> list[float]:
    def coordinate(x: Any, z: Any) -> Any:
        return find_closest_point(probe.surface, x, z, 60)[axis]

    return numerical_gradient(coordinate, probe.x, probe.z)


@dataclass(frozen=True)
class ClosestPointDerivatives:
    """Derivatives of the closest point by the probe position, with force and Jacobian of law D.

    Attributes:
        probe: the probe.
        derivatives: ∂(p_h^x, p_h^z)/∂(p^x, p^z), shape (2, 2).
        force: force of D [N], shape (2,).
        jacobian: Jacobian of D [N/m], shape (2, 2).
    """

    probe: ProbePoint
    derivatives: FloatArray = field(compare=False)
    force: FloatArray = field(compare=False)
    jacobian: FloatArray = field(compare=False)


def closest_point_derivatives(count: int = 4) -> list[ClosestPointDerivatives]:
    """Return derivatives of the closest point at generic probes, three entries for each probe.

    The first two have central differences of the solution, with force and Jacobian by the
    definition and by D's kernel. The third derives them from the kernel's Jacobian, which is
    -κ₀ (I - derivatives), with force and Jacobian by the definition.
    """
    result = []
    for probe in generic_probes("D", count):
        rates = np.array([_closest_point_gradient(probe, axis) for axis in (0, 1)])
        kernel = probe.compiled_jacobian()
        defined = probe.force(), probe.jacobian()
        result.append(ClosestPointDerivatives(probe, rates, *defined))
        result.append(ClosestPointDerivatives(probe, rates, probe.compiled_force(), kernel))
        result.append(ClosestPointDerivatives(probe, np.eye(2) + kernel / probe.k, *defined))
    return result
