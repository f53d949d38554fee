"""Pages as LaTeX: a paragraph and tables, which need no package."""

from __future__ import annotations

from asperity.report.document import page as pages

_COMMANDS = {
    **{character: f"\\{character}" for character in "&%$#_{}"},
    "\\": r"\textbackslash{}",
    "~": r"$\sim$",
    "^": r"\textasciicircum{}",
    "<": "$<$",
    ">": "$>$",
    "|": "$|$",
    "µ": r"$\mu$",
    "μ": r"$\mu$",
    "α": r"$\alpha$",
    "β": r"$\beta$",
    "γ": r"$\gamma$",
    "δ": r"$\delta$",
    "κ": r"$\kappa$",
    "λ": r"$\lambda$",
    "σ": r"$\sigma$",
    "₀": "$_0$",
    "⁺": "$^+$",
    "²": "$^2$",
    "°": r"$^\circ$",
    "∞": r"$\infty$",
    "·": r"$\cdot$",
    "×": r"$\times$",
    "≤": r"$\leq$",
    "≥": r"$\geq$",
    "√": r"$\sqrt{}$",
    "−": "$-$",
    "–": "--",
    "“": "``",
    "”": "''",
}
_LAST_LETTER = "ſ"  # of the Latin letters with accents, which LaTeX reads as they are


def escape_latex(text: str) -> str:
    r"""Return a text for LaTeX; a character that it lacks becomes a question mark.

    Example:
        >>> print(escape_latex("q⁺ at 11 %, 50 µm, land_1.x3p"))
        q$^+$ at 11 \%, 50 $\mu$m, land\_1.x3p
    """
    return "".join(map(_escape_character, text))


def _escape_character(character: str) -> str:
    if character in _COMMANDS:
        return _COMMANDS[character]
    is_known = character.isascii() or (character.isalpha() and character <= _LAST_LETTER)
    return character if is_known else "?"


def render_latex(page: pages.Page) -> str:
    r"""Return a paragraph and the tables of a page, to be read by a document with ``\input``.

    The paragraph is that for a methods section, if the page has one, else its answer.
    """
    parts = [f"{escape_latex(page.methods or page.answer)}\n"]
    for section in page.sections:
        if pages.Media.TERMINAL in section.media:
            parts += [_render_table(b, page) for b in section.blocks if isinstance(b, pages.Table)]
    return "\n".join(parts)


def _render_table(table: pages.Table, page: pages.Page) -> str:
    """Return a table with its caption; empty for one without headings."""
    if not table.headings:
        return ""
    kinds = ["r" if i in table.numeric_columns else "l" for i in range(len(table.headings))]
    rows = [[pages.single_line(heading) for heading in table.headings]]
    rows += [[cell if isinstance(cell, str) else cell.text for cell in r.cells] for r in table.rows]
    lines = [" & ".join([escape_latex(cell) for cell in row]) + r" \\" for row in rows]
    meanings = [f"{name}: {meaning}" for name, meaning in table.layout.legend.values()]
    caption = escape_latex(f"{page.title}. {'. '.join(meanings)}")
    body = [
        r"\begin{table}",
        rf"\caption{{{caption}}}",
        r"\centering",
        rf"\begin{{tabular}}{{{''.join(kinds)}}}",
        r"\hline",
        lines[0],
        r"\hline",
        *lines[1:],
        r"\hline",
        r"\end{tabular}",
        r"\end{table}",
    ]
    return "\n".join(body) + "\n"
