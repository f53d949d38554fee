"""A measured or drawn profile h(x): a cubic B-spline through equally spaced heights."""

from __future__ import annotations

from collections.abc import Sequence
from functools import cached_property
from types import ModuleType
from typing import ClassVar

import numpy as np
from numpy.typing import ArrayLike

from asperity.checks import positive, real
from asperity.kept import kept
from asperity.textures.pyramid import line_pyramid
from asperity.textures.samplers.profile import ProfileArguments
from asperity.textures.spline import Spline, node_heights

# Samples of a dense search, at least.
_LEAST_SAMPLES = 4096


class Profile(Spline):
    """The C² cubic B-spline through heights[j] at x = origin + j pitch; constant along y.

    A finite profile is mirrored at its border nodes; a periodic one repeats after n pitch.

    Args:
        heights: [m], shape (n,), at least 4.
        pitch: distance of the nodes [m].
        periodic: whether the profile repeats.
        origin: position of heights[0] [m].
        preparation: what was done to the heights, in words, for reports.
        filled: where heights were missing and have been interpolated, shape (n,).

    Raises:
        ParameterError: for fewer than 4 heights, heights that are not finite, or a pitch that
            is not positive.

    Example:
        >>> ridge = Profile([0.0, 0.0, 1e-3, 0.0, 0.0], pitch=1e-3)
        >>> ridge.height([[2e-3, 7.0], [2e-3, 9.0]]).round(9)
        array([0.001, 0.001])
    """

    kind: ClassVar[str] = "profile"
    noun: ClassVar[str] = "profile"
    pitch: float
    origin: float

    def __init__(
        self,
        heights: ArrayLike,
        pitch: float,
        *,
        periodic: bool = False,
        origin: float = 0.0,
        preparation: Sequence[str] = (),
        filled: ArrayLike | None = None,
    ) -> None:
        self.heights = node_heights(heights, 1)
        self.pitch = positive("pitch", pitch, "m")
        self.origin = real("origin", origin, "m")
        self._keep(periodic, preparation, filled)

    def __repr__(self) -> str:
        edge = "periodic" if self.periodic else "finite"
        return f"<Profile of {len(self.heights)} points, pitch {self.pitch} m, {edge}>"

    def with_heights(self, heights: ArrayLike) -> Profile:
        """See :class:`Spline`."""
        return Profile(heights, self.pitch, periodic=self.periodic, origin=self.origin)

    @property
    def sampler(self) -> tuple[ModuleType, ...]:
        """See :class:`Texture`."""
        from asperity.contacts.nearest import line_search, line_within
        from asperity.textures.samplers import profile, spline

        return profile, spline, line_search, line_within

    @cached_property
    def arguments(self) -> ProfileArguments:
        """See :class:`Texture`."""
        c = self.coefficients
        pyramid = line_pyramid(c, self.pitch)
        return ProfileArguments(c, 1.0 / self.pitch, self.origin, self.periodic, *pyramid)

    @cached_property
    def extremes(self) -> tuple[float, float]:
        """Least and greatest height of the spline [m]: nodes and roots of h' in every cell."""
        return kept("extremes", self.content, self._extremes)

    @cached_property
    def bounds(self) -> tuple[float, float]:
        """Greatest differences of coefficients (convex hull property of B-splines)."""
        return kept("bounds", self.content, self._bounds)

    def _extremes(self) -> tuple[float, float]:
        c = np.lib.stride_tricks.sliding_window_view(self.coefficients, 4)
        c0, c1, c2, c3 = c.T
        # h'(t) = a t² + b t + d on the cell, t in [0, 1].
        a, b, d = 0.5 * (c3 - 3 * c2 + 3 * c1 - c0), c0 - 2 * c1 + c2, 0.5 * (c2 - c0)
        root = np.sqrt(np.maximum(b * b - 4 * a * d, 0.0))
        half = -0.5 * (b + np.copysign(root, b))
        with np.errstate(divide="ignore", invalid="ignore"):
            candidates = np.stack([half / a, d / half, np.zeros_like(a), np.ones_like(a)])
        t = np.clip(np.nan_to_num(candidates, nan=0.0), 0.0, 1.0)
        h = (c0 + 4 * c1 + c2) / 6 + t * (d + t * (b / 2 + t * a / 3))
        return float(h.min()), float(h.max())

    def _bounds(self) -> tuple[float, float]:
        inflate = 1.0 + 1e-12
        slope = float(np.abs(np.diff(self.coefficients)).max()) / self.pitch
        bend = float(np.abs(np.diff(self.coefficients, 2)).max()) / self.pitch**2
        return inflate * slope, inflate * bend

    def sample_counts(self) -> list[int]:
        """See :class:`Texture`; whole parts of the cells."""
        cells = len(self.heights) - self.ends
        return [cells * max(1, -(-_LEAST_SAMPLES // cells))]
