"""Results of sweeps of a scene: onsets of limit cycles, and energy per stroke."""

from __future__ import annotations

from dataclasses import dataclass
from typing import Any

from asperity.core.display import Reportable, Tabular
from asperity.core.files import to_plain_data
from asperity.scene.setup import Setup
from asperity.simulation.limit_cycles.onset import Prediction
from asperity.simulation.scan import Stroke

SCHEMA = 2


@dataclass(frozen=True)
class OnsetSweep(Reportable, Tabular):
    """The onset of limit cycles of a scene, for each law and delay.

    Attributes:
        setup: the closed loop.
        onsets: one for each law and delay, laws first.
    """

    setup: Setup
    onsets: tuple[Prediction, ...]

    def __repr__(self) -> str:
        return f"<OnsetSweep of {len(self.onsets)} onsets on {self.setup.device.id}>"

    def table_rows(self) -> list[dict[str, Any]]:
        """Return law, delay, bracket of the onset and the rules; SI units."""
        return [
            {
                "law": one.onset.law,
                "delay [samples]": one.onset.delay,
                "quiet [N/m]": one.onset.quiet,
                "cycling [N/m]": one.onset.cycling,
                "cycling starts": one.onset.cycles,
                "starts": one.onset.starts,
                "depth [m]": one.depth,
                "q": one.q,
                "one-sided q": one.one_sided,
                "paper (1) [N/m]": one.paper_limit,
                "delay rule [N/m]": one.delay_rule,
                "wall rule [N/m]": one.wall_rule,
                "conservative": one.conservative,
            }
            for one in self.onsets
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        onsets = to_plain_data(self.onsets)
        return {"schema": SCHEMA, "scene": self.setup.to_dict(), "onsets": onsets}


@dataclass(frozen=True)
class StrokeSweep(Reportable, Tabular):
    """The energy per stroke of a scene, for each law, speed and depth.

    Attributes:
        setup: the closed loop.
        strokes: one for each law, speed and depth, laws first.
    """

    setup: Setup
    strokes: tuple[Stroke, ...]

    def __repr__(self) -> str:
        return f"<StrokeSweep of {len(self.strokes)} cases on {self.setup.device.id}>"

    def table_rows(self) -> list[dict[str, Any]]:
        """Return law, speed, depth and the energies per stroke; SI units."""
        return [
            {
                "law": one.law,
                "speed [m/s]": one.speed,
                "depth [m]": one.depth,
                "mean depth [m]": one.mean_depth,
                "energy per stroke [J]": one.total,
                "energy of the field [J]": one.field,
                "error of the field [J]": one.error,
                "spread of the field [J]": one.spread,
                "gains energy": one.gains_energy,
                "the paper's sum [J]": one.same_sample_sum,
                "contact losses per stroke": one.lost_contact,
                "stop message": one.stop_message,
            }
            for one in self.strokes
        ]

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, SI units, with a schema number."""
        strokes = to_plain_data(self.strokes)
        return {"schema": SCHEMA, "scene": self.setup.to_dict(), "strokes": strokes}
