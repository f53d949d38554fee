"""Shared libraries that stand in for those of vendors, compiled from C."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

FLAGS = ("-O2", "-Wall", "-Wextra", "-Werror", "-std=c99", "-shared", "-fPIC", "-pthread")


def compile_library(source: Path, folder: Path) -> Path:
    """Compile a file of C to a shared library in a folder; return its path."""
    library = folder / f"{source.stem}.so"
    compiler = shutil.which("gcc") or shutil.which("cc")
    assert compiler is not None, "this needs a C compiler"
    subprocess.run([compiler, *FLAGS, "-o", str(library), str(source)], check=True)
    return library
