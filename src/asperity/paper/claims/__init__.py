"""The paper's claims, one module per section: their registry in its order, and their evaluation."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Iterable, Mapping
from functools import partial
from typing import Any

from asperity.core.errors import ParameterError, nearest_names
from asperity.core.processes import precompute
from asperity.paper.claim import CATALOGUE, Claim, Computation, Result
from asperity.paper.claims import (
    design_limits,
    experiment_statements,
    friction_law,
    passivity_condition,
    simulated_claims,
    tables_and_remarks,
    texture_laws,
)
from asperity.paper.formula_checks import FORMULAS, FormulaRow

_MODULES = {
    "design_limits": design_limits,
    "experiment_statements": experiment_statements,
    "friction_law": friction_law,
    "passivity_condition": passivity_condition,
    "simulated_claims": simulated_claims,
    "tables_and_remarks": tables_and_remarks,
    "texture_laws": texture_laws,
}

Progress = Callable[[Result, int, int], None]
"""Called after each claim with its result, the number of finished claims and their total."""


def _paper_order(claim: Claim) -> tuple[bool, str, float]:
    """Sort key: section (Roman numerals up to VI sort as text), then equation number."""
    number = claim.id.removeprefix("eq-")
    position = float(number) if number.isdecimal() else math.inf
    return claim.section.startswith("App."), claim.section, position


def _catalogued_claim(claim_id: str, row: Mapping[str, Any]) -> Claim:
    """Return a claim of a table: its other entries are a function or what a formula needs."""
    about = {name: value for name, value in row.items() if name in Claim.__dataclass_fields__}
    about["equations"] = tuple(row.get("equations", ()))
    compute: Computation
    if "function" in row:
        module, name = row["function"].split(".")
        function = getattr(_MODULES[module], name)
        about.setdefault("statement", function.__doc__.partition("\n")[0])
        compute = partial(function, **row.get("arguments", {}))
    else:
        formula = {name: value for name, value in row.items() if name not in about}
        compute = FormulaRow(**formula).check
    return Claim(claim_id, compute=compute, **about)


_ROWS = [*FORMULAS.items(), *CATALOGUE.items()]
CLAIMS: dict[str, Claim] = {
    claim.id: claim
    for claim in sorted([_catalogued_claim(*row) for row in _ROWS], key=_paper_order)
}


def get_claim(claim_id: str) -> Claim:
    """Return a claim by its id.

    Raises:
        ParameterError: if there is none; the message suggests similar ids.

    Example:
        >>> get_claim("eq-12").equations
        ('(12)',)
    """
    if not isinstance(claim_id, str) or claim_id not in CLAIMS:
        equation = f"eq-{str(claim_id).strip('() ')}"
        hint = nearest_names(equation if equation in CLAIMS else str(claim_id), CLAIMS)
        listing = "run without it to list them; fig-3 selects the claims of a figure"
        reason = f"is unknown: {claim_id!r}; {hint}there are {len(CLAIMS)} claims: {listing}"
        raise ParameterError("claim", reason)
    return CLAIMS[claim_id]


def find_claims(reference: str) -> tuple[Claim, ...]:
    """Return the claims selected by a reference, in the order of the paper.

    Args:
        reference: an id, the first words of several ids ("table-1"), or a place in the paper:
            "fig-3", "Fig. 3", "(12)", "Remark 6".

    Raises:
        ParameterError: if there is none; the message suggests similar ids.

    Example:
        >>> [claim.id for claim in find_claims("fig-5")]
        ['sentence-V.A-cycles', 'sentence-V.A-settles']
    """
    if isinstance(reference, str) and reference not in CLAIMS:
        wanted = _normalize_reference(reference)
        selected = [claim for claim in CLAIMS.values() if wanted in _claim_references(claim)]
        if wanted and selected:
            return tuple(selected)
    return (get_claim(reference),)


def _normalize_reference(text: str) -> str:
    """Return the canonical form of a reference: "fig3", "remark6", "12"."""
    return re.sub(r"[^a-z0-9]", "", text.lower()).replace("figure", "fig")


def _claim_references(entry: Claim) -> set[str]:
    """Return the references that select a claim, including the figures its statement names."""
    figures = re.findall(r"Fig\. \d+", entry.statement)
    parts = entry.id.split("-")
    prefixes = ["-".join(parts[:count]) for count in range(1, len(parts))]
    return {_normalize_reference(text) for text in (*entry.equations, *figures, *prefixes)}


def reproduce_claims(
    ids: Iterable[str] | None = None, progress: Progress | None = None
) -> tuple[Result, ...]:
    """Compute claims and return their results in the order of the paper.

    Args:
        ids: references, see :func:`find_claims`; all claims by default.
        progress: called after each claim.

    Raises:
        ParameterError: if an id is unknown.

    Example:
        >>> [result.verdict for result in reproduce_claims(["eq-10", "eq-12"])]
        ['holds with correction', 'holds']
    """
    if isinstance(ids, str):
        raise ParameterError("ids", "must be a sequence of ids, not one text", ids)
    names = list(CLAIMS)
    if ids is not None:
        selected = {claim.id for reference in ids for claim in find_claims(reference)}
        names = [name for name in CLAIMS if name in selected]
    results: list[Result] = []
    with precompute(_run_claim, names) as precomputed:
        for name, result in zip(names, precomputed, strict=True):
            results.append(result or _run_claim(name))  # none: no worker has computed it
            if progress is not None:
                progress(results[-1], len(results), len(names))
    return tuple(results)


def _run_claim(claim_id: str) -> Result:
    return CLAIMS[claim_id].run()
