"""HTML: a page as one file that needs no network, and a result in a notebook cell."""

from __future__ import annotations

import base64
import hashlib
import os
import re
import time
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache, partial
from importlib import resources
from importlib.metadata import version
from operator import itemgetter
from typing import TYPE_CHECKING

from asperity.core.cache import get_or_compute
from asperity.core.files import content_digest
from asperity.core.processes import precompute
from asperity.core.version import __version__
from asperity.report.document import page as pages

if TYPE_CHECKING:
    import jinja2


@dataclass(frozen=True)
class RenderedPicture:
    """A figure as it is embedded in a page.

    Attributes:
        svg: text of :func:`asperity.report.pictures.style.svg_text`, embedded unescaped: it never
            contains text from elsewhere.
        alt_text: the description of the figure with its ranges.
        panel_json: the plotted numbers as JSON, for the script of the page.
    """

    svg: str
    alt_text: str
    panel_json: str


def render_picture(picture: pages.Picture) -> RenderedPicture:
    """Return a picture as SVG with its numbers, drawn with Matplotlib's defaults."""
    from asperity.report.pictures.panel_data import extract_panels, panels_to_json, ranges_text
    from asperity.report.pictures.style import svg_text

    with pages.default_style():
        figure = picture.draw()
        svg = svg_text(figure, picture.dpi)  # drawing the figure places its panels
        panels = extract_panels(figure)
    return RenderedPicture(svg, picture.describe() + ranges_text(panels), panels_to_json(panels))


def _render_pictures(sections: Sequence[pages.Section]) -> dict[int, RenderedPicture]:
    """Return the rendered pictures of sections by ``id`` of the picture.

    Those with a digest are shared out among helper processes, and cached.
    """
    digests = [
        (picture, picture.find_digest and picture.find_digest())
        for picture in _pictures_in(sections)
    ]
    shared = [picture for picture, digest in digests if digest is not None]
    rendered = {id(one): render_picture(one) for one, digest in digests if digest is None}
    with precompute(render_picture, shared) as results:
        for (picture, digest), result in zip(filter(itemgetter(1), digests), results, strict=True):
            compute = partial(_result_or_render, result, picture)
            key = content_digest(digest, version("matplotlib"))
            rendered[id(picture)] = get_or_compute(f"picture {picture.name}", key, compute)
    return rendered


def _result_or_render(result: RenderedPicture | None, picture: pages.Picture) -> RenderedPicture:
    return result or render_picture(picture)


def _pictures_in(sections: Sequence[pages.Section]) -> Iterator[pages.Picture]:
    for section in sections:
        for block in section.blocks:
            if isinstance(block, pages.Picture):
                yield block
            elif isinstance(block, pages.Cards):
                yield from _pictures_in(block.sections)


def render_page(page: pages.Page, digest: str = "", command: str = "") -> str:
    """Return a page as HTML that loads nothing, for light and dark screens and print.

    Args:
        page: the page.
        digest: of the result, see :func:`asperity.core.files.text_digest`; may be empty.
        command: the command line that wrote it, as a shell takes it; empty from Python.
    """
    # Insignificant white space only makes pages larger.
    style = re.sub(r"\s*([{};])\s*", r"\1", _read_template("style.css"))
    script = _read_template("page.js")
    sections = [section for section in page.sections if pages.Media.HTML in section.media]
    pictures = _render_pictures(sections)
    template = template_environment().get_template("page.html.j2")
    return template.render(
        page=page,
        sections=sections,
        picture_of=lambda picture: pictures[id(picture)],
        style=style,
        script=script,
        script_digest=base64.b64encode(hashlib.sha256(script.encode()).digest()).decode(),
        version=__version__,
        date=_build_date(),
        digest=digest,
        command=command,
    )


def render_notebook(page: pages.Page) -> str:
    """Return answer, paragraphs, tables and first figure for a notebook, as HTML."""
    blocks = [
        block
        for section in page.sections
        if pages.Media.NOTEBOOK in section.media
        for block in section.blocks
    ]
    pictures = [block for block in blocks if isinstance(block, pages.Picture)]
    template = template_environment().get_template("notebook.html.j2")
    return template.render(
        page=page,
        paragraphs=[block.text for block in blocks if isinstance(block, pages.Paragraph)],
        tables=[block for block in blocks if isinstance(block, pages.Table)],
        pictures=[(picture, _encode_png(picture)) for picture in pictures[:1]],
    )


def _encode_png(picture: pages.Picture) -> str:
    """Return a picture as PNG in base64: a white card, whatever the colours of the notebook."""
    from asperity.report.pictures.style import to_png

    with pages.default_style():
        return base64.b64encode(to_png(picture.draw())).decode("ascii")


def _read_template(name: str) -> str:
    return resources.files("asperity.report").joinpath("templates", name).read_text("utf-8")


def _build_date() -> str:
    """Return today's date (UTC), or that of SOURCE_DATE_EPOCH, so that pages are reproducible.

    Reference:
        https://reproducible-builds.org/specs/source-date-epoch
    """
    seconds = time.time()
    epoch = os.environ.get("SOURCE_DATE_EPOCH", "")
    if epoch.isdecimal() and len(epoch) < 12:
        seconds = int(epoch)
    return time.strftime("%Y-%m-%d", time.gmtime(seconds))


@lru_cache(maxsize=1)
def template_environment() -> jinja2.Environment:
    """Return the templates of the report; all text is escaped."""
    import jinja2

    return jinja2.Environment(
        loader=jinja2.PackageLoader("asperity.report"),
        autoescape=True,
        undefined=jinja2.StrictUndefined,
        trim_blocks=True,
        lstrip_blocks=True,
    )
