"""What a law is: a contact and a formula."""

from __future__ import annotations

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any

from asperity.arguments import Argument
from asperity.contacts import CONTACTS, Contact
from asperity.errors import LawError, ParameterError, nearest_names

__all__ = ["ContactSymbols", "ForceFormula", "Law"]

if TYPE_CHECKING:
    from asperity.contacts.symbols import ContactSymbols
else:
    ContactSymbols = Any  # SymPy is loaded only where something is derived

ForceFormula = Callable[[ContactSymbols], Any]


@dataclass(frozen=True, eq=False, init=False)
class Law:
    """A texture law: the force on the probe, as mathematics.

    ``force`` receives a :class:`~asperity.contacts.symbols.ContactSymbols` and returns the three
    components of the force on the probe [N] while the probe is in contact, as a SymPy
    expression. Everything else (Jacobian, curl, kernel) is derived from it.

    Args:
        letter: one letter, or a short word for a law of your own.
        name: the name in words, joined with hyphens.
        contact: the point where the surface is felt: ``"nominal"`` (the smooth wall below the
            probe), ``"vertical"`` (the textured surface above or below the probe),
            ``"nearest"`` (the god-object) or ``"split"`` (the split god-object); or a
            :class:`~asperity.contacts.Contact` of your own.
        force: the formula.
        summary: one line for tables.
        clampable: whether a depth clamp changes this law (W, D, E and H are never clamped); on
            a contact that can be clamped (nominal, vertical).
        stateful: whether the force depends on the tangential deflection of a dragged anchor; on
            a contact that holds one (nominal: the anchor is held while z < 0).
        parameters: names of the further parameters of the formula, with their defaults [SI], or
            with an :class:`~asperity.arguments.Argument` that has unit, bounds and words too.

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
        declared = {
            key: value if isinstance(value, Argument) else _plain_argument(letter, key, value)
            for key, value in (parameters or {}).items()
        }
        values: dict[str, Any] = {
            "letter": letter,
            "name": name,
            "contact": _find_contact(letter, contact),
            "force": force,
            "summary": summary,
            "clampable": clampable,
            "stateful": stateful,
            "parameters": MappingProxyType({key: _default(a) for key, a in declared.items()}),
            "arguments": MappingProxyType(declared),
        }
        for key, value in values.items():
            object.__setattr__(self, key, value)
        self._check()

    def _check(self) -> None:
        if not self.letter.isidentifier():
            raise LawError(f"law letter must be a letter or a word, got {self.letter!r}")
        if self.clampable and not self.contact.clampable:
            raise LawError(f"law {self.letter}: a law on the {self.contact} contact is not clamped")
        if self.stateful and not self.contact.holds_anchor:
            holding = ", ".join(c.name for c in CONTACTS.values() if c.holds_anchor)
            raise LawError(f"law {self.letter}: a law with state must be on the {holding} contact")
        missing = [name for name in self.contact.parameters if name not in self.arguments]
        if missing:
            raise LawError(
                f"law {self.letter}: a law on the {self.contact} contact must have the parameter "
                f"{missing[0]}"
            )
        if not callable(self.force):
            raise LawError(f"law {self.letter}: force must be a function of the contact symbols")

    def checked(self, values: Mapping[str, float]) -> dict[str, float]:
        """Return values for parameters of this law [SI].

        Raises:
            ParameterError: for a parameter that it does not declare, or a value out of bounds.

        Example:
            >>> from asperity.laws import find_law
            >>> find_law("F").checked({"friction": 0.5})
            {'friction': 0.5}
        """
        for name in values:
            if name not in self.arguments:
                hint = nearest_names(name, self.arguments) if self.arguments else "it has none"
                raise ParameterError("law_parameters", f"names {name!r}; law {self}: {hint}")
        return {name: self.arguments[name].checked(value) for name, value in values.items()}

    def __str__(self) -> str:
        return f"{self.letter} ({self.name})"


def _find_contact(letter: str, contact: str | Contact) -> Contact:
    if isinstance(contact, Contact):
        return contact
    if not isinstance(contact, str) or contact not in CONTACTS:
        hint = nearest_names(str(contact), CONTACTS)
        raise LawError(
            f"law {letter}: contact must be one of {', '.join(CONTACTS)} or a Contact of your "
            f"own, got {contact!r}; {hint}"
        )
    return CONTACTS[contact]


def _plain_argument(letter: str, name: str, default: float) -> Argument:
    words = f"parameter of law {letter}"
    return Argument(name, words, default=float(default), low=-math.inf)


def _default(argument: Argument) -> float:
    if not isinstance(argument.default, (int, float)):
        raise LawError(f"the parameter {argument.name!r} needs a number as its default")
    return float(argument.default)
