"""How far to search for a certified number."""

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
class Search:
    """How far to search.

    Attributes:
        tolerance: relative gap; ``None`` for 1e-6 on profiles and periodic sums, 1e-4 on sums of
            three independent waves, 1e-3 on those of four, on maps and wherever a depth or an
            anchor's state has to be searched as well.
        work_limit: greatest number of cells.
        extent: width and depth [m] of the part of the plane that counts, for sums of waves.
    """

    tolerance: float | None = None
    work_limit: int = DEFAULT_WORK_LIMIT
    extent: tuple[float, float] | None = None

    def margin(self, surface: Surface) -> float:
        """Return how far beyond the extent the surface is felt [m]: feet are not below probes."""
        return surface.law.contact.margin(surface.max_depth)

    def crest(self, surface: Surface) -> Crest | None:
        """Return the sharpest crest that is felt; nothing for a surface without crests."""
        margin = self.margin(surface)
        return sharpest_crest(surface.texture, extent=self.extent, margin=margin)

    def cheap_gap(self, cells: Cells) -> float | None:
        """Return the gap to try for where it costs little."""
        return cells.cheap_gap if self.tolerance is None else None

    def gap(self, cells: Cells) -> float:
        """Return the relative gap to reach."""
        return cells.gap if self.tolerance is None else self.tolerance

    def supremum(self, problem: Problem) -> Supremum:
        """Return proved bounds of the supremum of a problem, as near as was asked for."""
        cells = problem.cells
        return supremum(problem, self.gap(cells), self.work_limit, self.cheap_gap(cells))
