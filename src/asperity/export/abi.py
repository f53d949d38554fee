"""The ABI of exported programs: what a caller and a library must agree on.

Within one number, functions keep their names, arguments and meaning, a state its size, and the
facts that :c:`NAME_info` fills grow only at their end.
"""

from __future__ import annotations

import math
from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from asperity.export.surface_functions import ExportRequest
    from asperity.surface import Surface

ABI_VERSION = 1
"""Number of the ABI: raised with every change that an earlier caller would not survive."""

_LAW_BYTES = 63
_NUMBERS = ("friction", "presliding_stiffness", "friction_modulation", "max_deflection")


def abi_values(request: ExportRequest) -> dict[str, str]:
    """Return the values of the placeholders of the templates about the ABI."""
    surface = request.surface
    numbers = _friction_numbers(surface)
    mark = int(surface.digest[:7], 16) | 1
    return {
        "abi": str(ABI_VERSION),
        "linked": linked_name(request),
        "q_plus": bound_literal(request.one_sided_upper),
        "max_force": bound_literal(request.max_force),
        "max_press": bound_literal(request.max_press),
        "holds_deeper": str(int(request.holds_deeper)),
        "law": c_string(str(surface.law), _LAW_BYTES),
        "mark": str(mark),
        "held": str(mark + 1),
        **{name: repr(float(numbers.get(name, 0.0))) for name in _NUMBERS},
    }


def _friction_numbers(surface: Surface) -> dict[str, float]:
    """Return the parameters of friction, of the law or of the surface, by name."""
    numbers = {**surface.law_parameters, **surface.friction_values}
    if surface.contact_friction is not None:
        numbers["presliding_stiffness"] = surface.contact_friction.presliding_stiffness
    return numbers


def linked_name(request: ExportRequest) -> str:
    """Return the name of the symbol of a library to which programs of its ABI are linked."""
    suffix = "_float" if request.is_single_precision else ""
    return f"{request.name}_abi_{ABI_VERSION}{suffix}"


def bound_literal(value: float) -> str:
    """Return a number as a C constant."""
    return repr(value) if math.isfinite(value) else "HUGE_VAL"


def c_string(text: str, size: int) -> str:
    r"""Return a text as a C string literal of at most so many bytes of UTF-8.

    Example:
        >>> print(c_string('C "κ"', 20))
        "C \042\316\272\042"
    """
    whole = text.encode()[:size].decode(errors="ignore").encode()
    characters = [_c_character(byte) for byte in whole]
    return f'"{"".join(characters)}"'


def _c_character(byte: int) -> str:
    if 32 <= byte < 127 and chr(byte) not in '"\\?':
        return chr(byte)
    return f"\\{byte:03o}"
