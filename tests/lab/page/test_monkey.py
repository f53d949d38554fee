"""Whatever is done to the page, nothing breaks."""

from __future__ import annotations

from tests.lab.browser import Browser, needs_browser
from tests.lab.page.monkey import Monkey
from tests.lab.started import Started

ACTIONS = 60


@needs_browser
def test_whatever_is_done_nothing_breaks(browser: Browser) -> None:
    lab = Started()
    browser.said.clear()
    browser.resize(1280, 900)
    browser.call("Page.navigate", url=lab.address)
    browser.until("globalThis.lab?.frame && lab.hasPictures")
    monkey = Monkey(browser)
    for _ in range(ACTIONS):
        monkey.act()
    errors, beyond, most = monkey.end()
    assert (errors, beyond) == (0, 0), browser.said
    assert most > 0.0
    browser.call("Page.navigate", url="about:blank")
    assert lab.end() == (0, "")
