"""A figure as SVG that stands in a page: short, reproducible, and in the colours of its theme."""

from __future__ import annotations

import hashlib
import io
import re
from typing import Any

from matplotlib.figure import Figure

from asperity.report.pictures import style

# The parts of a law's panel that stay when the law is hidden, for they serve its neighbours too.
_SHARED = r"(?:matplotlib\.axis|legend)_\d+"


def svg_text(figure: Figure, dpi: int = 160) -> str:
    """Return the figure as SVG for a page, the same text for the same figure.

    Colours of the palette are CSS variables with the light colour to fall back on. Identifiers
    begin with a digest of the picture, so that several pictures may stand in one page.

    Args:
        figure: the figure.
        dpi: of what in it is drawn as pixels.
    """
    buffer = io.BytesIO()
    options: dict[str, Any] = {"facecolor": style.CARD, "metadata": {"Date": None, "Creator": None}}
    figure.savefig(buffer, format="svg", dpi=dpi, **options)
    text = buffer.getvalue().decode("utf-8")
    # A page needs no prologue, no words about the file, no comments and no indentation.
    text = re.sub(r"\s*<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = re.sub(r"\n *", "\n", re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)).strip()
    # Its style would be that of the whole page; black, of which matplotlib says nothing, is ink.
    text = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", text, flags=re.DOTALL)
    whole = f"fill: {style.INK}; stroke-linejoin: round; stroke-linecap: butt"
    # The page says how large it is; names of namespaces are for a file of its own.
    root = re.sub(r' (?:width|height|version|xmlns[:\w]*)="[^"]*"', "", text[: text.index(">")])
    text = root.replace("<svg", f'<svg style="{whole}"') + text[text.index(">") :]
    return _renamed(_coloured(_shortened(text)))


def _shortened(text: str) -> str:
    """Return the text with three decimals in paths: a thousandth of a point is not seen."""
    return re.sub(r' d="[^"]*"', lambda found: re.sub(r"(\.\d{3})\d+", r"\1", found[0]), text)


def _coloured(text: str) -> str:
    """Return the text with variables for the colours of the palette, where they are styles."""
    return re.sub(r'style="[^"]*"', lambda found: _themed(found[0]), text)


def _themed(styles: str) -> str:
    def variable(found: re.Match[str]) -> str:
        what, colour = found.groups()
        name = style.THEMED.get(colour)
        return f"{what}: var(--p-{name}, {colour})" if name else found[0]

    return re.sub(r"(fill|stroke): (#[0-9a-f]{6})", variable, styles)


def _renamed(text: str) -> str:
    """Return the text with identifiers only where something refers to them, numbered in order.

    Matplotlib draws some of them at random, and others are the same in every picture.
    """
    text = re.sub(rf'\bid="{style.LAW}(\w+)"', r'data-law="\1"', text)
    text = re.sub(rf'\bid="{_SHARED}"', 'class="shared"', text)
    used = re.findall(r'(?:url\(|href=")#([^")]+)', text)
    numbers = {name: f"{number:x}" for number, name in enumerate(dict.fromkeys(used))}

    def plain(found: re.Match[str]) -> str:
        before, name, after = found.groups()
        return f"{before}@{numbers[name]}{after}" if name in numbers else ""

    text = re.sub(r'((?:url\(|href=")#)([^")]+)([")])', plain, text)
    text = re.sub(r'( id=")([^"]+)(")', plain, text)
    digest = hashlib.sha256(text.encode()).hexdigest()[:6]
    return re.sub(r'((?:url\(|href=")#| id=")@', rf"\g<1>p{digest}-", text)
