"""What a law is: a contact and a formula."""

from __future__ import annotations

from collections.abc import Callable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import TYPE_CHECKING, Any, Literal, get_args

from asperity.errors import LawError

if TYPE_CHECKING:
    from asperity.laws.symbols import ContactSymbols

ContactName = Literal["nominal", "vertical", "nearest", "split"]
ForceFormula = Callable[["ContactSymbols"], Any]


@dataclass(frozen=True, eq=False)
class Law:
    """A texture law: the force on the probe, as mathematics.

    ``force`` receives a :class:`~asperity.laws.symbols.ContactSymbols` and returns the three
    components of the force on the probe [N] while the probe is in contact, as a SymPy
    expression. Everything else (Jacobian, curl, kernel) is derived from it.

    Args:
        letter: one letter, or a short word for a law of your own.
        name: the name in words, joined with hyphens.
        contact: the point where the surface is felt: ``"nominal"`` (the smooth wall below the
            probe), ``"vertical"`` (the textured surface above or below the probe),
            ``"nearest"`` (the god-object) or ``"split"`` (the split god-object).
        force: the formula.
        summary: one line for tables.
        clampable: whether a depth clamp changes this law (W, D, E and H are never clamped); on
            the nominal and the vertical contact only.
        stateful: whether the force depends on the tangential deflection of a dragged anchor; on
            the nominal contact only, where the anchor is held while z < 0.
        parameters: names of the further parameters of the formula, with their defaults [SI].

    Example:
        >>> from asperity.laws import Law
        >>> Law("V", "linear-wall", "nominal", lambda c: c.k * c.depth * c.e_z).letter
        'V'
    """

    letter: str
    name: str
    contact: ContactName
    force: ForceFormula
    summary: str = ""
    clampable: bool = False
    stateful: bool = False
    parameters: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.letter.isidentifier():
            raise LawError(f"law letter must be a letter or a word, got {self.letter!r}")
        if self.contact not in get_args(ContactName):
            choice = ", ".join(get_args(ContactName))
            raise LawError(
                f"law {self.letter}: contact must be one of {choice}, got {self.contact!r}"
            )
        if self.clampable and self.contact in {"nearest", "split"}:
            raise LawError(f"law {self.letter}: a law on the {self.contact} contact is not clamped")
        if self.stateful and self.contact != "nominal":
            raise LawError(f"law {self.letter}: a law with state must be on the nominal contact")
        if not callable(self.force):
            raise LawError(f"law {self.letter}: force must be a function of the contact symbols")
        object.__setattr__(self, "parameters", MappingProxyType(dict(self.parameters)))

    def __str__(self) -> str:
        return f"{self.letter} ({self.name})"
