"""Figures as SVG embedded in a page: short, reproducible, and in the colours of its theme."""

from __future__ import annotations

import hashlib
import io
import re
from typing import Any

from matplotlib.figure import Figure

from asperity.report.pictures import style

# Parts of the panel of a law that stay visible when the law is hidden, as neighbours share them.
_SHARED_ID_PATTERN = r"(?:matplotlib\.axis|legend)_\d+"


def svg_text(figure: Figure, dpi: int = 160) -> str:
    """Return the figure as SVG for a page, the same text for the same figure.

    Colours of the palette are CSS variables with the light colour as fallback. Identifiers begin
    with a digest of the figure, so that a page can contain several figures.

    Args:
        figure: the figure.
        dpi: resolution of rasterized parts.
    """
    buffer = io.BytesIO()
    options: dict[str, Any] = {
        "facecolor": style.BACKGROUND,
        "metadata": {"Date": None, "Creator": None},
    }
    figure.savefig(buffer, format="svg", dpi=dpi, **options)
    text = buffer.getvalue().decode("utf-8")
    # A page needs no prologue, metadata, comments or indentation.
    text = re.sub(r"\s*<metadata>.*?</metadata>", "", text[text.index("<svg") :], flags=re.DOTALL)
    text = re.sub(r"\n *", "\n", re.sub(r"<!--.*?-->", "", text, flags=re.DOTALL)).strip()
    # Its style would apply to the whole page; black, Matplotlib's default, becomes ink.
    text = re.sub(r"<defs>\s*<style.*?</style>\s*</defs>", "", text, flags=re.DOTALL)
    whole = f"fill: {style.INK}; stroke-linejoin: round; stroke-linecap: butt"
    # The page sets the size; namespaces are needed in a separate file only.
    root = re.sub(r' (?:width|height|version|xmlns[:\w]*)="[^"]*"', "", text[: text.index(">")])
    text = root.replace("<svg", f'<svg style="{whole}"') + text[text.index(">") :]
    return _renumber_ids(_apply_theme(_shorten_paths(text)))


def _shorten_paths(text: str) -> str:
    """Return the text with three decimals in paths: a thousandth of a point is invisible."""
    return re.sub(r' d="[^"]*"', lambda found: re.sub(r"(\.\d{3})\d+", r"\1", found[0]), text)


def _apply_theme(text: str) -> str:
    """Return the text with CSS variables for the colours of the palette in styles."""
    return re.sub(r'style="[^"]*"', lambda found: _theme_style(found[0]), text)


def _theme_style(styles: str) -> str:
    def variable(found: re.Match[str]) -> str:
        what, colour = found.groups()
        name = style.THEME_VARIABLES.get(colour)
        return f"{what}: var(--p-{name}, {colour})" if name else found[0]

    return re.sub(r"(fill|stroke): (#[0-9a-f]{6})", variable, styles)


def _renumber_ids(text: str) -> str:
    """Return the text with numbered identifiers, those without references removed.

    Matplotlib makes some of them random, and others equal in every figure.
    """
    text = re.sub(rf'\bid="{style.LAW_PREFIX}(\w+)"', r'data-law="\1"', text)
    text = re.sub(rf'\bid="{_SHARED_ID_PATTERN}"', 'class="shared"', text)
    used = re.findall(r'(?:url\(|href=")#([^")]+)', text)
    numbers = {name: f"{number:x}" for number, name in enumerate(dict.fromkeys(used))}

    def plain(found: re.Match[str]) -> str:
        before, name, after = found.groups()
        return f"{before}@{numbers[name]}{after}" if name in numbers else ""

    text = re.sub(r'((?:url\(|href=")#)([^")]+)([")])', plain, text)
    text = re.sub(r'( id=")([^"]+)(")', plain, text)
    digest = hashlib.sha256(text.encode()).hexdigest()[:6]
    return re.sub(r'((?:url\(|href=")#| id=")@', rf"\g<1>p{digest}-", text)
