"""What is to be exported, checked before any work is done."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from asperity.checks import positive
from asperity.errors import ParameterError
from asperity.export.statements import is_taken
from asperity.surface import Surface

PRECISIONS = ("double", "float")
LARGEST = 64 * 2**20
"""Bytes of data that a program may hold unless told otherwise."""


@dataclass(frozen=True)
class Order:
    """What is to be exported.

    Attributes:
        surface: the surface with its law.
        name: prefix of all names.
        precision: of real numbers, ``double`` or ``float``.
        shared: whether it is to be a library of its own.
        note: what stands on top, plain text.
        q_upper: upper bound of the characteristic number.
        largest: bytes of data that the program may hold.
        looks: evaluations of the surface that the search of a tick may take, infinite for the exact
            answer at any price; default: as many as the law's contact says.

    Raises:
        ParameterError: for a name that C does not take, an unknown precision, or looks that are not
            positive.
    """

    surface: Surface
    name: str = "texture"
    precision: str = "double"
    shared: bool = False
    note: str = ""
    q_upper: float = math.inf
    largest: int = LARGEST
    looks: float | None = None

    def __post_init__(self) -> None:
        self.check(self.name, self.precision, self.looks)

    @staticmethod
    def check(name: str, precision: str, looks: float | None) -> None:
        """Refuse what cannot be ordered, before a surface is looked at.

        Raises:
            ParameterError: see the class.
        """
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or "__" in name:
            words = "must be a C identifier: letters, digits and single _, a letter first"
            raise ParameterError("name", words, name)
        if is_taken(name):
            raise ParameterError("name", "must not be a word of C or C++", name)
        if precision not in PRECISIONS:
            words = f"must be one of {', '.join(PRECISIONS)}"
            raise ParameterError("precision", words, precision)
        if looks is not None and looks != math.inf:
            positive("looks", looks)

    @property
    def budget(self) -> float:
        """Evaluations of the surface that the search of a tick may take; 1 without a search."""
        contact = self.surface.law.contact
        return self.looks if self.looks is not None and contact.remembers else contact.looks

    @property
    def single(self) -> bool:
        """Whether real numbers are of single precision."""
        return self.precision == "float"
