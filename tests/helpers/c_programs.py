"""Compilers and other tools for the tests of the export; most are shared with the benchmark."""

from __future__ import annotations

import ctypes
import shutil
from collections.abc import Iterable, Mapping, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bench.speed import c_programs
from bench.speed.c_programs import (
    STRICT,
    as_exported,
    compile_library,
    header,
    probes,
    run_command,
    surface_ticks,
    ticks,
)

from asperity.surface import Surface

__all__ = [
    "COMPILERS",
    "STRICT",
    "as_exported",
    "compile_library",
    "energies",
    "header",
    "kernel_ticks",
    "library",
    "list_differing",
    "probes",
    "run_command",
    "same_bits",
    "ticks",
    "tool",
]

COMPILERS = ("gcc", "clang")


def tool(name: str) -> str:
    """Return the path of a program; skip the test if it is not installed."""
    path = shutil.which(name)
    if path is None:
        pytest.skip(f"not run: no {name} here")
    return path


def library(
    folder: Path, compiler: str, headers: Mapping[str, str], *flags: str, single: bool = False
) -> ctypes.CDLL:
    """Return exported headers compiled into one library; see ``bench.speed.c_programs``."""
    return c_programs.library(folder, tool(compiler), headers, *flags, single=single)


def energies(program: ctypes.CDLL, name: str, points: Any) -> Any:
    """Return the potential energies at probe positions."""
    out = np.empty(len(points), points.dtype)
    given = [array.ctypes.data_as(ctypes.c_void_p) for array in (points, out)]
    getattr(program, f"{name}_energies")(*given, ctypes.c_int64(len(points)))
    return out


def kernel_ticks(surface: Surface, points: Any, max_evaluations: float | None = None) -> Any:
    """Return the same of the kernel."""
    return surface_ticks(surface, points, max_evaluations).result()


def same_bits(first: Any, second: Any) -> Any:
    """Return which rows are the same bit by bit."""
    return (first.view(np.int64) == second.view(np.int64)).all(axis=1)


def list_differing(names: Iterable[str], equal: Sequence[Any]) -> str:
    """Return how many points differ, by name, of those of which any do."""
    counts = {name: int((~one).sum()) for name, one in zip(names, equal, strict=True)}
    return ", ".join(f"{name}: {count}" for name, count in counts.items() if count)
