"""A profile h(x): a cubic B-spline through equally spaced heights."""

from __future__ import annotations

from functools import cached_property
from types import ModuleType
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import check_positive, check_real
from asperity.textures.bounds.pyramid import line_pyramid
from asperity.textures.spline.profile_sampler import ProfileArguments
from asperity.textures.spline.spline_texture import Spline

# Least number of samples of a dense search.
_MIN_SAMPLES = 4096


class Profile(Spline):
    """The C² cubic B-spline through heights[j] at x = origin + j pitch; constant along y.

    A finite profile is mirrored at its border nodes; a periodic one repeats after n pitch.

    Args:
        heights: [m], shape (n,), at least 4.
        pitch: distance of the nodes [m].
        periodic: whether the profile repeats.
        origin: position of heights[0] [m].
        preparation: steps of the preparation of the heights, for reports.
        filled_mask: where missing heights have been interpolated, shape (n,).

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
    axes: ClassVar[int] = 1
    pitch: float
    origin: float

    def _set_grid(self, pitch: Any, origin: Any) -> None:
        self.pitch = check_positive("pitch", pitch, "m")
        self.origin = check_real("origin", 0.0 if origin is None else origin, "m")

    def with_heights(self, heights: ArrayLike) -> Profile:
        """See :class:`Spline`."""
        return Profile(heights, self.pitch, periodic=self.periodic, origin=self.origin)

    @property
    def sampler(self) -> tuple[ModuleType, ...]:
        """See :class:`Texture`."""
        from asperity.contacts.closest import line_budget, line_search
        from asperity.textures.spline import bspline_kernels, profile_sampler

        return profile_sampler, bspline_kernels, line_search, line_budget

    @cached_property
    def arguments(self) -> ProfileArguments:
        """See :class:`Texture`."""
        c = self.coefficients
        pyramid = line_pyramid(c, self.pitch)
        return ProfileArguments(c, 1.0 / self.pitch, self.origin, self.periodic, *pyramid)

    def _compute_extremes(self) -> tuple[float, float]:
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

    def _compute_bounds(self) -> tuple[float, float]:
        inflate = 1.0 + 1e-12
        slope = float(np.abs(np.diff(self.coefficients)).max()) / self.pitch
        second = float(np.abs(np.diff(self.coefficients, 2)).max()) / self.pitch**2
        return inflate * slope, inflate * second

    def sample_counts(self) -> list[int]:
        """See :class:`Texture`; a whole number per cell."""
        cells = len(self.heights) - self.is_mirrored
        return [cells * max(1, -(-_MIN_SAMPLES // cells))]
