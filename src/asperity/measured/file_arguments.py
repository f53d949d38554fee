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

_BY_NAME = {argument.name: argument for argument in PREPARATION_ARGUMENTS}
SYNTHETIC_ARGUMENTS = (
    _BY_NAME["height_range"],
    replace(_BY_NAME["s_cutoff"], default_description="none"),
    _BY_NAME["l_cutoff"],
    _BY_NAME["tip_radius"],
    *MAGNIFICATION_ARGUMENTS,
)
"""Arguments for any texture: a synthetic one has no missing points, no spikes and no form."""
