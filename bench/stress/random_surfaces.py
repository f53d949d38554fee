"""Random surfaces, laws and probe points, from the gentle to the absurd.

Every kind of texture, sizes from nanometres to kilometres, offsets, phases of thousands of turns,
flat and rough maps, the shipped laws and some of a user's own. A trial is fixed by its seed.
"""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any

import numpy as np
import sympy as sp

from asperity.analysis.bounds.bound import Bound, curl_norm, precise_norm, precise_one_sided
from asperity.analysis.gain.characteristic import (
    characteristic_number,
    curl_number,
    one_sided_number,
)
from asperity.contacts.symbols import ContactSymbols
from asperity.core.checks import FloatArray
from asperity.laws import Law, find_law
from asperity.surface import Surface
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid
from asperity.textures.texture import Texture

Generator = np.random.Generator
SHIPPED = "WABCDEFGH"
Number = Callable[..., Bound]
NUMBERS: dict[str, tuple[Number, Callable[[FloatArray], FloatArray]]] = {
    "q": (characteristic_number, precise_norm),
    "q+": (one_sided_number, precise_one_sided),
    "curl": (curl_number, curl_norm),
}
# What rounding may add to a number that is evaluated, and to one that is attained.
EXCESS = 1e-12
WORK_LIMIT = 300_000


def _own_laws() -> dict[str, Law]:
    """Return laws of a user: affine in the depth or not, on each contact, with state or not."""

    def blend(c: ContactSymbols) -> Any:
        return c.k * c.depth * (c.normal + c.parameter("share") * c.w) / 2

    def stiffening(c: ContactSymbols) -> Any:
        return c.k * c.depth * (1 + c.depth / c.parameter("stiffening")) * c.w

    def saturating(c: ContactSymbols) -> Any:
        size = c.parameter("saturation")
        return c.k * size * sp.tanh(c.depth / size) * c.normal

    def modulated(c: ContactSymbols) -> Any:
        return c.k * c.depth * (1 + c.relative_height / 2) * c.e_z

    def sticky(c: ContactSymbols) -> Any:
        d, longest = c.deflection, c.parameter("max_deflection")
        grip = (1 - c.relative_height / 2) * (1 + (d[0] ** 2 + d[1] ** 2) / longest**2)
        return c.k * c.depth * (c.e_z - grip * c.tangential(d) / longest)

    def pushing(c: ContactSymbols) -> Any:
        return c.k * c.depth * (1 + c.depth / c.parameter("stiffening")) * c.normal

    length = {"stiffening": 1e-3}
    laws = [
        Law("blend", "blend", "vertical", blend, parameters={"share": 0.5}),
        Law("stiffening", "stiffening", "vertical", stiffening, parameters=length),
        Law("saturating", "saturating", "nominal", saturating, parameters={"saturation": 1e-3}),
        Law("modulated", "modulated", "nominal", modulated),
        Law(
            "sticky",
            "sticky",
            "nominal",
            sticky,
            stateful=True,
            parameters={"max_deflection": 1e-3},
        ),
        Law("pushing", "pushing", "nearest", pushing, parameters=length),
    ]
    return {law.letter: law for law in laws}


OWN = _own_laws()


@dataclass(frozen=True)
class Contacts:
    """Probe points in the working region, and the state there.

    Attributes:
        points: [m], shape (n, 3).
        deflection: [m], shape (n, 2); ``None`` for a law without state.
        sliding: shape (n,); ``None`` for a law without state.
    """

    points: FloatArray
    deflection: FloatArray | None = None
    sliding: Any = None

    def jacobians(self, surface: Surface) -> FloatArray:
        """Return J/k at the contacts, shape (n, 3, 3)."""
        result = surface.jacobian(self.points, self.deflection, self.sliding)
        return np.asarray(result / surface.stiffness)


