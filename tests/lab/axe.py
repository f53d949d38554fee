"""The script of axe-core, with which tests look for barriers in pages."""

from __future__ import annotations

import importlib.util
import os
from pathlib import Path

import pytest

PACKAGES = ("axe_core_python", "axe_playwright_python")


def find_axe() -> Path | None:
    """Return the script that AXE names, or that of a Python package; ``None`` without one."""
    candidates = [Path(named)] if (named := os.environ.get("AXE")) else []
    for package in PACKAGES:
        spec = importlib.util.find_spec(package)
        for folder in (spec.submodule_search_locations or ()) if spec else ():
            candidates += Path(folder).rglob("axe.min.js")
    return next((one for one in candidates if one.is_file()), None)


AXE = find_axe()
needs_axe = pytest.mark.skipif(
    AXE is None, reason="not run: no axe.min.js (AXE=its path, or pip install axe-core-python)"
)
