r"""Formulas as SVG drawn by matplotlib's mathtext: no network, no LaTeX, the colour of the text.

Several lines of one formula are separated by ``\\`` and stand below each other.
"""

from __future__ import annotations

import html
import re
from dataclasses import dataclass
from functools import lru_cache
from typing import Any

from docutils import nodes
from sphinx.application import Sphinx
from sphinx.util import logging
from sphinx.util.math import get_node_equation_number

_SIZE = 100.0  # units of the drawing per em
_LINE_GAP = 0.55  # between the lines of one formula [em]
_SCALE = 1.06  # STIX letters are a little smaller than the text face
_LOGGER = logging.getLogger(__name__)
# LaTeX commands with another name in mathtext.
_SUBSTITUTIONS = {
    r"\tfrac": r"\frac",
    r"\lVert": r"\Vert",
    r"\rVert": r"\Vert",
    r"\lvert": r"\vert",
    r"\rvert": r"\vert",
    r"\Bigl": "",
    r"\Bigr": "",
    r"\T": r"^{\mathsf{T}}",
}


@dataclass(frozen=True)
class Line:
    """One line of a formula as a path, sizes in em."""

    path: str
    width: float
    height: float
    descent: float


def to_mathtext(latex: str) -> str:
    """Return the formula in the syntax of mathtext."""
    return re.sub(r"\\[A-Za-z]+", lambda m: _SUBSTITUTIONS.get(m[0], m[0]), " ".join(latex.split()))


@lru_cache(maxsize=2048)
def render_line(latex: str) -> Line:
    """Return one line of a formula as an SVG path.

    Raises:
        ValueError: for a formula that mathtext cannot parse.
    """
    import matplotlib as mpl
    from matplotlib.font_manager import FontProperties
    from matplotlib.textpath import TextToPath

    with mpl.rc_context({"mathtext.fontset": "stix"}):
        tool, face = TextToPath(), FontProperties(size=_SIZE)
        text = f"${to_mathtext(latex)}$"
        vertices, codes = tool.get_text_path(face, text, ismath=True)
        width, height, descent = tool.get_text_width_height_descent(text, face, ismath=True)
        scale = _SIZE / tool.FONT_SCALE
    return Line(
        _path(vertices, codes, scale), width / _SIZE, (height - descent) / _SIZE, descent / _SIZE
    )


def _path(vertices: Any, codes: Any, scale: float) -> str:
    letters = {1: "M", 2: "L", 3: "Q", 4: "C", 79: "Z"}
    parts, previous = [], 0
    for (x, y), code in zip(vertices, codes, strict=True):
        if code == 79:
            parts.append("Z")
        elif code in (3, 4) and code == previous:
            parts.append(f"{x * scale:.1f} {-y * scale:.1f}")
            # The control points of one curve share its letter; the next curve begins anew.
        else:
            parts.append(f"{letters[int(code)]}{x * scale:.1f} {-y * scale:.1f}")
        previous = code
    return " ".join(parts)


def render_svg(latex: str, css_class: str) -> str:
    """Return a formula as inline SVG that takes the colour of the text around it."""
    lines = [render_line(part.strip()) for part in latex.split(r"\\") if part.strip()]
    paths, y = [], 0.0
    for index, line in enumerate(lines):
        y += (line.height if index else 0.0) + (_LINE_GAP if index else 0.0)
        paths.append(f'<path transform="translate(0 {y * _SIZE:.1f})" d="{line.path}"/>')
        y += line.descent
    top, bottom = lines[0].height + 0.04, y + 0.04
    width, height = max(line.width for line in lines) + 0.06, top + bottom
    label = html.escape(" ".join(latex.split()), quote=True)
    box = f"-3 {-top * _SIZE:.1f} {width * _SIZE:.1f} {height * _SIZE:.1f}"
    style = (
        f"width:{width * _SCALE:.3f}em;height:{height * _SCALE:.3f}em;"
        f"vertical-align:{-bottom * _SCALE:.3f}em"
    )
    return (
        f'<svg class="{css_class}" role="img" aria-label="{label}" viewBox="{box}" '
        f'style="{style}" fill="currentColor">{"".join(paths)}</svg>'
    )


def _safe_svg(node: nodes.Element, css_class: str) -> str:
    latex = node.astext()
    try:
        return render_svg(latex, css_class)
    except ValueError as error:
        _LOGGER.warning("formula %r: %s", latex, str(error).splitlines()[-1], location=node)
        return f"<code>{html.escape(latex)}</code>"


def visit_inline(translator: Any, node: nodes.math) -> None:
    """Write an inline formula."""
    translator.body.append(_safe_svg(node, "formula"))
    raise nodes.SkipNode


def visit_block(translator: Any, node: nodes.math_block) -> None:
    """Write a displayed formula with its number and a link to itself."""
    translator.body.append(translator.starttag(node, "div", CLASS="math-block"))
    translator.body.append(_safe_svg(node, "formula display"))
    if node.get("number"):
        number = get_node_equation_number(translator, node)
        translator.body.append(f'<span class="eqno">({number})')
        translator.add_permalink_ref(node, "Link to this formula")
        translator.body.append("</span>")
    translator.body.append("</div>\n")
    raise nodes.SkipNode


def setup(app: Sphinx) -> dict[str, Any]:
    """Register the renderer as ``mathsvg``."""
    app.add_html_math_renderer("mathsvg", (visit_inline, None), (visit_block, None))
    return {"version": "1", "parallel_read_safe": True, "parallel_write_safe": True}
