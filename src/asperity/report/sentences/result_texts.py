"""Which function makes which text of a result: the texts that results have as attributes."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

from asperity.analysis.bounds.bound import Bound
from asperity.analysis.energy.closed_loops import Leak
from asperity.analysis.energy.continuity import Continuity
from asperity.analysis.limits.spectrum import Spectrum
from asperity.analysis.passivity.verdict import Passivity
from asperity.analysis.results.analyze import Analysis
from asperity.analysis.results.check_limits import Limits
from asperity.analysis.results.compare import Comparison
from asperity.analysis.results.device_comparisons import DeviceComparisons, MissingData
from asperity.analysis.results.recommendation import LawRow
from asperity.envelopes.envelope import Envelope
from asperity.report.sentences import (
    answer_sentences,
    assumption_sentences,
    comparison_sentences,
    limit_sentences,
    passivity_sentences,
    texts,
)
from asperity.surface import Surface

_TEXTS: dict[tuple[type, str], Callable[[Any], Any]] = {
    (Analysis, "answer"): assumption_sentences.analysis_answer,
    (Analysis, "assumptions"): assumption_sentences.analysis_assumptions,
    (Bound, "interval"): texts.interval_text,
    (Comparison, "recommendation"): answer_sentences.recommendation_text,
    (Comparison, "reasons"): answer_sentences.recommendation_reasons,
    (Comparison, "assumptions"): assumption_sentences.comparison_assumptions,
    (Continuity, "reason"): passivity_sentences.continuity_reason,
    (DeviceComparisons, "recommendation"): comparison_sentences.device_recommendation,
    (Envelope, "assumptions"): assumption_sentences.envelope_assumptions,
    (LawRow, "artefacts"): comparison_sentences.row_artefacts,
    (LawRow, "verdict"): comparison_sentences.row_verdict,
    (Leak, "description"): passivity_sentences.loop_description,
    (Leak, "energy_text"): passivity_sentences.leak_energy_text,
    (Limits, "answer"): limit_sentences.limits_answer,
    (Limits, "assumptions"): assumption_sentences.limits_assumptions,
    (MissingData, "sentence"): comparison_sentences.missing_data_sentence,
    (Passivity, "criteria"): passivity_sentences.described_criteria,
    (Passivity, "reason"): passivity_sentences.verdict_reason,
    (Spectrum, "description"): limit_sentences.spectrum_description,
    (Surface, "depth_range"): assumption_sentences.depth_range_text,
    (Surface, "law_parameters"): assumption_sentences.law_parameter_sentences,
}


def describe(value: object, name: str) -> Any:
    """Return a text about a result; see :func:`asperity.core.display.describe`.

    Raises:
        KeyError: if there is none of that name.
    """
    return _TEXTS[type(value), name](value)
