"""Every claim of the paper, in its order, and how to compute them."""

from __future__ import annotations

import re
from collections.abc import Callable, Iterable, Iterator
from contextlib import nullcontext
from difflib import get_close_matches

from asperity.errors import ParameterError
from asperity.paper import (  # noqa: F401 - each declares its claims
    claims_appendix,
    claims_conclusion,
    claims_experiments,
    claims_friction,
    claims_god_object,
    claims_laws,
    claims_limits,
    claims_passivity,
    claims_tables,
)
from asperity.paper.claim import DECLARED, Claim, Result
from asperity.paper.experiments import findings  # noqa: F401 - declares its claims
from asperity.processes import at_most, helped

# What is called after each claim: its result, how many are done, of how many.
Progress = Callable[[Result, int, int], None]

# Roman numbers of sections sort as text, up to VI.
CLAIMS: dict[str, Claim] = {
    claim.id: claim
    for claim in sorted(DECLARED, key=lambda one: (one.section.startswith("App."), one.section))
}
_OF_THE_PAPER = frozenset(CLAIMS)


def register(added: Claim) -> Claim:
    """Add a claim of your own to those that are computed.

    Raises:
        ParameterError: for an id that is taken.
    """
    if added.id in CLAIMS:
        raise ParameterError("claim", f"cannot be added: {added.id!r} is taken")
    CLAIMS[added.id] = added
    return added


def claim(name: str) -> Claim:
    """Return a claim by its id.

    Raises:
        ParameterError: if there is none; the nearest are offered.

    Example:
        >>> claim("eq-12").equations
        ('(12)',)
    """
    if not isinstance(name, str) or name not in CLAIMS:
        close = get_close_matches(str(name).lower(), [known.lower() for known in CLAIMS], n=3)
        text = str(name).strip("() ")
        close += [f"eq-{text}"] if text.isdecimal() else []
        near = [known for known in CLAIMS if known.lower() in close]
        hint = f"did you mean {' or '.join(map(repr, near))}? " if near else ""
        known = f"there are {len(CLAIMS)}, all listed without it, and fig-3 finds a figure's"
        raise ParameterError("claim", f"is unknown: {name!r}; {hint}{known}")
    return CLAIMS[name]


def find_claims(name: str) -> tuple[Claim, ...]:
    """Return the claims that a name stands for, in the order of the paper.

    Args:
        name: an id; the beginning of several, "table-1"; or what they are about: "fig-3",
            "Fig. 3", "(12)", "Remark 6".

    Raises:
        ParameterError: if there is none; the nearest are offered.

    Example:
        >>> [found.id for found in find_claims("fig-5")]
        ['sentence-V.A-cycles', 'sentence-V.A-settles']
    """
    if isinstance(name, str) and name not in CLAIMS and (wanted := _place(name)):
        found = tuple(one for one in CLAIMS.values() if wanted in _places(one))
        if found:
            return found
    return (claim(name),)


def _place(text: str) -> str:
    """Return a place of the paper however it is written: "fig3", "remark6", "12"."""
    return re.sub(r"[^a-z0-9]", "", text.lower()).replace("figure", "fig")


def _places(one: Claim) -> set[str]:
    """Return the places that a claim is about, the figures that its statement names too."""
    figures = re.findall(r"Fig\. \d+", one.statement)
    parts = one.id.split("-")
    beginnings = ["-".join(parts[:count]) for count in range(1, len(parts))]
    return {_place(text) for text in (*one.equations, *figures, *beginnings)}


def reproduce_claims(
    ids: Iterable[str] | None = None, progress: Progress | None = None, workers: int | None = None
) -> tuple[Result, ...]:
    """Compute claims and return their results, in the order of the paper.

    Args:
        ids: which, see :func:`find_claims`; all by default.
        progress: called after each claim.
        workers: processes to use; this one alone by default, on the command line one per core.

    Raises:
        ParameterError: for an unknown id, or a number of workers that is not positive.

    Example:
        >>> [result.verdict for result in reproduce_claims(["eq-10", "eq-12"])]
        ['holds with correction', 'holds']
    """
    if workers is not None and (
        isinstance(workers, bool) or workers != int(workers) or workers < 1
    ):
        raise ParameterError("workers", "must be a whole number, 1 or more", workers)
    if isinstance(ids, str):
        raise ParameterError("ids", "must be a sequence of ids, not one text", ids)
    wanted = None if ids is None else {found.id for given in ids for found in find_claims(given)}
    names = [name for name in CLAIMS if wanted is None or name in wanted]
    results = []
    with nullcontext() if workers is None else at_most(int(workers)):
        for result in _computed(names):
            results.append(result)
            if progress is not None:
                progress(result, len(results), len(names))
    return tuple(results)


def _run(name: str) -> Result:
    return CLAIMS[name].run()


def _computed(names: list[str]) -> Iterator[Result]:
    """Yield results in order, computed here or ahead by other processes."""
    with helped(_run_ahead, names) as turns:
        for name, found in zip(names, turns, strict=True):
            yield _run(name) if found is None else found


def _run_ahead(name: str) -> Result | None:
    """Compute a claim of the paper: another process knows none that were added here."""
    return _run(name) if name in _OF_THE_PAPER else None
