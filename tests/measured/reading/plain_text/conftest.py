"""Readers of instruments for texts, without a process of their own."""

from __future__ import annotations

import pytest

from asperity.measured.reading import readers as registry


@pytest.fixture(autouse=True)
def read_in_this_process(monkeypatch: pytest.MonkeyPatch) -> None:
    """Run instrument readers in this process, since hundreds of texts are tried."""
    monkeypatch.setattr(registry, "read_isolated", lambda read, file, options: read(file, options))
