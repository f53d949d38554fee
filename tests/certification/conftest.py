"""The library of faulty renderers, compiled once."""

from __future__ import annotations

import shutil
import subprocess
from pathlib import Path

import pytest

SOURCE = Path(__file__).with_name("renderers.c")


@pytest.fixture(scope="session")
def library(tmp_path_factory: pytest.TempPathFactory) -> str:
    compiler = shutil.which("cc") or shutil.which("gcc")
    if compiler is None:
        pytest.skip("not run: no C compiler here")
    path = tmp_path_factory.mktemp("library") / "renderers.so"
    command = [compiler, "-O1", "-shared", "-fPIC", "-o", path, SOURCE, "-lm"]
    subprocess.run(command, check=True)
    return str(path)
