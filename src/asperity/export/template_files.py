"""Templates of exported files."""

from __future__ import annotations

import re
from collections.abc import Mapping
from functools import lru_cache
from importlib import resources


@lru_cache(maxsize=16)
def load_template(name: str) -> str:
    """Return a file of the folder ``templates``."""
    return resources.files("asperity.export").joinpath("templates", name).read_text("utf-8")


def fill_template(text: str, values: Mapping[str, str]) -> str:
    """Return a template with its placeholders, such as ``@name@``, replaced.

    Example:
        >>> fill_template("void @name@_reset(void);", {"name": "texture"})
        'void texture_reset(void);'
    """
    return re.sub(r"@(\w+)@", lambda found: values[found[1]], text)
