"""The paper's x-z plane: parameter sets, generic points, forces and feet in many digits."""

from __future__ import annotations

import math
from collections.abc import Callable, Iterator
from dataclasses import dataclass, field
from typing import Any

import numpy as np

from asperity.checks import FloatArray
from asperity.surface import Surface
from asperity.textures.fourier import Fourier
from asperity.textures.sinusoid import Sinusoid

LAWS = "ABCDEFG"
_DIGITS = 25
_ACROSS = 0.0


@dataclass(frozen=True)
class Setting:
    """Numbers of one of the paper's experiments, SI.

    Attributes:
        stiffness: κ₀ [N/m].
        period: l [m].
        amplitude: A [m].
        friction: μ.
        deflection: d_max in x [m].
        depth: d_max in z [m].
        joint_damping: [N·m·s].
    """

    stiffness: float
    period: float
    amplitude: float
    friction: float = 0.8
    deflection: float = 1e-3
    depth: float = 1e-3
    joint_damping: float = 4.0e-3

    @property
    def texture(self) -> Sinusoid:
        """A sin(2πx/l)."""
        return Sinusoid(self.amplitude, self.period)

    def surface(self, law: str, **changes: Any) -> Surface:
        """Return a law on this texture; changes are arguments of ``Surface``."""
        arguments: dict[str, Any] = {"stiffness": self.stiffness, "max_depth": self.depth}
        if law == "F":
            arguments |= {"friction": self.friction, "max_deflection": self.deflection}
        return Surface(self.texture, law, **(arguments | changes))


PASSIVITY = Setting(2000.0, 1e-3, 0.8e-3, joint_damping=4.7e-3)  # section V.A
SCANNING = Setting(1000.0, 2e-3, 0.8e-3)  # V.B
BUMP = Setting(1000.0, 20e-3, 20e-3)  # V.C
SAMPLING_PERIOD = 1e-4  # [s], section V


def random_settings(count: int = 3, seed: int = 11) -> list[Setting]:
    """Return parameter sets drawn at random, the same ones every time."""
    draw = np.random.default_rng(seed)
    result = []
    for _ in range(count):
        period = draw.uniform(0.7e-3, 4e-3)
        amplitude = period * draw.uniform(0.1, 0.7)
        result.append(
            Setting(
                stiffness=draw.uniform(300.0, 2500.0),
                period=period,
                amplitude=amplitude,
                friction=draw.uniform(0.2, 1.1),
                deflection=draw.uniform(0.1e-3, 2e-3),
                depth=amplitude * draw.uniform(0.4, 1.3),
            )
        )
    return result


@dataclass(frozen=True)
class Spot:
    """A probe inside the body with what the paper's formulas need, SI.

    Attributes:
        surface: law, texture and stiffness.
        x: of the probe.
        z: of the probe.
        at: abscissa where the height is taken: of the probe, or of the nearest point.
        h: height there.
        slope: h' there.
        bend: h'' there.
    """

    surface: Surface
    x: float
    z: float
    at: float
    h: float
    slope: float
    bend: float

    @property
    def k(self) -> float:
        """κ₀ [N/m]."""
        return self.surface.stiffness

    @property
    def d(self) -> float:
        """The paper's penetration d^z = p^z - h, negative inside."""
        return self.z - self.h

    @property
    def from_foot(self) -> FloatArray:
        """Vector from the nearest point to the probe [m]."""
        return np.array([self.x - self.at, self.z - self.h])

    @property
    def distance(self) -> float:
        """|p - p_h| [m]."""
        return math.hypot(*self.from_foot)

    def profile(self) -> Callable[[Any, int], Any]:
        """Return h(x, order of the derivative) in mpmath."""
        return _profile(self.surface)

    def force(self) -> FloatArray:
        """Return (f_x, f_z) by the definition in many digits [N]."""
        from asperity.definition import exact_force

        exact = exact_force(self.surface, [self.x, _ACROSS, self.z], digits=_DIGITS)
        return np.array([float(exact[0]), float(exact[2])])

    def jacobian(self) -> FloatArray:
        """Return the Jacobian in x and z by differences of the definition [N/m]."""
        from asperity.definition import exact_jacobian

        exact = exact_jacobian(self.surface, [self.x, _ACROSS, self.z], digits=_DIGITS)
        return np.array([[float(exact[i, j]) for j in (0, 2)] for i in (0, 2)])

    def compiled_force(self) -> FloatArray:
        """Return (f_x, f_z) by the kernel that simulation and servo loop use [N]."""
        return np.asarray(self.surface.force([[self.x, _ACROSS, self.z]])[0, [0, 2]])

    def compiled_jacobian(self) -> FloatArray:
        """Return the Jacobian in x and z by the kernel [N/m]."""
        whole = self.surface.jacobian([[self.x, _ACROSS, self.z]])[0]
        return np.asarray(whole[::2, ::2])

    def norms(self) -> FloatArray:
        """Return ‖J‖ by the definition and by the kernel [N/m], shape (2,)."""
        both = [self.jacobian(), self.compiled_jacobian()]
        return np.asarray(np.linalg.norm(both, 2, axis=(1, 2)))


