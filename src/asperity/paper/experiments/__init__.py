"""The experiments of section V in simulation, and what the paper could not do."""

from __future__ import annotations

from asperity.paper.experiments.findings import FINDINGS
from asperity.paper.experiments.run import Experiments, run_experiments

__all__ = ["FINDINGS", "Experiments", "run_experiments"]
