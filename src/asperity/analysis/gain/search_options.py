"""Options of the search for a certified number."""

from __future__ import annotations

from dataclasses import dataclass

from asperity.analysis.bounds.branch_and_bound import (
    DEFAULT_WORK_LIMIT,
    Problem,
    Supremum,
    supremum,
)
from asperity.analysis.gain.medial_axis import Crest, sharpest_crest
from asperity.enclosures.cells import Cells
from asperity.surface import Surface


@dataclass(frozen=True)
class SearchOptions:
    """Options of a search.

    Attributes:
        tolerance: relative gap; ``None`` for 1e-6 on profiles and periodic sums, 1e-4 on sums of
            three independent waves, 1e-3 on those of four, on maps and wherever a depth or the
            state of an anchor is searched too.
        work_limit: greatest number of cells.
        extent: width and depth [m] of the part of the plane to search, for sums of waves.
    """

    tolerance: float | None = None
    work_limit: int = DEFAULT_WORK_LIMIT
    extent: tuple[float, float] | None = None

    def margin(self, surface: Surface) -> float:
        """Return the reach of contact beyond the extent [m]: closest points lie beside probes."""
        return surface.law.contact.lateral_reach(surface.max_depth)

    def crest(self, surface: Surface) -> Crest | None:
        """Return the sharpest crest in reach; ``None`` for a surface without crests."""
        margin = self.margin(surface)
        return sharpest_crest(surface.texture, extent=self.extent, margin=margin)

    def cheap_tolerance(self, cells: Cells) -> float | None:
        """Return the relative gap to reach where it costs little."""
        return cells.refined_gap if self.tolerance is None else None

    def relative_tolerance(self, cells: Cells) -> float:
        """Return the relative gap to reach."""
        return cells.default_gap if self.tolerance is None else self.tolerance

    def supremum(self, problem: Problem) -> Supremum:
        """Return proved bounds of the supremum of a problem."""
        cells = problem.cells
        return supremum(
            problem, self.relative_tolerance(cells), self.work_limit, self.cheap_tolerance(cells)
        )
