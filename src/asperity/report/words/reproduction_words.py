"""Three lines of Python that evaluate ‖J‖/k where it attains q."""

from __future__ import annotations

import math

import numpy as np

from asperity.analysis.analysis_result import Analysis
from asperity.laws import LAW_ARGUMENTS, LAWS
from asperity.report.words.number_words import interval_text
from asperity.surface import Surface

# How near to the onset of the medial axis q is shown to grow, as a part of the way to the surface.
_NEAR = 1e-6
_UNBOUNDED = "grows without bound towards the onset"


def reproduction(analysis: Analysis, texture: str = "") -> list[str]:
    """Return three lines of Python that evaluate ‖J‖/k where it attains q.

    Where q is infinite they evaluate it just above the onset, where it is large.

    Args:
        analysis: the result.
        texture: an expression that makes the texture; by default its ``repr`` if that is one.
    """
    surface = analysis.surface
    lines = ["import asperity as asp, numpy as np"]
    if "load_scene(" in texture:
        lines[0] += "; from asperity.scene import load_scene"
    lines.append(f"s = asp.Surface({_texture_code(surface, texture)}, {_arguments(surface)})")
    found = _evaluated(analysis)
    if found is None:
        said = interval_text(analysis.q)
        return [*lines, f"print(asp.characteristic_number(s))  # {said}, {analysis.q.method}"]
    point, value, words = found
    given = f"[{[float(v) for v in point]}]"
    if analysis.q.deflection is not None:
        held = list(analysis.q.deflection)
        given += f", [{held}], np.array([{analysis.q.sliding}])"
    call = f"np.linalg.norm(s.jacobian({given})[0], 2) / s.stiffness"
    return [*lines, f"print({call})  # {value:.12g}{words}"]


def _evaluated(analysis: Analysis) -> tuple[np.ndarray, float, str] | None:
    """Return where to evaluate, what comes out, and what to say of it."""
    surface, q = analysis.surface, analysis.q
    if q.at is None:
        return None
    at, words = np.array(q.at), ""
    if math.isinf(q.lower):
        foot = surface.texture.nearest(at[None])[0]
        at, words = at + _NEAR * (foot - at), f": {_UNBOUNDED}"
    state = () if q.deflection is None else (np.array([q.deflection]), np.array([q.sliding]))
    jacobian = surface.jacobian(at[None], *state)[0]
    return at, float(np.linalg.norm(jacobian, 2)) / surface.stiffness, words


def _texture_code(surface: Surface, texture: str) -> str:
    if texture:
        return texture
    written = repr(surface.texture)
    return "texture" if written.startswith("<") else f"asp.{written}"


def _arguments(surface: Surface) -> str:
    law = surface.law
    shipped = LAWS.get(law.letter) is law
    parts = [repr(law.letter) if shipped else "law"]
    parts += [f"stiffness={surface.stiffness!r}", f"max_depth={surface.max_depth!r}"]
    own = {name: v for name, v in surface.law_parameters.items() if v != law.parameters[name]}
    parts += [f"{name}={v!r}" for name, v in own.items() if name in LAW_ARGUMENTS]
    rest = {name: v for name, v in own.items() if name not in LAW_ARGUMENTS}
    if rest:
        parts.append(f"law_parameters={rest!r}")
    if surface.clamp != "none":
        parts.append(f"clamp={surface.clamp!r}")
    return ", ".join(parts)
