"""What the simulated experiments say of the paper's sentences: verdicts from numbers."""

from __future__ import annotations

from functools import lru_cache

from asperity.paper.claim import DECLARED, Check, decide, judges
from asperity.paper.experiments.bump import Bump, bump_experiment
from asperity.paper.experiments.passivity import count_cycles
from asperity.paper.experiments.scanning import scanning_experiment
from asperity.paper.experiments.settings import LAG
from asperity.simulation.scan import Stroke

# Lags that are tried: the paper states none.
LAGS = (0, 4, 5, 6, 7)
# An energy is marginal below this part of the largest one of the stroke.
MARGINAL = 0.05
CLEAR = 0.01


_count = lru_cache(maxsize=64)(count_cycles)


@lru_cache(maxsize=16)
def _strokes(law: str) -> tuple[Stroke, ...]:
    return scanning_experiment(law).of(law)


@lru_cache(maxsize=16)
def _bumps(law: str) -> tuple[Bump, ...]:
    return bump_experiment(law).of(law)


@judges("sentence-V.A-cycles", "V.A")
def textured_walls_cycle() -> Check:
    """At 2000 N/m W settles; textured with A or F it enters a limit cycle (Fig. 5).

    W must settle from every start; A and F must cycle for good from at least a quarter.
    """
    counts = {(law, d): _count(law, 1.0, d) for law in "WAF" for d in LAGS}

    def shown(delay: int) -> bool:
        wall, a, f = (counts[law, delay] for law in "WAF")
        return wall.cycles == 0 and min(a.cycles, f.cycles) >= 0.25 * wall.starts

    says = "; ".join(
        f"lag {d}: {', '.join(f'{law} {counts[law, d].cycles}' for law in 'WAF')}" for d in LAGS
    )
    lags = ", ".join(str(d) for d in LAGS if shown(d))
    numbers = {f"{law}, lag {d}: cycles": float(one.cycles) for (law, d), one in counts.items()}
    slow = {f"{law}, lag {d}: calms down slowly": float(one.slow)
            for (law, d), one in counts.items()}  # fmt: skip
    return decide(
        f"of {counts['W', 0].starts} starts cycle for good: {says}",
        printed=shown(0),
        corrected=shown(LAG),
        correction=f"With a loop lag of {lags} samples, which the paper does not state, at a "
        "working point where x and z couple",
        numbers=numbers | slow,
    )


@judges("sentence-V.A-settles", "V.A")
def divided_walls_settle() -> Check:
    """Divided by 5.1 and 8.3 the stiffness of A and F lets them settle (Fig. 5)."""
    counts = [_count(law, by, d) for law, by in (("A", 5.1), ("F", 8.3)) for d in LAGS]
    cycling = sum(one.cycles for one in counts)
    starts = sum(one.starts for one in counts)
    lags = ", ".join(str(lag) for lag in LAGS)
    numbers = {f"{one.law}/{one.divisor:g}, lag {one.delay}": float(one.cycles) for one in counts}
    return decide(
        f"A/5.1 and F/8.3 at lags of {lags} samples: {cycling} of {starts} starts cycle",
        printed=cycling == 0,
        numbers=numbers,
    )


def _numbers(strokes: tuple[Stroke, ...]) -> dict[str, float]:
    numbers = {}
    for i, one in enumerate(strokes):
        where = f"{one.law} {i + 1}, {one.speed:g} m/s"
        numbers[f"{where}: x [J]"] = one.energy[0]
        numbers[f"{where}: z [J]"] = one.energy[2]
        numbers[f"{where}: field [J]"] = one.field
        numbers[f"{where}: the paper's sum [J]"] = one.same_sample
    return numbers


def _range(strokes: tuple[Stroke, ...], axis: int) -> str:
    values = [1e3 * one.energy[axis] for one in strokes]
    return f"{min(values):+.3g} to {max(values):+.3g} mJ along {'xyz'[axis]}"


def _judged(says: str, strokes: tuple[Stroke, ...], printed: bool, correction: str = "") -> Check:
    return decide(says, printed=printed, correction=correction, numbers=_numbers(strokes))