def random_texture(rng: Generator) -> tuple[str, Texture]:
    """Return a texture of a random kind and its kind in words."""
    kinds: dict[str, Callable[[Generator, float, float], Texture]] = {
        "sinusoid": _sinusoid,
        "Fourier profile": _fourier_profile,
        "periodic sum": _periodic_sum,
        "three phases": _three_phases,
        "incommensurate profile": _incommensurate,
        "profile": _profile,
        "map": _map,
    }
    kind = str(rng.choice(list(kinds)))
    length = 1e-3 if rng.random() < 0.6 else float(10.0 ** rng.uniform(-9.0, 3.0))
    steep = float(10.0 ** rng.uniform(-2.0, 0.7))
    if rng.random() < 0.05:
        steep = float(10.0 ** rng.uniform(-9.0, 4.0))
    return kind, kinds[kind](rng, length, steep * length)


def _phases(rng: Generator, count: int) -> FloatArray:
    turns = 1e4 if rng.random() < 0.1 else 1.0
    return rng.uniform(-7.0, 7.0, count) * turns


def _sinusoid(rng: Generator, length: float, size: float) -> Texture:
    phase = float(_phases(rng, 1)[0])
    return Sinusoid(0.2 * size, length, phase, rng.normal(size=2).tolist())


def _fourier_profile(rng: Generator, length: float, size: float) -> Texture:
    count = int(rng.integers(1, 7))
    waves = 2.0 * np.pi / length * rng.choice(np.arange(1, 9), count, replace=False)
    direction = rng.normal(size=2)
    direction /= np.hypot(*direction)
    vectors = waves[:, None] * direction
    amplitudes = size * rng.normal(size=count) / (1 + np.arange(count)) ** 2
    return Fourier(0.1 * amplitudes, vectors, _phases(rng, count))


def _lattice(rng: Generator, length: float) -> FloatArray:
    angle, skew = rng.uniform(0.0, 6.3), rng.uniform(0.5, 2.5)
    one = np.array([np.cos(angle), np.sin(angle)])
    other = np.array([np.cos(angle + skew), np.sin(angle + skew)]) * rng.uniform(0.5, 2.0)
    return 2.0 * np.pi / length * np.array([one, other])


def _periodic_sum(rng: Generator, length: float, size: float) -> Texture:
    count = int(rng.integers(2, 7))
    multiples = rng.integers(-3, 4, (count, 2))
    multiples[~multiples.any(axis=1)] = 1
    amplitudes = 0.07 * size * rng.normal(size=count)
    return Fourier(amplitudes, multiples @ _lattice(rng, length), _phases(rng, count))


def _three_phases(rng: Generator, length: float, size: float) -> Texture:
    waves = 2.0 * np.pi / length * rng.uniform(0.3, 1.5, (3, 1)) * _directions(rng, 3)
    return Fourier(0.1 * size * rng.normal(size=3), waves, _phases(rng, 3))


def _directions(rng: Generator, count: int) -> FloatArray:
    angles = rng.uniform(0.0, 2.0 * np.pi, count)
    return np.stack([np.cos(angles), np.sin(angles)], axis=-1)


def _incommensurate(rng: Generator, length: float, size: float) -> Texture:
    waves = 2.0 * np.pi / length * np.array([1.0, rng.uniform(1.1, 3.0)])
    return Fourier(0.1 * size * rng.normal(size=2), waves, _phases(rng, 2))


def _heights(rng: Generator, shape: tuple[int, ...], size: float) -> FloatArray:
    from scipy.ndimage import gaussian_filter

    heights = rng.normal(size=shape)
    if rng.random() < 0.6:
        heights = gaussian_filter(heights, rng.uniform(0.5, 2.0), mode="reflect")
    if rng.random() < 0.05:
        heights = np.ones(shape)
    offset = 10.0 * size * rng.normal() if rng.random() < 0.2 else 0.0
    return np.asarray(0.3 * size * heights + offset)


def _profile(rng: Generator, length: float, size: float) -> Texture:
    heights = _heights(rng, (int(rng.integers(4, 40)),), size)
    periodic = bool(rng.random() < 0.5)
    origin = float(length * rng.normal())
    return Profile(heights, 0.3 * length, periodic=periodic, origin=origin)


