"""The strength-support diagram: what each law gives for the loop gain that it costs."""

from __future__ import annotations

from matplotlib.figure import Figure

from asperity.analysis.compare import Comparison
from asperity.report.pictures import style
from asperity.report.words.number_words import strength_has_unit


def merit_figure(comparison: Comparison) -> Figure:
    """Return strength T against support S, a point per law.

    Laws whose loop gain is unbounded lie at the origin: any texture costs them everything.
    """
    figure = style.new_figure(10.0, 4.6)
    axes = style.panel(figure)
    scale, unit = (1e3, " · l [mm]") if strength_has_unit(comparison) else (1.0, "")
    widest = max(max(row.strength for row in comparison.rows) * scale, 1e-12)
    for row in comparison.rows:
        sound = row.conservative and row.continuous
        x, y = row.strength * scale, row.support
        colour = style.GREEN if sound else style.ORANGE
        name = f"_{row.law.letter}"
        (point,) = axes.plot(x, y, "o", ms=8, color=colour, clip_on=False, label=name)
        letter = axes.annotate(
            row.law.letter,
            (x, y),
            xytext=(0, 7),
            textcoords="offset points",
            ha="center",
            fontsize=style.TITLE,
            color=style.INK,
            fontweight="bold" if row is comparison.recommended_row else "normal",
        )
        for artist in (point, letter):
            style.of_law(artist, row.law.letter)
    axes.set_xlim(0.0, 1.15 * widest)
    axes.set_ylim(0.0, 1.15)
    axes.grid(color=style.FAINT, lw=0.5)
    style.label(axes, f"strength T{unit}", "support S")
    for name, colour in (
        ("conservative and continuous", style.GREEN),
        ("leaks or jumps", style.ORANGE),
    ):
        axes.plot([], [], "o", color=colour, label=name)
    axes.legend(frameon=False, fontsize=style.TICK, loc="upper right")
    return figure
