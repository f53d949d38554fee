"""Texture laws: a contact and a formula."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from asperity.contacts import CONTACTS, Contact
from asperity.core.arguments import Argument
from asperity.core.errors import LawError, ParameterError, suggest_names

__all__ = ["ContactSymbols", "ForceFormula", "Law"]

if TYPE_CHECKING:
    from asperity.contacts.symbols import ContactSymbols
else:
    ContactSymbols = Any  # importing SymPy is left to the modules that derive something

ForceFormula = Callable[[ContactSymbols], Any]


@dataclass(frozen=True, eq=False, init=False)
class Law:
    """A texture law: the force on the probe, as mathematics.

    ``force`` receives a :class:`~asperity.contacts.symbols.ContactSymbols` and returns the three
    components of the force on the probe [N] while the probe is in contact, as a SymPy
    expression. Everything else (Jacobian, curl, kernel) is derived from it.

    Args:
        letter: one letter, or a short word for a user-defined law.
        name: a name of words joined with hyphens.
        contact: the contact point: ``"nominal"`` (the smooth wall below the
            probe), ``"vertical"`` (the textured surface above or below the probe),
            ``"nearest"`` (the god-object) or ``"split"`` (the split god-object); or a
            :class:`~asperity.contacts.Contact`.
        force: the formula.
        summary: one line for tables.
        clampable: whether a depth clamp changes this law (never W, D, E and H); the contact must
            support clamps (nominal, vertical).
        stateful: whether the force depends on the tangential deflection of a dragged anchor; the
            contact must support state (nominal: the anchor is held while z < 0).
        parameters: names of the further parameters of the formula with their default values [SI],
            or with an :class:`~asperity.core.arguments.Argument` that adds unit, bounds and text.

    Example:
        >>> from asperity.laws import Law
        >>> Law("V", "linear-wall", "nominal", lambda c: c.k * c.depth * c.e_z).letter
        'V'
    """

    letter: str
    name: str
    contact: Contact
    force: ForceFormula
    summary: str = ""
    clampable: bool = False
    stateful: bool = False
    parameters: Mapping[str, float] = field(default_factory=dict)
    arguments: Mapping[str, Argument] = field(init=False, repr=False)

    def __repr__(self) -> str:
        return f"<Law {self.letter}, {self.name}, on the {self.contact} contact>"

    def __init__(
        self,
        letter: str,
        name: str,
        contact: str | Contact,
        force: ForceFormula,
        summary: str = "",
        clampable: bool = False,
        stateful: bool = False,
        parameters: Mapping[str, float | Argument] | None = None,
    ) -> None:
        declared = {key: _as_argument(letter, key, v) for key, v in (parameters or {}).items()}
        defaults = {key: _default_value(argument) for key, argument in declared.items()}
        self.__dict__.update(
            letter=letter,
            name=name,
            contact=_find_contact(letter, contact),
            force=force,
            summary=summary,
            clampable=clampable,
            stateful=stateful,
            parameters=MappingProxyType(defaults),
            arguments=MappingProxyType(declared),
        )
        self._validate()

    def _validate(self) -> None:
        if not self.letter.isidentifier():
            raise LawError(f"law letter must be a letter or a word, got {self.letter!r}")
        if self.clampable and not self.contact.clampable:
            raise LawError(f"law {self.letter}: a law on the {self.contact} contact is not clamped")
        if self.stateful and not self.contact.supports_state:
            names = ", ".join([c.name for c in CONTACTS.values() if c.supports_state])
            raise LawError(f"law {self.letter}: a law with state must be on the {names} contact")
        missing = [name for name in self.contact.parameters if name not in self.arguments]
        if missing:
            reason = f"a law on the {self.contact} contact must have the parameter {missing[0]}"
            raise LawError(f"law {self.letter}: {reason}")
        if not callable(self.force):
            raise LawError(f"law {self.letter}: force must be a function of the contact symbols")

    def check_parameters(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return validated values of parameters of this law [SI].

        Raises:
            ParameterError: for a parameter that it does not declare, or a value out of bounds.

        Example:
            >>> from asperity.laws import find_law
            >>> find_law("F").check_parameters({"friction": 0.5})
            {'friction': 0.5}
        """
        for name in values:
            if name not in self.arguments:
                hint = "it has none"
                if self.arguments:
                    hint = suggest_names(name, self.arguments)
                raise ParameterError("law_parameters", f"names {name!r}; law {self}: {hint}")
        return {name: self.arguments[name].validate(value) for name, value in values.items()}

    def __str__(self) -> str:
        return f"{self.letter} ({self.name})"


def _find_contact(letter: str, contact: str | Contact) -> Contact:
    if isinstance(contact, Contact):
        return contact
    if not isinstance(contact, str) or contact not in CONTACTS:
        hint = suggest_names(str(contact), CONTACTS)
        reason = f"contact must be one of {', '.join(CONTACTS)} or a Contact, got {contact!r}"
        raise LawError(f"law {letter}: {reason}; {hint}")
    return CONTACTS[contact]


def _as_argument(letter: str, name: str, value: float | Argument) -> Argument:
    if isinstance(value, Argument):
        return value
    return Argument(name, f"parameter of law {letter}", default=float(value), minimum=-math.inf)


def _default_value(argument: Argument) -> float:
    if not isinstance(argument.default, (int, float)):
        raise LawError(f"the parameter {argument.name!r} needs a number as its default")
    return float(argument.default)
