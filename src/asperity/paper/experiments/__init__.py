"""Simulations of the experiments of section V, and of further devices and surfaces."""

from __future__ import annotations

from asperity.paper.experiments.experiment_suite import Experiments, run_experiments

__all__ = ["Experiments", "run_experiments"]