def _map(rng: Generator, length: float, size: float) -> Texture:
    shape = (int(rng.integers(4, 20)), int(rng.integers(4, 20)))
    pitch = (0.3 * length, 0.3 * length * float(rng.uniform(0.5, 2.0)))
    origin = (length * rng.normal(size=2)).tolist()
    periodic = bool(rng.random() < 0.5)
    return HeightMap(_heights(rng, shape, size), pitch, periodic=periodic, origin=origin)


def random_surface(rng: Generator, letters: str = SHIPPED) -> tuple[str, Surface]:
    """Return a random surface and its texture's kind in words."""
    kind, texture = random_texture(rng)
    law: str | Law = str(rng.choice(list(letters)))
    if rng.random() < 0.2:
        law = OWN[str(rng.choice(list(OWN)))]
    _slope, bend = texture.bounds
    height = texture.peak_to_valley
    # Depths around the height, or around the radius of the sharpest crest.
    # The spline of a flat map is flat but for rounding.
    scale = height if height > 1e-12 * max(map(abs, texture.extremes)) else 1e-3
    if bend > 0.0 and rng.random() < 0.5:
        # A map that is flat but for rounding bends next to nothing.
        scale = min(1.0 / bend, float(np.abs(texture.domain.spans).sum()))
    depth = float(scale * 10.0 ** rng.uniform(-1.0, 0.5))
    own = {}
    if isinstance(law, Law):
        own = {name: depth for name in law.parameters if name in {"stiffening", "saturation"}}
    stiffness, friction = float(10.0 ** rng.uniform(1.0, 4.0)), float(rng.uniform(0.0, 2.0))
    found = find_law(law)
    # A law with state of its own refuses friction, other than as a parameter.
    takes_friction = not found.stateful or "friction" in found.parameters
    surface = Surface(
        texture,
        law,
        stiffness=stiffness,
        max_depth=depth,
        friction=friction if takes_friction else None,
        max_deflection=float(depth * 10.0 ** rng.uniform(-1.0, 1.0)),
        modulation_depth=float(rng.choice([0.0, 1.0, rng.uniform()])),
        continuity=float(10.0 ** rng.uniform(-1.0, 1.0)),
        law_parameters=own,
    )
    return kind, surface


def random_contacts(
    rng: Generator, surface: Surface, count: int, around: tuple[float, float] | None = None
) -> Contacts:
    """Return contacts spread over the working region, or around a point of the plane.

    Args:
        rng: random numbers.
        surface: the surface.
        count: how many, a few less where probes turn out to be deeper than ``max_depth``.
        around: (x, y) [m] near which half of them lie, at distances of all sizes.
    """
    xy = _places(rng, surface.texture, count)
    if around is not None:
        reach = float(np.abs(surface.texture.domain.spans).max())
        near = reach * 10.0 ** rng.uniform(-8.0, -1.0, (count, 1)) * rng.normal(size=(count, 2))
        xy = np.where(rng.random((count, 1)) < 0.5, np.asarray(around) + near, xy)
    # Just below the surface rounding of a far position decides what the split god-object sees.
    least = 1e-3 if surface.law.contact.name == "split" else 1e-6
    depth = surface.max_depth * rng.choice([1.0 - 1e-12, least, rng.random()], count)
    points = _probes(surface, xy, depth)
    if not surface.law.stateful:
        return Contacts(points)
    length = surface.max_deflection * rng.choice([1.0, 0.0, 0.5], count)
    angle = rng.uniform(0.0, 2.0 * np.pi, count)
    slope = surface.texture.gradient(points[:, :2])
    against = np.arctan2(-slope[:, 1], -slope[:, 0])
    angle = np.where(rng.random(count) < 0.5, against, angle)
    deflection = length[:, None] * np.stack([np.cos(angle), np.sin(angle)], axis=-1)
    # An anchor is dragged at its greatest deflection only.
    return Contacts(points, deflection, (rng.random(count) < 0.5) & (length == length.max()))


