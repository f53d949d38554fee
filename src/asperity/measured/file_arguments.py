"""Arguments for reading and preparing a measured surface, in the order in which they apply.

All lengths are in the surface's own metres, before magnification. The arguments are declared in
``file_arguments.toml``.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path

from asperity.core.arguments import read_arguments

_TABLES = Path(__file__).with_suffix(".toml")

READING_ARGUMENTS = tuple(read_arguments(_TABLES, "reading").values())
"""Arguments of reading."""

MAGNIFICATION_ARGUMENTS = tuple(read_arguments(_TABLES, "magnification").values())
"""Arguments for a surface that is already prepared."""

PREPARATION_ARGUMENTS = (*read_arguments(_TABLES, "preparation").values(), *MAGNIFICATION_ARGUMENTS)
"""Arguments of the preparation."""

FILE_ARGUMENTS = (*READING_ARGUMENTS, *PREPARATION_ARGUMENTS)
"""All arguments of a measured file."""

_SYNTHETIC_NAMES = {"height_range", "s_cutoff", "l_cutoff"}
_SYNTHETIC_NAMES |= {argument.name for argument in MAGNIFICATION_ARGUMENTS}
SYNTHETIC_ARGUMENTS = tuple(
    replace(argument, default_description="none") if argument.name == "s_cutoff" else argument
    for argument in PREPARATION_ARGUMENTS
    if argument.name in _SYNTHETIC_NAMES
)
"""Arguments for any texture: a synthetic one has no missing points, no spikes and no form."""
