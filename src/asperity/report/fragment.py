"""What a notebook shows of a result: a sentence, tables, a picture; HTML without script."""

from __future__ import annotations

import base64
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from asperity.report.page import Table, environment, own_look

if TYPE_CHECKING:
    from matplotlib.figure import Figure


@dataclass(frozen=True)
class Fragment:
    """What a notebook shows of a result.

    Attributes:
        answer: one or two sentences.
        tables: below it.
        draw: returns the picture below them; ``None`` for none.
        alt: what the picture shows, for who does not see it.
    """

    answer: str
    tables: Sequence[Table] = ()
    draw: Callable[[], Figure] | None = None
    alt: str = ""


def fragment_html(fragment: Fragment) -> str:
    """Return the fragment as HTML; all words of it are escaped."""
    picture = "" if fragment.draw is None else _png(fragment.draw)
    template = environment().get_template("notebook.html.j2")
    return template.render(fragment=fragment, picture=picture)


def _png(draw: Callable[[], Figure]) -> str:
    """Return a picture as PNG in base64: a white card, whatever the notebook's colours."""
    from asperity.report.pictures.style import png

    with own_look():
        return base64.b64encode(png(draw())).decode("ascii")
