"""Request of an export."""

from __future__ import annotations

import math
import re
from dataclasses import dataclass

from asperity.contacts.contact import Contact
from asperity.core.checks import check_positive
from asperity.core.errors import ParameterError
from asperity.export.statements import RESERVED_WORDS
from asperity.rendering import is_searched
from asperity.surface import Surface

PRECISIONS = ("double", "float")
MAX_DATA_SIZE = 64 * 2**20
"""Default limit of the data of a program [bytes]."""


def is_searching(contact: Contact) -> bool:
    """Return whether exported laws on a contact search: not where a field or a formula is used."""
    return contact.has_warm_start and not contact.has_potential_field


@dataclass(frozen=True)
class ExportRequest:
    """A surface to export, and the options of the program.

    Attributes:
        surface: the surface with its law.
        name: prefix of all names.
        precision: precision of real numbers, ``double`` or ``float``.
        as_library: whether to write a library.
        comment: comment at the top of the file, plain text.
        q_upper: upper bound of the characteristic number.
        max_data_size: limit of the data of the program [bytes].
        loads_field: whether the program loads the baked field from its file; else the source holds
            all data.
        max_evaluations: limit of evaluations of the surface per tick; infinite for an exact search;
            default: that of the contact of the law.

    Raises:
        ParameterError: for a name that is not a C identifier, an unknown precision, a number of
            evaluations that is not positive, a surface with law H that is neither baked nor has a
            closed form, or ``loads_field`` without a baked field.
    """

    surface: Surface
    name: str = "texture"
    precision: str = "double"
    as_library: bool = False
    comment: str = ""
    q_upper: float = math.inf
    max_data_size: int = MAX_DATA_SIZE
    loads_field: bool = False
    max_evaluations: float | None = None

    def __post_init__(self) -> None:
        self.validate(**vars(self))
        if is_searched(self.surface):
            words = "must be baked to export law H: asperity bake, with --extent without a period"
            raise ParameterError("surface", words)
        if self.loads_field and not self.surface.texture.baked_numbers:
            raise ParameterError("load", "needs a baked field: law H without a closed form")

    @staticmethod
    def validate(
        name: str = "texture",
        precision: str = "double",
        max_evaluations: float | None = None,
        **_others: object,
    ) -> None:
        """Check the options without a surface; others are ignored.

        Raises:
            ParameterError: see the class.
        """
        if not re.fullmatch(r"[A-Za-z][A-Za-z0-9_]*", name) or "__" in name:
            words = "must be a C identifier: letters, digits and single _, a letter first"
            raise ParameterError("name", words, name)
        if name in RESERVED_WORDS:
            raise ParameterError("name", "must not be a reserved word of C or C++", name)
        if precision not in PRECISIONS:
            words = f"must be one of {', '.join(PRECISIONS)}"
            raise ParameterError("precision", words, precision)
        if max_evaluations is not None and max_evaluations != math.inf:
            check_positive("max_evaluations", max_evaluations)

    @property
    def evaluation_budget(self) -> float:
        """Limit of evaluations of the surface per tick; 1 for a law without a search."""
        contact = self.surface.law.contact
        if not is_searching(contact):
            return 1.0
        return self.max_evaluations or contact.max_evaluations

    @property
    def is_single_precision(self) -> bool:
        """Whether real numbers are of single precision."""
        return self.precision == "float"