@judges("sentence-V.B-A", "V.B")
def law_a_gains() -> Check:
    """On a stroke A gains energy along z, none along x (Fig. 6)."""
    strokes = _strokes("A")
    feeding = sum(one.feeds for one in strokes)
    return _judged(
        f"{feeding} of {len(strokes)} hands and speeds are fed: {_range(strokes, 2)}, "
        f"{_range(strokes, 0)}",
        strokes,
        all(one.feeds and one.energy[2] > 0.0 and one.energy[0] == 0.0 for one in strokes),
    )


@judges("sentence-V.B-G", "V.B")
def law_g_is_passive() -> Check:
    """On a stroke G is marginally passive along x and z (Fig. 6).

    Marginally: along each axis what it gives is small against what it takes, or less.
    """
    strokes = _strokes("G")
    feeding = sum(one.feeds for one in strokes)
    passive = all(
        max(one.energy[0], one.energy[2]) <= MARGINAL * max(map(abs, one.energy)) for one in strokes
    )
    return _judged(
        f"exact ledger: {_range(strokes, 0)}, {_range(strokes, 2)}; its field feeds "
        f"{feeding} of {len(strokes)} hands and speeds",
        strokes,
        passive,
        "G feeds slow hands along both axes; its field is not conservative",
    )


@judges("sentence-V.B-D", "V.B")
def law_d_is_passive() -> Check:
    """On a stroke D is marginally passive along z, clearly along x (Fig. 6)."""
    strokes = _strokes("D")
    along_z = all(abs(one.energy[2]) <= MARGINAL * 1e-3 for one in strokes)
    along_x = all(one.energy[0] < -CLEAR * 1e-3 for one in strokes)
    field = max(abs(1e3 * one.field) for one in strokes)
    return _judged(
        f"exact ledger: {_range(strokes, 0)}, {_range(strokes, 2)}; its field gives at most "
        f"{field:.2g} mJ",
        strokes,
        along_z and along_x,
        "D's field gives and takes nothing on a stroke; what is left is sampling. Passive along x "
        "is a proxy that remembers where it was, which is another law than (17)",
    )


@judges("sentence-V.B-F", "V.B")
def law_f_is_passive() -> Check:
    """On a stroke F is marginally passive along z, passive along x (Fig. 6)."""
    strokes = _strokes("F")
    return _judged(
        f"{_range(strokes, 0)}, {_range(strokes, 2)}",
        strokes,
        all(
            one.energy[0] < 0.0 and abs(one.energy[2]) <= MARGINAL * abs(one.energy[0])
            for one in strokes
        ),
    )


@judges("sentence-V.C-A", "V.C")
def law_a_throws_off() -> Check:
    """On a 20 mm bump A gains in jumps and loses contact (Fig. 7)."""
    bumps = _bumps("A")
    says = "; ".join(
        f"{one.entry}: {1e3 * one.total:+.3g} mJ, up to {1e3 * one.jump:.3g} mJ in 20 ms, contact "
        f"lost {one.lost} times" for one in bumps
    )  # fmt: skip
    holds = all(one.total > 0.0 and one.jump > 0.25 * one.total and one.lost > 1 for one in bumps)
    return decide(says, printed=holds, numbers=_of_bumps(bumps))


@judges("sentence-V.C-D", "V.C")
def law_d_is_balanced() -> Check:
    """On a 20 mm bump D keeps its energy in balance (Fig. 7)."""
    bumps, lively = _bumps("D"), _bumps("A")
    says = "; ".join(
        f"{one.entry}: {1e3 * one.total:+.3g} mJ against {1e3 * other.total:+.3g} of A, up to "
        f"{1e3 * one.top:.0f} mm high" for one, other in zip(bumps, lively, strict=True)
    )  # fmt: skip
    balanced = all(
        abs(one.total) <= MARGINAL * other.total for one, other in zip(bumps, lively, strict=True)
    )
    return decide(f"{says} of 20", printed=balanced, numbers=_of_bumps(bumps))


def _of_bumps(bumps: tuple[Bump, ...]) -> dict[str, float]:
    numbers = {}
    for one in bumps:
        numbers[f"{one.entry}: energy [J]"] = one.total
        numbers[f"{one.entry}: in 20 ms [J]"] = one.jump
        numbers[f"{one.entry}: contact lost"] = float(one.lost)
        numbers[f"{one.entry}: highest [m]"] = one.top
        numbers[f"{one.entry}: ledger does not close by"] = one.closure
    return numbers


FINDINGS = tuple(claim.id for claim in DECLARED if claim.compute.__module__ == __name__)
"""Ids of the sentences that are judged here."""
