"""One lab for all tests of its page, which each module finds as it was at the start."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any

import pytest
from tests.lab.browser import Browser
from tests.lab.conftest import start_lab
from tests.lab.started import FAST_LAB, Started


@pytest.fixture(scope="package")
def lab() -> Iterator[Started]:
    yield from start_lab(FAST_LAB)


@pytest.fixture(scope="package")
def initial_settings() -> dict[str, Any]:
    """Settings of the lab when its page is opened first; filled by ``page``."""
    return {}


@pytest.fixture(scope="module")
def page(lab: Started, browser: Browser, initial_settings: dict[str, Any]) -> Iterator[Browser]:
    """The page in a browser, which controls the loop, with the initial settings."""
    browser.said.clear()
    browser.resize(1280, 900)
    browser.call("Page.navigate", url=lab.address)
    browser.until("globalThis.lab?.frame && lab.hasPictures")
    browser.until("lab.status?.has_control || !document.getElementById('take-control').hidden")
    browser.ask("lab.status.has_control || document.getElementById('take-control').click()")
    browser.until("lab.status.has_control && lab.status.state === 'running'")
    if not initial_settings:
        initial_settings.update(browser.ask("lab.status.settings"))
    changes = json.dumps(initial_settings)
    browser.ask(f"lab.connection.send('change', {{ changes: {changes} }})")
    browser.until(
        f"JSON.stringify(lab.status.settings) === JSON.stringify({changes})"
        "&& lab.status.state === 'running' && lab.hasCurrentPictures"
    )
    yield browser
    browser.call("Page.navigate", url="about:blank")
