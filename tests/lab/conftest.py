"""What the tests of the lab share: a lab and a browser, for they take long to start."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from pathlib import Path
from typing import Any

import pytest
from tests.lab.browser import Browser
from tests.lab.started import LAB, Started

from asperity.cli.plugins import load_plugin_files
from asperity.laws import REGISTERED_LAWS

OWN_LAW = str(Path(__file__).parents[2] / "examples" / "own_law.py")


def start_lab(command: Sequence[str]) -> Iterator[Started]:
    """Yield a lab that runs in a process of its own, as a user starts it, and end it.

    The device has 1000 samples a second: with the 4000 of the default, two labs and two browsers
    are too much for two cores, and samples are late.
    """
    started = Started("--device", "touch-x", "--law", "C", "--stiffness", "250N/m", command=command)
    yield started
    assert started.end() == (0, "")


@pytest.fixture(scope="module")
def lab() -> Iterator[Started]:
    """A lab for each module, of which tests may end the processes."""
    yield from start_lab(LAB)


@pytest.fixture(scope="package")
def browser(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Browser]:
    with Browser("about:blank", tmp_path_factory.mktemp("browser")) as one:
        yield one


@pytest.fixture(scope="module")
def page(lab: Started, browser: Browser) -> Iterator[Browser]:
    """The page in a browser, which steers; it is left when the module is done."""
    browser.said.clear()
    browser.resize(1280, 900)
    browser.call("Page.navigate", url=lab.address)
    browser.until("globalThis.lab?.frame && lab.hasPictures")
    yield browser
    browser.call("Page.navigate", url="about:blank")


@pytest.fixture
def own_law(monkeypatch: pytest.MonkeyPatch) -> Iterator[dict[str, Any]]:
    """A law of the user's own, known as --plugin makes it known."""
    known = dict(REGISTERED_LAWS)
    monkeypatch.setattr("asperity.cli.plugins._LOADED_FILES", [])
    load_plugin_files((OWN_LAW,))
    yield {letter: law for letter, law in REGISTERED_LAWS.items() if letter not in known}
    REGISTERED_LAWS.clear()
    REGISTERED_LAWS.update(known)
