"""What the tests of the lab share."""

from __future__ import annotations

from collections.abc import Iterator

import pytest
from tests.lab.started import Started


@pytest.fixture(scope="module")
def lab() -> Iterator[Started]:
    """A lab that runs in a process of its own, as a user starts it."""
    started = Started()
    yield started
    started.close()
