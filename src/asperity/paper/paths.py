"""The closed paths on which the paper looks at the energy of a law (its Fig. 3)."""

from __future__ import annotations

from asperity.paper.plane import Setting, path_points

Points = list[tuple[float, float, float]]
TURN = 0.1e-3
"""Where the paths of (27) and (29) turn [m]; the paper leaves it open."""


def groove_path(case: Setting) -> Points:
    """Return the path for A, B and E: along the wall, up where the texture is highest, back."""
    quarter, top = 0.25 * case.period, case.amplitude
    return path_points((0.0, 0.0), (quarter, 0.0), (quarter, top), (0.0, top))


def friction_path(case: Setting, light: float = TURN) -> Points:
    """Return the path of (27), for F: out at the small depth a, back at the greater."""
    x, deep = case.deflection, -case.depth
    return path_points((0.0, 1e-3), (0.0, -light), (x, -light), (x, deep), (0.0, deep))


def crossing_path(case: Setting, turn: float = TURN) -> Points:
    """Return the path of (29), for G: down at the crest, along at depth a, up at the trough."""
    quarter = 0.25 * case.period
    turns = [(quarter, turn), (quarter, -turn), (3 * quarter, -turn), (3 * quarter, turn)]
    return path_points(*turns)


def path_of(law: str, case: Setting) -> Points:
    """Return the path of a law by its letter; C and D, which the figure lacks, go that of A."""
    return {"F": friction_path, "G": crossing_path}.get(law, groove_path)(case)
