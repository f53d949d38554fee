"""Claims of the paper: a statement, the evidence computed for it and the verdict that follows."""

from __future__ import annotations

import math
import string
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from asperity.core.checks import FloatArray
from asperity.core.errors import AsperityError
from asperity.core.files import OMITTED, Serializable, read_toml, to_plain_data

Verdict = Literal["holds", "holds with correction", "does not hold", "undecided"]
VERDICTS: tuple[Verdict, ...] = ("holds", "holds with correction", "does not hold", "undecided")
Number = float | str | list[float]

TOLERANCE = 1e-9
"""Relative to the largest entry; the compared values have double precision or better."""
# By increasing severity: a claim is as good as the weakest of its parts.
_SEVERITY: tuple[Verdict, ...] = ("holds", "holds with correction", "undecided", "does not hold")


@dataclass(frozen=True)
class Evidence:
    """Evidence for a verdict.

    Attributes:
        summary: one line with the decisive numbers.
        numbers: computed values by name.
        correction: the corrected statement; empty if none is needed or known.
        fitted: parameters that were fitted or guessed, since the paper does not state them.
    """

    summary: str
    numbers: Mapping[str, Number] = field(default_factory=dict)
    correction: str = ""
    fitted: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return plain data; every number is a float, including counts and truth values."""
        numbers = {
            name: value if isinstance(value, str) else to_plain_data(np.asarray(value, dtype=float))
            for name, value in self.numbers.items()
        }
        texts = {"correction": self.correction, "fitted": self.fitted}
        return {"summary": self.summary, "numbers": numbers, **texts}


@dataclass(frozen=True)
class Check(Evidence):
    """Evidence with the verdict that follows from it, of one comparison or of several combined.

    Attributes:
        verdict: the verdict of this comparison alone.
    """

    verdict: Verdict = "undecided"


Computation = Callable[[], Check]


@dataclass(frozen=True)
class Result(Serializable):
    """A claim with its verdict.

    Attributes:
        id: id of the claim.
        equations: equation numbers of the paper that it covers.
        section: section of the paper.
        statement: the statement, paraphrased.
        verdict: ``"holds"`` (as printed), ``"holds with correction"`` (wrong as printed, right
            after a small change), ``"does not hold"`` or ``"undecided"``.
        evidence: the evidence for the verdict.
        flips_under: a change under which the verdict would be different.
    """

    id: str
    equations: tuple[str, ...]
    section: str = field(metadata=OMITTED)
    statement: str
    verdict: Verdict
    evidence: Evidence
    flips_under: str = ""


@dataclass(frozen=True)
class Claim:
    """A statement of the paper and the computation that judges it.

    Attributes:
        id: short and stable, such as ``"eq-12"``.
        equations: equation numbers of the paper that it covers, such as ``("(12)",)``.
        section: section of the paper.
        statement: the statement, paraphrased.
        compute: computes the evidence and derives the verdict.
        flips_under: a change under which the verdict is different; optional for your own claims.
        correction: the corrected statement, which the evidence carries if it holds and the printed
            one does not.
        fitted: parameters that were fitted or guessed; by default those that the check names.
        summary: sentence of the evidence for :func:`~asperity.paper.claim.format_summary`; by
            default that of the check, which is inserted for ``{found}``.
        instead: what is true if the printed statement does not hold and no correction is computed;
            also with numbers inserted.
    """

    id: str
    equations: tuple[str, ...]
    section: str
    statement: str
    compute: Computation
    flips_under: str = ""
    correction: str = ""
    fitted: str = ""
    summary: str = ""
    instead: str = ""

    def run(self) -> Result:
        """Compute the evidence and return it with the verdict.

        An :class:`AsperityError` leaves the claim undecided, with the reason.
        """
        try:
            check = self.compute()
        except AsperityError as error:
            check = Check(f"could not be computed: {error}")
        else:
            check = self._add_texts(check)
        about = self.id, self.equations, self.section, self.statement
        return Result(*about, check.verdict, check, self.flips_under)

    def _add_texts(self, check: Check) -> Check:
        numbers = {"found": check.summary, **check.numbers}
        summary = format_summary(self.summary or "{found}", numbers)
        right = {
            "holds with correction": self.correction,
            "does not hold": format_summary(self.instead, numbers),
        }
        correction = right.get(check.verdict) or check.correction
        fitted = self.fitted or check.fitted
        return replace(check, summary=summary, correction=correction, fitted=fitted)


def format_summary(template: str, numbers: Mapping[str, Number]) -> str:
    """Return a sentence with numbers inserted.

    A field is ``{name:FORMAT*FACTOR UNIT}``: the number is multiplied by the factor, formatted and
    followed by the unit; each part may be left out. A list is shown as its least and greatest
    value. A star in a name stands for any text, with which each number that fits is shown.

    Args:
        template: the sentence with its fields.
        numbers: computed values by name.

    Example:
        >>> found = {"work": 0.0123, "q": [1.0, 2.5, 2.0], "gain of A": 3.0, "gain of E": 4.0}
        >>> format_summary("{work:.1f*1e3} mJ, q from {q:.1f}, {gain of *:.0f J}", found)
        '12.3 mJ, q from 1.0 to 2.5, A 3 J, E 4 J'
    """
    return _SummaryFormatter().vformat(template, (), numbers)


class _SummaryFormatter(string.Formatter):
    """Look numbers up by their whole names, which may contain dots and brackets."""

    def get_field(self, field_name: str, _args: Sequence[Any], numbers: Any) -> tuple[Any, str]:
        start, star, end = field_name.partition("*")
        if not star:
            return numbers[field_name], field_name
        stop = -len(end) or None
        fitting = [name for name in numbers if name.startswith(start) and name.endswith(end)]
        return {name[len(start) : stop]: numbers[name] for name in fitting}, field_name

    def format_field(self, value: Any, format_spec: str) -> str:
        if isinstance(value, dict):
            parts = [
                f"{name} {self.format_field(part, format_spec)}" for name, part in value.items()
            ]
            return ", ".join(parts)
        if isinstance(value, list):
            least = self.format_field(min(value), format_spec)
            greatest = self.format_field(max(value), format_spec)
            return f"{least} to {greatest}"
        number_format, space, unit = format_spec.partition(" ")
        number_format, _star, factor = number_format.partition("*")
        if factor:
            value = value * float(factor)
        return format(value, number_format) + space + unit


CATALOGUE = read_toml("claims", Path(__file__).with_name("claims.toml"))
"""Function, place, correction and falsifying change of each claim that a function computes."""


def check_values(
    quantity: str,
    *,
    printed: ArrayLike | None,
    reference: ArrayLike,
    corrected: ArrayLike | None = None,
    correction: str = "",
    tolerance: float = TOLERANCE,
) -> Check:
    """Compare printed and corrected values with reference values.

    Errors are relative to the largest absolute entry of the reference.

    Args:
        quantity: name of the compared quantity.
        printed: values of the printed formula; ``None`` if it has none.
        reference: values computed independently of it, same shape.
        corrected: values of the corrected formula, same shape; ``None`` if no correction is known.
        correction: the corrected statement.
        tolerance: largest relative error at which values agree.

    Example:
        >>> check = check_values("1 + 1", printed=3, corrected=2, reference=2.0, correction="2")
        >>> check.verdict, check.summary
        ('holds with correction', '1 + 1: printed 3, corrected 2, true 2')
    """
    target = np.asarray(reference, dtype=float)
    if np.isnan(target).any() or target.size == 0:
        return Check(f"{quantity}: could not be computed")
    agrees = relative_error(printed, target) <= tolerance
    compared = {"as printed": printed}
    is_right = None
    if corrected is not None:
        is_right = relative_error(corrected, target) <= tolerance
        if not agrees:
            compared["corrected"] = corrected
    return check_statement(
        f"{quantity}: {_format_errors(compared, target)}",
        printed=agrees,
        corrected=is_right,
        correction=correction,
        numbers=_error_numbers(quantity, compared, target),
    )


def _format_errors(compared: Mapping[str, ArrayLike | None], target: FloatArray) -> str:
    if target.ndim == 0:
        values = {name.removeprefix("as "): value for name, value in compared.items()}
        values["true"] = target
        return ", ".join(
            [
                f"{name} {float(np.asarray(value)):.6g}"
                for name, value in values.items()
                if value is not None
            ]
        )
    errors = {
        name: _format_error(relative_error(values, target)) for name, values in compared.items()
    }
    if len(errors) == 1:
        return errors["as printed"]
    return ", ".join([f"{name} {error}" for name, error in errors.items()])


def _error_numbers(
    quantity: str, compared: Mapping[str, ArrayLike | None], target: FloatArray
) -> dict[str, Number]:
    """Return the relative errors, and for scalars the values themselves."""
    numbers: dict[str, Number] = {}
    for name, values in compared.items():
        numbers[f"{quantity}, error {name}"] = relative_error(values, target)
        if values is not None and target.ndim == 0:
            numbers[f"{quantity}, {name}"] = float(np.asarray(values))
    if target.ndim == 0:
        numbers[f"{quantity}, true"] = float(target)
    return numbers


def check_statement(
    summary: str = "",
    *,
    printed: bool | np.bool_ | None,
    corrected: bool | np.bool_ | None = None,
    correction: str = "",
    numbers: Mapping[str, Number] | None = None,
    **named_numbers: Number,
) -> Check:
    """Judge a statement that is either true or false.

    Args:
        summary: one line with the computed numbers; by default the claim has it.
        printed: whether the printed statement is true; ``None`` if it cannot be computed.
        corrected: whether the corrected one is true; ``None`` if no correction is known.
        correction: the corrected statement.
        numbers: computed values by name.
        **named_numbers: further values; underscores in names stand for spaces.
    """
    known = {name.replace("_", " "): value for name, value in named_numbers.items()}
    known |= numbers or {}
    if printed is None:
        return Check(summary, known)
    if printed:
        return Check(summary, known, verdict="holds")
    if corrected:
        return Check(summary, known, correction, verdict="holds with correction")
    known_correction = correction if corrected is None else ""
    return Check(summary, known, known_correction, verdict="does not hold")


def check_observation(numbers: Mapping[str, Number] | None = None) -> Check:
    """Leave a statement on perception or on materials undecided, since it cannot be computed."""
    return check_statement(printed=None, numbers=numbers)


def combine_checks(*checks: Check) -> Check:
    """Combine checks: a claim is as good as the weakest of its parts."""
    worst = max(checks, key=lambda check: _SEVERITY.index(check.verdict))
    numbers = {name: value for check in checks for name, value in check.numbers.items()}
    summary = "; ".join([check.summary for check in checks if check.summary])
    correction = _join_once([check.correction for check in checks])
    fitted = _join_once([check.fitted for check in checks])
    return Check(summary, numbers, correction, fitted, worst.verdict)


def _join_once(texts: Sequence[str]) -> str:
    """Return the texts that are not empty, each once."""
    return "; ".join(dict.fromkeys(filter(None, texts)))


def relative_error(value: ArrayLike | None, reference: ArrayLike) -> float:
    """Return max |value - reference| / max |reference|; infinite if they cannot be compared."""
    target = np.asarray(reference, dtype=float)
    if value is None:
        return math.inf
    values = np.asarray(value, dtype=float)
    if values.shape != target.shape or np.isnan(values).any():
        return math.inf
    if not (np.isfinite(values).all() and np.isfinite(target).all()):
        return 0.0 if np.array_equal(values, target) else math.inf
    scale = float(np.abs(target).max())
    difference = float(np.abs(values - target).max())
    if scale > 0.0:
        return difference / scale
    return 0.0 if difference == 0.0 else math.inf


def _format_error(error: float) -> str:
    return f"off by {error:.2g}" if math.isfinite(error) else "not a value to compare"
