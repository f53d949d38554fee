"""Bayesian adaptive levels: the psi-marginal method of the library SweetSpot."""

from __future__ import annotations

from typing import Any

import numpy as np

from asperity.core.errors import ParameterError

THRESHOLDS, CANDIDATES = 101, 51
_SLOPES = (-2.0, 3.0, 15)  # logarithm of the slope at the threshold: ends, number


def _import_sweetspot() -> Any:
    try:
        import SweetSpot
    except ImportError:
        words = "bayesian needs the library SweetSpot: pip install 'asperity[studies]'"
        raise ParameterError("method.procedure", words) from None
    return SweetSpot


class BayesianTrack:
    """Levels after which the threshold is expected to be known best.

    The psychometric function is that of
    :class:`~asperity.studies.statistics.psychometric.Psychometric`. The prior of the threshold is
    normal, centred in the range and half as wide; the slope is marginalised.

    Args:
        low: lowest level.
        high: highest level.
        guess: share of right answers of a guess.
        lapse: share of wrong answers at the highest level.

    Raises:
        ParameterError: if SweetSpot is not installed.

    References:
        N. Prins: The psi-marginal adaptive method. Journal of Vision 13 (2013) 7:3,
        https://doi.org/10.1167/13.7.3.
    """

    def __init__(self, low: float, high: float, guess: float, lapse: float) -> None:
        library = _import_sweetspot()
        function = library.PsychometricFunction(gamma=guess, lambda_=lapse)
        function.Grid(alpha=(low, high, THRESHOLDS), beta=_SLOPES)
        function.SetPrior(alpha=((low + high) / 2.0, (high - low) / 2.0), beta=(0.0, 1.0))
        levels = np.linspace(low, high, CANDIDATES)
        self.procedure = library.PsiMarginal(
            pf=function, xCandidates=levels, maxIterations=None, parameterOfInterest="alpha"
        )

    def level(self) -> float:
        """Return the level to present now."""
        return float(self.procedure.PendingValue())

    def record(self, correct: bool) -> None:
        """Update the posterior."""
        self.procedure.Observe(int(correct))
