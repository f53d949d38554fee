"""Shared libraries of vendors and users, found when a device is opened."""

from __future__ import annotations

import ctypes
import os
from collections.abc import Sequence

from asperity.errors import ParameterError

_FOREIGN = ("wrong elf class", "invalid elf header", "incompatible architecture", "exec format")


def load_library(names: Sequence[str], variable: str, install: str) -> ctypes.CDLL:
    """Return a shared library.

    Args:
        names: under which the system may know it.
        variable: of the environment, which may hold its path; it comes before the names.
        install: where it is from, for whoever lacks it.

    Raises:
        ParameterError: if there is none, with what to install, or if it is for another machine.
    """
    path = os.environ.get(variable)
    reasons = []
    for name in [path] if path else names:
        try:
            return ctypes.CDLL(name)
        except OSError as error:
            reasons.append(str(error))
    foreign = [reason for reason in reasons if any(sign in reason.lower() for sign in _FOREIGN)]
    if foreign:
        words = f"finds a library for another kind of machine: {foreign[0]}"
        raise ParameterError("driver", words)
    tried = path or ", ".join(names)
    words = f"needs {tried}, which is not found: install {install}, or name the file in {variable}"
    raise ParameterError("driver", words)


def functions(library: ctypes.CDLL, *names: str) -> list[int]:
    """Return the addresses of functions.

    Raises:
        ParameterError: if the library lacks one, which is named.
    """
    found = []
    for name in names:
        if not hasattr(library, name):
            raise ParameterError("driver", f"{library._name} has no function {name}")
        pointer = ctypes.cast(getattr(library, name), ctypes.c_void_p)
        found.append(int(pointer.value or 0))
    return found
