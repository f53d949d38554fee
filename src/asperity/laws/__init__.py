"""The laws: the mathematics of each texture algorithm, symbols in, symbols out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence
from itertools import pairwise

from asperity.core.arguments import Argument
from asperity.core.errors import LawError, ParameterError, suggest_names
from asperity.laws.a_groove_wall_normal import LAW as A
from asperity.laws.b_groove_texture_normal import LAW as B
from asperity.laws.c_change_of_height import LAW as C
from asperity.laws.d_god_object import LAW as D
from asperity.laws.e_god_object_wall_normal import LAW as E
from asperity.laws.f_friction_modulation import LAW as F
from asperity.laws.friction import FRICTION_ARGUMENTS
from asperity.laws.g_force_shading import LAW as G
from asperity.laws.h_split_god_object import LAW as H
from asperity.laws.law import Law as Law
from asperity.laws.w_smooth_wall import LAW as W

# In the order of the tables of the paper, the smooth wall first.
LAWS: dict[str, Law] = {law.letter: law for law in (W, A, B, C, D, E, F, G, H)}


def _declared_arguments(laws: Iterable[Law]) -> dict[str, Argument]:
    return {name: argument for law in laws for name, argument in law.arguments.items()}


SHIPPED_LAW_ARGUMENTS = _declared_arguments(LAWS.values()) | FRICTION_ARGUMENTS
"""The parameters of the shipped laws, and those of friction, by name."""

REGISTERED_LAWS: dict[str, Law] = dict(LAWS)
"""Shipped and registered laws by letter."""


def register(law: Law) -> Law:
    """Register a user-defined law, so that scenes and commands find it by letter or name.

    Raises:
        LawError: for a letter or a name that is taken, or a parameter that has another unit in
            a registered law.

    Example:
        >>> register(Law("C", "mine", "vertical", lambda c: c.k * c.depth * c.w))
        Traceback (most recent call last):
        ...
        asperity.core.errors.LawError: law C (mine): 'C' is taken by law C (change-of-height)
    """
    for name in (law.letter, law.name):
        other = _find_registered(name)
        if other is not None:
            raise LawError(f"law {law}: {name!r} is taken by law {other}")
    units = {name: argument.unit for name, argument in registered_arguments().items()}
    for name, argument in law.arguments.items():
        if units.get(name, argument.unit) != argument.unit:
            raise LawError(
                f"law {law}: its parameter {name!r} is in [{argument.unit or '1'}], that of "
                f"another law in [{units[name] or '1'}]; declare it as an Argument with that unit"
            )
    REGISTERED_LAWS[law.letter] = law
    return law


def registered_arguments(laws: Iterable[Law] = REGISTERED_LAWS.values()) -> dict[str, Argument]:
    """Return the parameters of laws by name, and those of friction; default: registered laws."""
    return FRICTION_ARGUMENTS | _declared_arguments(laws)


def check_parameters_apply(requested: Iterable[str], laws: Sequence[Law]) -> None:
    """Check that each requested parameter is one of some of the laws.

    Raises:
        ParameterError: otherwise; the message names the laws that take the parameter.
    """
    taken = registered_arguments(laws)
    for name in requested:
        takers = [law.letter for law in REGISTERED_LAWS.values() if name in law.arguments]
        if takers and name not in taken:
            letters = ", ".join([law.letter for law in laws])
            reason = f"law {letters} does not take it; law {', '.join(takers)} does"
            raise ParameterError(name, f"has no effect: {reason}")


def distribute_parameters(
    values: Mapping[str, float], laws: Sequence[Law]
) -> list[dict[str, float]]:
    """Return for each law the values of the parameters that it declares.

    Raises:
        ParameterError: for a parameter that none of the laws declares; it suggests similar names.
    """
    declared = _declared_arguments(laws)
    for name in values:
        if name not in declared:
            hint = "those laws have no parameters"
            if declared:
                hint = suggest_names(name, declared)
            letters = ", ".join([law.letter for law in laws])
            reason = f"contains {name!r}, which is no parameter of the laws {letters}"
            raise ParameterError("law_parameters", f"{reason}; {hint}")
    return [{name: values[name] for name in law.arguments if name in values} for law in laws]


def _find_registered(name: str) -> Law | None:
    normalized = _normalized_name(name)
    for law in REGISTERED_LAWS.values():
        if normalized in {_normalized_name(law.letter), _normalized_name(law.name)}:
            return law
    return None


def _normalized_name(name: str) -> str:
    return name.strip().lower().replace("_", "-").replace(" ", "-")


def find_law(law: str | Law) -> Law:
    """Return a law by letter or by name; a :class:`Law` is returned as it is.

    Raises:
        ParameterError: if no law has that letter or name; the message suggests similar names.

    Example:
        >>> find_law("b").name, find_law("god-object").letter
        ('groove-texture-normal', 'D')
    """
    if isinstance(law, Law):
        return law
    if not isinstance(law, str):
        raise ParameterError("law", "must be a letter, a name or a Law", law)
    registered = _find_registered(law)
    if registered is not None:
        return registered
    names = [name for known in REGISTERED_LAWS.values() for name in (known.letter, known.name)]
    raise ParameterError("law", f"is unknown: {law!r}; {suggest_names(law, names)}")


def find_laws(laws: str | Sequence[str | Law]) -> tuple[Law, ...]:
    """Return several laws from letters ("WABC"), a name, or a sequence of both.

    A string with commas or semicolons is split there; otherwise each of its letters is a law,
    unless the whole string is the name of one.

    Raises:
        ParameterError: for an unknown law, a law named twice, or none at all.

    Example:
        >>> [law.letter for law in find_laws("WBD")]
        ['W', 'B', 'D']
    """
    if isinstance(laws, str):
        names = laws.replace(";", ",").split(",")
        parts: list[str | Law] = [part.strip() for part in names if part.strip()]
        if len(parts) == 1 and "-" not in laws and _find_registered(laws) is None:
            parts = list("".join(laws.split()).strip(",;"))
    else:
        parts = list(laws)
    named = tuple(map(find_law, parts))
    if not named:
        raise ParameterError("laws", "must name at least one law", laws)
    for letter, following in pairwise(sorted([law.letter for law in named])):
        if letter == following:
            raise ParameterError("laws", f"names law {letter} twice", laws)
    return named