def _places(rng: Generator, texture: Texture, count: int) -> FloatArray:
    spans = texture.domain.spans
    fractions = rng.random((count, len(spans)))
    if isinstance(texture, (HeightMap, Profile)) and rng.random() < 0.5:
        # Nodes, where the second derivatives of a spline are extreme.
        nodes = np.array(np.shape(texture.heights)[::-1]) - (0 if texture.periodic else 1)
        fractions = np.round(fractions * nodes) / nodes
    return texture.domain.points(fractions)


def _probes(surface: Surface, xy: FloatArray, depth: FloatArray) -> FloatArray:
    texture, contact = surface.texture, surface.law.contact.name
    if contact == "nominal":
        return np.column_stack([xy, -depth])
    height = texture.height(xy)
    if contact == "vertical":
        return np.column_stack([xy, height - depth])
    slope = texture.gradient(xy)
    normal = np.column_stack([-slope, np.ones(len(xy))])
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    points = np.column_stack([xy, height]) - depth[:, None] * normal
    # Deeper than meant where another surface point is nearer; shallower ones are welcome.
    away = np.linalg.norm(texture.nearest(points) - points, axis=1)
    return np.ascontiguousarray(points[(away <= surface.max_depth) & (away > 0.0)])


@dataclass(frozen=True)
class Trial:
    """What one random surface showed.

    Attributes:
        seed: of the trial.
        kind: of texture, in words.
        law: its letter.
        name: of the number.
        bound: the certificate.
        points: at how many points the number was evaluated.
        excess: the greatest of them over ``upper``, less 1; at most ``EXCESS`` if it is right.
        missed: relative difference of ``lower`` and what the witness attains.
    """

    seed: int
    kind: str
    law: str
    name: str
    bound: Bound
    points: int
    excess: float
    missed: float

    @property
    def is_correct(self) -> bool:
        """Whether nothing exceeds ``upper`` and ``lower`` is attained."""
        ordered = self.bound.lower <= self.bound.upper
        return ordered and self.excess <= EXCESS and self.missed <= EXCESS

    @property
    def is_tight(self) -> bool:
        """Whether the gap is the one promised, or the note says why not."""
        bound = self.bound
        said = any(word in bound.note for word in ("limit", "extent", "only near", "medial axis"))
        idle = not np.isfinite(bound.upper) or bound.upper < 1e-8
        return said or idle or bound.gap <= 1.01 * self.promised_gap

    @property
    def promised_gap(self) -> float:
        """The relative gap that is promised for this kind of texture and law."""
        if self.kind == "map" or self.law in OWN:
            return 1e-3
        return 1e-4 if self.kind == "three phases" else 1e-6


def run_trial(seed: int, letters: str = SHIPPED, points: int = 200) -> Trial:
    """Certify a number of a random surface and evaluate it at random contacts."""
    rng = np.random.default_rng(seed)
    kind, surface = random_surface(rng, letters)
    names = [name for name in NUMBERS if name != "curl" or not surface.law.stateful]
    name = str(rng.choice(names))
    number, measure = NUMBERS[name]
    bound = number(surface, work_limit=WORK_LIMIT)
    contacts = random_contacts(rng, surface, points, bound.at and bound.at[:2])
    values = measure(contacts.jacobians(surface))
    most = float(values.max(initial=0.0)) if not np.isnan(values).any() else np.inf
    excess = most / bound.upper - 1.0 if bound.upper > 0.0 else most
    missed = _witness_error(surface, bound, measure)
    count = len(contacts.points)
    return Trial(seed, kind, surface.law.letter, name, bound, count, excess, missed)


def _witness_error(
    surface: Surface, bound: Bound, measure: Callable[[FloatArray], FloatArray]
) -> float:
    if bound.at is None or not np.isfinite(bound.lower) or bound.lower == 0.0:
        return 0.0
    state: tuple[Any, ...] = ()
    if bound.deflection is not None:
        state = (np.array([bound.deflection]), np.array([bound.sliding]))
    # Numbers are worked out at 1 N/m: another stiffness would round otherwise, by
    # more than what is left of a curl where two derivatives cancel.
    asked = surface.to_stiffness(1.0)
    attained = measure(asked.jacobian([bound.at], *state) / asked.stiffness)
    return abs(float(attained[0]) / bound.lower - 1.0)
