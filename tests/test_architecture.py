"""The layers of the package hold, and its public names exist."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import asperity

ROOT = Path(__file__).parents[1]


def test_imports_go_downward_only() -> None:
    done = subprocess.run(
        [Path(sys.executable).with_name("lint-imports"), "--no-cache"],
        capture_output=True,
        text=True,
        check=False,
        cwd=ROOT,
    )
    assert done.returncode == 0, done.stdout


def test_every_public_name_can_be_had() -> None:
    for name in asperity.__all__:
        assert getattr(asperity, name) is not None


def test_the_example_of_a_law_of_one_s_own_runs() -> None:
    done = subprocess.run(
        [sys.executable, ROOT / "examples" / "own_law.py"],
        capture_output=True,
        text=True,
        check=False,
    )
    assert done.returncode == 0, done.stderr
    assert "the curl is zero identically" in done.stdout
    assert "S: q = " in done.stdout
