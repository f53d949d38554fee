"""The laws: the mathematics of each texture algorithm, symbols in, symbols out."""

from __future__ import annotations

from collections.abc import Iterable, Mapping, Sequence

from asperity.arguments import Argument
from asperity.errors import LawError, ParameterError, nearest_names
from asperity.laws.a_groove_wall_normal import LAW as A
from asperity.laws.b_groove_texture_normal import LAW as B
from asperity.laws.c_change_of_height import LAW as C
from asperity.laws.d_god_object import LAW as D
from asperity.laws.e_god_object_wall_normal import LAW as E
from asperity.laws.f_friction_modulation import LAW as F
from asperity.laws.g_force_shading import LAW as G
from asperity.laws.h_split_god_object import LAW as H
from asperity.laws.law import Law as Law
from asperity.laws.w_smooth_wall import LAW as W

# In the order of the paper's tables, the smooth wall first.
LAWS: dict[str, Law] = {law.letter: law for law in (W, A, B, C, D, E, F, G, H)}

LAW_ARGUMENTS: dict[str, Argument] = {
    name: argument for law in LAWS.values() for name, argument in law.arguments.items()
}
"""The parameters of the shipped laws, by name."""

KNOWN_LAWS: dict[str, Law] = dict(LAWS)
"""The laws that are found by letter or name: the shipped ones and those that were registered."""


def register(law: Law) -> Law:
    """Make a law of your own known by its letter and its name, in scenes and commands too.

    Raises:
        LawError: for a letter or a name that is taken, or a parameter that has another unit in
            a law that is known.

    Example:
        >>> register(Law("C", "mine", "vertical", lambda c: c.k * c.depth * c.w))
        Traceback (most recent call last):
        ...
        asperity.errors.LawError: law C (mine): 'C' is taken by law C (change-of-height)
    """
    for name in (law.letter, law.name):
        known = _known(name)
        if known is not None:
            raise LawError(f"law {law}: {name!r} is taken by law {known}")
    units = {name: argument.unit for name, argument in known_arguments().items()}
    for name, argument in law.arguments.items():
        if units.get(name, argument.unit) != argument.unit:
            raise LawError(
                f"law {law}: its parameter {name!r} is in [{argument.unit or '1'}], that of "
                f"another law in [{units[name] or '1'}]; declare it as an Argument with that unit"
            )
    KNOWN_LAWS[law.letter] = law
    return law


def known_arguments(laws: Iterable[Law] | None = None) -> dict[str, Argument]:
    """Return the parameters of laws by name, of all that are known unless told otherwise."""
    chosen = KNOWN_LAWS.values() if laws is None else laws
    return {name: argument for law in chosen for name, argument in law.arguments.items()}


def shared_out(values: Mapping[str, float], laws: Sequence[Law]) -> list[dict[str, float]]:
    """Return for each law those of the parameters that it declares.

    Raises:
        ParameterError: for a parameter that none of the laws declares; the nearest are offered.
    """
    declared = known_arguments(laws)
    for name in values:
        if name not in declared:
            hint = nearest_names(name, declared) if declared else "they have none"
            letters = ", ".join(law.letter for law in laws)
            raise ParameterError(
                "law_parameters", f"names {name!r}, which no law of {letters} has; {hint}"
            )
    return [{name: values[name] for name in law.arguments if name in values} for law in laws]


def _known(name: str) -> Law | None:
    wanted = _spelling(name)
    for law in KNOWN_LAWS.values():
        if wanted in {_spelling(law.letter), _spelling(law.name)}:
            return law
    return None


def _spelling(name: str) -> str:
    return name.strip().lower().replace("_", "-").replace(" ", "-")


def find_law(law: str | Law) -> Law:
    """Return a law by letter or by name; a :class:`Law` is returned as it is.

    Raises:
        ParameterError: if no law has that letter or name; the nearest are offered.

    Example:
        >>> find_law("b").name, find_law("god-object").letter
        ('groove-texture-normal', 'D')
    """
    if isinstance(law, Law):
        return law
    if not isinstance(law, str):
        raise ParameterError("law", "must be a letter, a name or a Law", law)
    known = _known(law)
    if known is not None:
        return known
    names = [name for one in KNOWN_LAWS.values() for name in (one.letter, one.name)]
    raise ParameterError("law", f"is unknown: {law!r}; {nearest_names(law, names)}")


def find_laws(laws: str | list[str | Law] | tuple[str | Law, ...]) -> tuple[Law, ...]:
    """Return several laws: letters in one string ("WABC"), a name, or a sequence of both.

    A string with commas is split there; otherwise each of its letters is a law, unless the whole
    string is the name of one.

    Raises:
        ParameterError: for an unknown law, a law named twice, or none at all.

    Example:
        >>> [law.letter for law in find_laws("WBD")]
        ['W', 'B', 'D']
    """
    if isinstance(laws, str):
        parts: list[str | Law] = [part.strip() for part in laws.split(",") if part.strip()]
        if len(parts) == 1 and "-" not in laws and _known(laws) is None:
            parts = list(laws.strip())
    else:
        parts = list(laws)
    found = tuple(find_law(part) for part in parts)
    if not found:
        raise ParameterError("laws", "must name at least one law", laws)
    letters = [law.letter for law in found]
    twice = {letter for letter in letters if letters.count(letter) > 1}
    if twice:
        raise ParameterError("laws", f"names law {sorted(twice)[0]} twice", laws)
    return found
