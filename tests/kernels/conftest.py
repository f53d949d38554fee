"""Fixtures for tests of compiled code."""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import pytest
from tests.helpers.fused_code import forget_fused_modules


@pytest.fixture
def empty_code_cache(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Use an empty cache: cached code cannot be inspected."""
    monkeypatch.setenv("ASPERITY_CACHE_DIR", str(tmp_path))
    forget_fused_modules()
    yield
    forget_fused_modules()
