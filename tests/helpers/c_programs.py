"""Compilers and other tools for the tests of the export; most are shared with the benchmark."""

from __future__ import annotations

import ctypes
import shutil
from collections.abc import Mapping
from pathlib import Path

import pytest
from bench.speed import c_programs
from bench.speed.c_programs import (
    STRICT,
    as_exported,
    compile_library,
    energies,
    header,
    kernel_ticks,
    list_differing,
    probes,
    run_command,
    same_bits,
    ticks,
)

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