def generic_profile(seed: int = 5) -> Fourier:
    """Return h(x) of three waves in arbitrary phases: no symmetry that could hide an error."""
    draw = np.random.default_rng(seed)
    base = 2.0 * math.pi / draw.uniform(1e-3, 3e-3)
    waves = base * np.array([1.0, 2.0, 3.0])
    slopes = draw.uniform(0.2, 0.5, 3)
    return Fourier(slopes / waves, waves, draw.uniform(0.0, 6.0, 3))


def spots(law: str, count: int = 4, seed: int = 5) -> Iterator[Spot]:
    """Yield generic probes inside the body of a generic profile, where the foot is unique.

    Depths go to 0.7 of the least radius of curvature, so that curvature counts.
    """
    texture = generic_profile(seed)
    surface = Surface(texture, law, stiffness=731.0)
    profile = _profile(surface)
    draw = np.random.default_rng(seed)
    radius = 1.0 / texture.bounds[1]
    for _ in range(count):
        foot = draw.uniform(0.0, 3e-3)
        h, slope = (float(profile(foot, order)) for order in (0, 1))
        depth = radius * draw.uniform(0.2, 0.7)
        size = math.hypot(1.0, slope)
        x, z = foot + depth * slope / size, h - depth / size
        if law in "FG":
            z = -depth
        at = float(foot_of(surface, x, z)[0]) if law in "DE" else x
        yield Spot(surface, x, z, at, *(float(profile(at, order)) for order in (0, 1, 2)))


def _profile(surface: Surface) -> Callable[[Any, int], Any]:
    height = surface.texture.exact_height()
    return lambda x, order: height(x, _ACROSS, order, 0)


def foot_of(surface: Surface, x: Any, z: Any, digits: int = _DIGITS) -> tuple[Any, Any]:
    """Return the nearest point (p_h^x, p_h^z) in mpmath: the nearest of a scan, then Newton."""
    import mpmath

    profile = _profile(surface)
    with mpmath.workdps(digits):
        reach = 4.0 * surface.texture.peak_to_valley
        grid = float(x) + np.linspace(-reach, reach, 4001)
        heights = surface.texture.height(np.column_stack([grid, np.full(len(grid), _ACROSS)]))
        best = float(grid[np.argmin((grid - float(x)) ** 2 + (heights - float(z)) ** 2)])
        return _newton(profile, mpmath.mpf(best), mpmath.mpf(x), mpmath.mpf(z))


