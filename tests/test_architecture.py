"""Layers of the package, public names, and the example of a user-defined law."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import asperity

ROOT = Path(__file__).parents[1]


def test_imports_respect_the_layers() -> None:
    process = subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--no-cache"],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
    )
    assert process.returncode == 0, process.stdout


def test_every_public_name_exists() -> None:
    for name in asperity.__all__:
        assert getattr(asperity, name) is not None


def test_example_of_a_user_defined_law_runs() -> None:
    process = subprocess.run(
        [sys.executable, ROOT / "examples" / "own_law.py"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert process.returncode == 0, process.stderr
    assert "the curl is zero identically" in process.stdout
    assert "S: q = " in process.stdout
