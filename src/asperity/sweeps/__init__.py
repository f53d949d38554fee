"""Sweeps: many cases of one scene, in this process, on all cores or on a cluster."""

from asperity.sweeps.run_sweep import sweep
from asperity.sweeps.sweep_result import SweepResult

__all__ = ["SweepResult", "sweep"]
