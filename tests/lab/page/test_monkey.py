"""Whatever is done to the page, nothing breaks; ``bench.stress.lab_monkey`` does more of it."""

from __future__ import annotations

from tests.lab.browser import Browser, needs_browser
from tests.lab.page.monkey import Monkey

ACTIONS = 60


@needs_browser
def test_whatever_is_done_nothing_breaks(page: Browser) -> None:
    monkey = Monkey(page)
    for _ in range(ACTIONS):
        monkey.act()
    errors, beyond, most, _frames = monkey.end()
    assert (errors, beyond) == (0, 0), page.said
    assert most > 0.0