def _newton(profile: Callable[[Any, int], Any], at: Any, x: Any, z: Any) -> tuple[Any, Any]:
    """Solve (X - x) + (h - z) h' = 0."""
    import mpmath

    for _ in range(40):
        gap, slope, bend = profile(at, 0) - z, profile(at, 1), profile(at, 2)
        move = (at - x + gap * slope) / (1 + slope**2 + gap * bend)
        at -= move
        if abs(move) <= 10 * mpmath.eps * abs(at):
            break
    return at, profile(at, 0)


@dataclass(frozen=True)
class FootRates:
    """Derivatives of the nearest point by the probe, (x, z) by (x, z), and what D makes of it.

    Attributes:
        spot: the probe.
        rates: the derivatives, shape (2, 2).
        force: of D there [N], shape (2,).
        jacobian: of D there [N/m], shape (2, 2).
    """

    spot: Spot
    rates: FloatArray = field(compare=False)
    force: FloatArray = field(compare=False)
    jacobian: FloatArray = field(compare=False)

    def rate(self, of: str, by: str) -> float:
        """Return ∂p_h^of/∂p^by."""
        return float(self.rates["xz".index(of), "xz".index(by)])


def foot_rates(count: int = 4) -> list[FootRates]:
    """Return the derivatives of the nearest point at generic probes, for each probe three times.

    By differences of Newton's solution, with the force by the definition and with that by D's
    kernel; and those of the kernel, whose Jacobian is -κ₀ (1 - the derivatives), with the
    definition's.
    """
    import mpmath

    result = []
    for spot in spots("D", count):
        digits = 3 * _DIGITS
        with mpmath.workdps(digits):
            step = mpmath.mpf(10) ** -_DIGITS
            columns = []
            for dx, dz in ((step, 0), (0, step)):
                x, z = mpmath.mpf(spot.x), mpmath.mpf(spot.z)
                ahead = foot_of(spot.surface, x + dx, z + dz, digits)
                behind = foot_of(spot.surface, x - dx, z - dz, digits)
                columns.append(
                    [float((a - b) / (2 * step)) for a, b in zip(ahead, behind, strict=True)]
                )
        rates, kernel = np.array(columns).T, spot.compiled_jacobian()
        defined = spot.force(), spot.jacobian()
        result.append(FootRates(spot, rates, *defined))
        result.append(FootRates(spot, rates, spot.compiled_force(), kernel))
        result.append(FootRates(spot, np.eye(2) + kernel / spot.k, *defined))
    return result


def path_points(*turns: tuple[float, float]) -> list[tuple[float, float, float]]:
    """Return vertices (x, z) of the plane as points of space."""
    return [(x, 0.0, z) for x, z in turns]


# --- the closed paths on which the paper looks at the energy of a law (its Fig. 3) ----------------

Points = list[tuple[float, float, float]]
TURN = 0.1e-3
"""Where the paths of (27) and (29) turn [m]; the paper leaves it open."""


def groove_path(case: Setting) -> Points:
    """Return the path for A, B and E: along the wall, up where the texture is highest, back."""
    quarter, top = 0.25 * case.period, case.amplitude
    return path_points((0.0, 0.0), (quarter, 0.0), (quarter, top), (0.0, top))


def friction_path(case: Setting, light: float = TURN) -> Points:
    """Return the path of (27), for F: out at the small depth a, back at the greater."""
    x, deep = case.deflection, -case.depth
    return path_points((0.0, 1e-3), (0.0, -light), (x, -light), (x, deep), (0.0, deep))


def crossing_path(case: Setting, turn: float = TURN) -> Points:
    """Return the path of (29), for G: down at the crest, along at depth a, up at the trough."""
    quarter = 0.25 * case.period
    turns = [(quarter, turn), (quarter, -turn), (3 * quarter, -turn), (3 * quarter, turn)]
    return path_points(*turns)


def path_of(law: str, case: Setting) -> Points:
    """Return the path of a law by its letter; C and D, which the figure lacks, go that of A."""
    return {"F": friction_path, "G": crossing_path}.get(law, groove_path)(case)
