"""The laws: the mathematics of each texture algorithm, symbols in, symbols out."""

from __future__ import annotations

from asperity.arguments import Argument
from asperity.errors import ParameterError, nearest_names
from asperity.laws import (
    a_groove_wall_normal,
    b_groove_texture_normal,
    c_change_of_height,
    d_god_object,
    e_god_object_wall_normal,
    f_friction_modulation,
    g_force_shading,
    h_split_god_object,
    w_smooth_wall,
)
from asperity.laws.law import Law

__all__ = ["LAWS", "LAW_ARGUMENTS", "Law", "find_law", "find_laws"]

# In the order of the paper's tables, the smooth wall first.
LAWS: dict[str, Law] = {
    module.LAW.letter: module.LAW
    for module in (
        w_smooth_wall,
        a_groove_wall_normal,
        b_groove_texture_normal,
        c_change_of_height,
        d_god_object,
        e_god_object_wall_normal,
        f_friction_modulation,
        g_force_shading,
        h_split_god_object,
    )
}

LAW_ARGUMENTS: dict[str, Argument] = {
    name: argument for law in LAWS.values() for name, argument in law.arguments.items()
}
"""The parameters of the shipped laws, by name."""


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
    wanted = law.strip().lower().replace("_", "-").replace(" ", "-")
    for known in LAWS.values():
        if wanted in (known.letter.lower(), known.name):
            return known
    names = [name for known in LAWS.values() for name in (known.letter, known.name)]
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
        if len(parts) == 1 and "-" not in laws:
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
