"""Straight ridges with flat tops, flat grooves and rounded edges."""

from __future__ import annotations

import math
from typing import Any, ClassVar

import numpy as np
from numpy.typing import ArrayLike

from asperity.arguments import Argument
from asperity.checks import FloatArray, positive, real
from asperity.errors import ParameterError
from asperity.textures.profile import Profile
from asperity.textures.texture import Kind

# Nodes per edge: the spline then meets the closed form to 2e-5 of the height (tested).
_NODES_PER_EDGE = 40
_MOST_NODES = 2**18


class Grating(Profile):
    """Ridges along y: flat tops at +height/2, flat grooves at -height/2, rounded edges.

    An edge climbs as e(t) = t - sin(2πt)/(2π), t in [0, 1] its position over its width: slope and
    curvature are zero at both ends, so the profile is C². Its steepest slope, in its middle, is
    2 height/edge, its greatest curvature 2π height/edge². Ridge and groove, measured at half
    height, are duty · period and (1 - duty) · period wide; the middle of a ridge is at x = 0.

    The profile is the cubic spline through the closed form at 40 nodes per edge or more, which
    meets it to 2e-5 of the height. It varies along x only: turn the scan, not the grating.

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

    def __init__(
        self, height: float, period: float, duty: float = 0.5, edge: float | None = None
    ) -> None:
        self.ridge_height = positive("height", height, "m")
        self.period = positive("period", period, "m")
        self.duty = real("duty", duty)
        if not 0.0 < self.duty < 1.0:
            raise ParameterError("duty", "must be between 0 and 1, both excluded", duty)
        narrower = min(self.duty, 1.0 - self.duty) * self.period
        self.edge = 0.25 * narrower if edge is None else positive("edge", edge, "m")
        if self.edge > narrower * (1.0 + 1e-12):
            limit = f"must be at most the narrower of ridge and groove, {narrower:g} m"
            raise ParameterError("edge", limit, edge)
        count = math.ceil(_NODES_PER_EDGE * self.period / self.edge)
        if count > _MOST_NODES:
            finest = _NODES_PER_EDGE * self.period / _MOST_NODES
            raise ParameterError("edge", f"must be at least {finest:.3g} m for this period", edge)
        pitch = self.period / count
        super().__init__(self.exact(np.arange(count) * pitch), pitch, periodic=True)

    def exact(self, x: ArrayLike) -> FloatArray:
        """Return the closed form that the spline follows.

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

    def __repr__(self) -> str:
        return (
            f"Grating(height={self.ridge_height!r}, period={self.period!r}, "
            f"duty={self.duty!r}, edge={self.edge!r})"
        )

    def describe(self) -> dict[str, Any]:
        """See :class:`Texture`."""
        return super().describe() | {
            "height": self.ridge_height,
            "period": self.period,
            "duty": self.duty,
            "edge": self.edge,
        }


GRATING = Kind(
    "grating",
    "straight ridges with rounded edges, along y",
    Grating,
    (
        Argument("height", "from groove to top", "m", required=True),
        Argument("period", "from ridge to ridge", "m", required=True),
        Argument("duty", "share of the ridge", default=0.5, high=1.0),
        Argument("edge", "width of an edge", "m", default_words="ridge or groove/4"),
    ),
    example={"height": 0.2e-3, "period": 2e-3},
)
