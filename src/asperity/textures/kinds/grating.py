"""Straight ridges with flat tops, flat grooves and rounded edges."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.arguments import Argument
from asperity.core.checks import FloatArray, check_positive, check_real
from asperity.core.errors import ParameterError
from asperity.textures.kinds import kind_arguments
from asperity.textures.spline.spline_texture import Profile

# The spline then follows the closed form to 2e-5 of the height (tested).
_NODES_PER_EDGE = 40
_MAX_NODES = 2**18


class Grating(Profile):
    """Ridges along y: flat tops at +height/2, flat grooves at -height/2, rounded edges.

    An edge rises as e(t) = t - sin(2πt)/(2π), with t in [0, 1] the position over its width: slope
    and curvature are zero at both ends, so the profile is C². The steepest slope, in the middle, is
    2 height/edge, the greatest curvature 2π height/edge². Ridge and groove, measured at half
    height, are duty · period and (1 - duty) · period wide; the middle of a ridge is at x = 0.

    The profile is the cubic spline through the closed form at 40 nodes per edge or more, which
    follows it to 2e-5 of the height. It varies along x only: rotate the scan, not the grating.

    Args:
        height: from groove to top [m].
        period: from ridge to ridge [m].
        duty: share of the ridge in the period, at half height; in (0, 1).
        edge: width of an edge [m], from flat to flat; at most the width of ridge and groove. By
            default a quarter of the narrower of the two.

    Raises:
        ParameterError: for a value that cannot be used, an edge wider than ridge or groove, or
            one so narrow that a period would need more than 2^18 nodes.

    Example:
        >>> ridges = Grating(height=0.2e-3, period=2e-3, duty=0.25)
        >>> ridges.height([[0.0, 0.0], [0.25e-3, 0.0], [1e-3, 0.0]]).round(8)
        array([ 0.0001,  0.    , -0.0001])
    """

    kind: ClassVar[str] = "grating"
    constructor_arguments: ClassVar[tuple[Argument, ...]] = kind_arguments("grating")

    def __init__(
        self, height: float, period: float, duty: float = 0.5, edge: float | None = None
    ) -> None:
        self.ridge_height = check_positive("height", height, "m")
        self.period = check_positive("period", period, "m")
        self.duty = check_real("duty", duty)
        if not 0.0 < self.duty < 1.0:
            raise ParameterError("duty", "must be between 0 and 1, both excluded", duty)
        narrower = min(self.duty, 1.0 - self.duty) * self.period
        self.edge = 0.25 * narrower if edge is None else check_positive("edge", edge, "m")
        if self.edge > narrower * (1.0 + 1e-12):
            limit = f"must be at most the narrower of ridge and groove, {narrower:g} m"
            raise ParameterError("edge", limit, edge)
        count = math.ceil(_NODES_PER_EDGE * self.period / self.edge)
        if count > _MAX_NODES:
            finest = _NODES_PER_EDGE * self.period / _MAX_NODES
            raise ParameterError("edge", f"must be at least {finest:.3g} m for this period", edge)
        pitch = self.period / count
        super().__init__(self.closed_form(np.arange(count) * pitch), pitch, periodic=True)

    def closed_form(self, x: ArrayLike) -> FloatArray:
        """Return the heights of the closed form.

        Args:
            x: positions [m], any shape.

        Returns:
            Heights [m], same shape.
        """
        # Distance from the middle of the nearest ridge; the edge is centred on the ridge's side.
        along = np.asarray(x, dtype=np.float64)
        distance = np.abs(along - self.period * np.round(along / self.period))
        t = np.clip((0.5 * self.duty * self.period - distance) / self.edge + 0.5, 0.0, 1.0)
        climb = t - np.sin(2.0 * np.pi * t) / (2.0 * np.pi)
        return np.asarray(self.ridge_height * (climb - 0.5))

    def constructor_values(self) -> dict[str, Any]:
        """See :class:`Texture`; the attribute ``height`` is a method."""
        return super().constructor_values() | {"height": self.ridge_height}
