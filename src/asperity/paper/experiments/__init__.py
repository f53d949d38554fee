"""Simulations of the experiments of section V, and of further devices and surfaces."""

from __future__ import annotations

from asperity.paper.experiments.experiment_suite import Experiments, run_experiments
from asperity.paper.experiments.simulated_claims import SIMULATED_CLAIM_IDS

__all__ = ["SIMULATED_CLAIM_IDS", "Experiments", "run_experiments"]
