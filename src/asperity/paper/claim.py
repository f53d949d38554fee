"""A claim of the paper: its statement, code that computes evidence, and a verdict that follows."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from typing import Any, Literal

import numpy as np
from numpy.typing import ArrayLike

from asperity.checks import FloatArray
from asperity.errors import AsperityError
from asperity.files import Record, plain, record
from asperity.paper.changes import Change

Verdict = Literal["holds", "holds with correction", "does not hold", "undecided"]
VERDICTS: tuple[Verdict, ...] = ("holds", "holds with correction", "does not hold", "undecided")
Number = float | str | list[float]

# Relative to the largest entry; what is compared is computed in double precision or better.
TOLERANCE = 1e-9
# From the mildest to the gravest: a claim is as good as the weakest of its parts.
_GRAVITY: tuple[Verdict, ...] = ("holds", "holds with correction", "undecided", "does not hold")


@dataclass(frozen=True)
class Evidence:
    """What a verdict rests on.

    Attributes:
        summary: one line, with the numbers that decide.
        numbers: everything computed, by what it is.
        correction: the corrected statement; empty where none is needed or known.
        fitted: what the paper does not state and was fitted or guessed; empty where nothing was.
    """

    summary: str
    numbers: Mapping[str, Number] = field(default_factory=dict)
    correction: str = ""
    fitted: str = ""

    def to_dict(self) -> dict[str, Any]:
        """Return plain data, every number a float: counts and truth values among them too."""
        numbers = {
            name: value if isinstance(value, str) else plain(np.asarray(value, dtype=float))
            for name, value in self.numbers.items()
        }
        return {
            **record(self, "summary"),
            "numbers": numbers,
            **record(self, "correction", "fitted"),
        }


@dataclass(frozen=True)
class Check:
    """One comparison, or several put together.

    Attributes:
        verdict: what it alone gives.
        says: in words, with its numbers.
        numbers: see :class:`Evidence`.
        correction: see :class:`Evidence`.
        fitted: see :class:`Evidence`.
    """

    verdict: Verdict
    says: str
    numbers: Mapping[str, Number] = field(default_factory=dict)
    correction: str = ""
    fitted: str = ""


Computation = Callable[[], Check]


@dataclass(frozen=True)
class Result(Record):
    """A claim with its verdict.

    Attributes:
        id: of the claim.
        equations: numbers of the paper that it covers.
        section: of the paper.
        statement: in our words.
        verdict: ``"holds"`` (as printed), ``"holds with correction"`` (as printed it is wrong, a
            small change makes it right), ``"does not hold"`` or ``"undecided"``.
        evidence: what the verdict follows from.
        flips_under: what would give another verdict, in words.
    """

    written = "id equations statement verdict evidence flips_under"

    id: str
    equations: tuple[str, ...]
    section: str
    statement: str
    verdict: Verdict
    evidence: Evidence
    flips_under: str = ""


@dataclass(frozen=True)
class Claim:
    """A statement of the paper and the code that judges it.

    Attributes:
        id: short and stable, such as ``"eq-12"``.
        equations: numbers of the paper that it covers, such as ``("(12)",)``.
        section: of the paper.
        statement: in our words.
        compute: computes the evidence and derives the verdict.
        flipped_by: a change under which the verdict is another one; a claim of the paper has one.
    """

    id: str
    equations: tuple[str, ...]
    section: str
    statement: str
    compute: Computation
    flipped_by: Change | None = None

    def run(self) -> Result:
        """Compute the evidence and return it with the verdict.

        What the package refuses to compute leaves the claim undecided, with the reason.
        """
        try:
            found = self.compute()
        except AsperityError as error:
            found = Check("undecided", f"could not be computed: {error}")
        evidence = Evidence(found.says, found.numbers, found.correction, found.fitted)
        flips_under = "" if self.flipped_by is None else self.flipped_by.says
        return Result(
            self.id, self.equations, self.section, self.statement, found.verdict, evidence,
            flips_under,
        )  # fmt: skip


DECLARED: list[Claim] = []
"""The claims of the paper, in the order in which their code is read."""


def judges(
    name: str, section: str, *equations: str, flipped_by: Change
) -> Callable[[Computation], Computation]:
    """Declare that a function judges a claim of the paper.

    The first line of its docstring is the statement.

    Args:
        name: id of the claim.
        section: of the paper.
        *equations: numbers of the paper that the claim covers.
        flipped_by: a change under which the verdict is another one.
    """

    def declare(compute: Computation) -> Computation:
        statement = (compute.__doc__ or "").partition("\n")[0]
        DECLARED.append(Claim(name, equations, section, statement, compute, flipped_by))
        return compute

    return declare


def judge(
    what: str,
    *,
    printed: ArrayLike | None,
    truth: ArrayLike,
    corrected: ArrayLike | None = None,
    correction: str = "",
    tolerance: float = TOLERANCE,
) -> Check:
    """Compare what is printed, and what would be right, with what is true.

    Errors are relative to the largest absolute entry of the truth.

    Args:
        what: is compared, in words.
        printed: the printed formula's values; ``None`` if it has none.
        truth: computed without it, same shape.
        corrected: the corrected formula's values, same shape; ``None`` if no correction is known.
        correction: the corrected statement.
        tolerance: up to which values agree.

    Example:
        >>> check = judge("1 + 1", printed=3.0, corrected=2.0, truth=1.0 + 1.0, correction="2")
        >>> check.verdict, check.says
        ('holds with correction', '1 + 1: printed 3, corrected 2, true 2')
    """
    target = np.asarray(truth, dtype=float)
    if np.isnan(target).any() or target.size == 0:
        return Check("undecided", f"{what}: could not be computed")
    off = relative_error(printed, target)
    left = math.inf if corrected is None else relative_error(corrected, target)
    agrees, repaired = off <= tolerance, left <= tolerance
    second = None if agrees else corrected
    numbers = _compared(what, printed, second, target)
    if target.ndim == 0:
        says = f"{what}: {_values(printed, second, target)}"
    elif second is None:
        says = f"{what}: {_off(off)}"
    else:
        says = f"{what}: as printed {_off(off)}, corrected {_off(left)}"
    if agrees:
        return Check("holds", says, numbers)
    known = correction if repaired or corrected is None else ""
    return Check("holds with correction" if repaired else "does not hold", says, numbers, known)


def _values(printed: ArrayLike | None, corrected: ArrayLike | None, target: FloatArray) -> str:
    known = {"printed": printed, "corrected": corrected, "true": target}
    shown = {name: value for name, value in known.items() if value is not None}
    return ", ".join(f"{name} {float(np.asarray(value)):.6g}" for name, value in shown.items())


def _compared(
    what: str, printed: ArrayLike | None, corrected: ArrayLike | None, target: FloatArray
) -> dict[str, Number]:
    """Return the errors of what is compared, and a single number itself."""
    numbers: dict[str, Number] = {}
    for name, values in (("as printed", printed), ("corrected", corrected)):
        if values is not None or name == "as printed":
            numbers[f"{what}, error {name}"] = relative_error(values, target)
        if values is not None and target.ndim == 0:
            numbers[f"{what}, {name}"] = float(np.asarray(values))
    if target.ndim == 0:
        numbers[f"{what}, true"] = float(target)
    return numbers


def decide(
    says: str,
    *,
    printed: bool | np.bool_ | None,
    corrected: bool | np.bool_ | None = None,
    correction: str = "",
    numbers: Mapping[str, Number] | None = None,
    **named: Number,
) -> Check:
    """Judge a statement that is true or not.

    Args:
        says: what was computed, with numbers.
        printed: whether the printed statement is true; ``None`` if that cannot be computed.
        corrected: whether the corrected one is; ``None`` if no correction is known.
        correction: the corrected statement.
        numbers: the evidence, by what it is.
        **named: more of it, underscores read as spaces.
    """
    known = {name.replace("_", " "): value for name, value in named.items()}
    known |= {} if numbers is None else dict(numbers)
    if printed is None:
        return Check("undecided", says, known)
    if printed:
        return Check("holds", says, known)
    if corrected:
        return Check("holds with correction", says, known, correction)
    return Check("does not hold", says, known, correction if corrected is None else "")


OBSERVED: dict[str, bool] = {}
"""What people felt, or measured on materials, by claim. Nobody was asked: it is empty."""


def observation(name: str, says: str, numbers: Mapping[str, Number] | None = None) -> Check:
    """Judge what no computation can: it stays undecided until somebody observes it."""
    return decide(says, printed=OBSERVED.get(name), numbers=numbers)


def settle(*checks: Check) -> Check:
    """Put checks together: a claim is as good as the weakest of its parts."""
    worst = max(checks, key=lambda check: _GRAVITY.index(check.verdict))
    numbers: dict[str, Number] = {}
    for check in checks:
        numbers.update(check.numbers)
    summary = "; ".join(check.says for check in checks)
    correction, fitted = (
        "; ".join(dict.fromkeys(text for text in texts if text))
        for texts in zip(*((check.correction, check.fitted) for check in checks), strict=True)
    )
    return Check(worst.verdict, summary, numbers, correction, fitted)


def relative_error(value: ArrayLike | None, target: ArrayLike) -> float:
    """Return max |value - target| / max |target|; infinite where they cannot be compared."""
    goal = np.asarray(target, dtype=float)
    if value is None:
        return math.inf
    given = np.asarray(value, dtype=float)
    if given.shape != goal.shape or np.isnan(given).any():
        return math.inf
    if not (np.isfinite(given).all() and np.isfinite(goal).all()):
        return 0.0 if np.array_equal(given, goal) else math.inf
    scale = float(np.abs(goal).max())
    difference = float(np.abs(given - goal).max())
    return difference / scale if scale > 0.0 else (0.0 if difference == 0.0 else math.inf)


def _off(error: float) -> str:
    return f"off by {error:.2g}" if math.isfinite(error) else "not a value to compare"
