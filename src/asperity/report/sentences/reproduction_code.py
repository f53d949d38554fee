"""Three lines of Python that evaluate ‖J‖/k where it attains q."""

from __future__ import annotations

import math

import numpy as np

from asperity.analysis.analyze import Analysis
from asperity.clamps import NONE
from asperity.laws import LAWS, SHIPPED_LAW_ARGUMENTS
from asperity.report.sentences.number_text import interval_text
from asperity.surface import Surface

# Distance from the onset of the medial axis, as a fraction of the distance to the surface.
_ONSET_OFFSET = 1e-6
_UNBOUNDED_TEXT = "grows without bound towards the onset"


def reproduction_lines(analysis: Analysis, texture_code: str = "") -> list[str]:
    """Return three lines of Python that evaluate ‖J‖/k where it attains q.

    Where q is infinite they evaluate it just above the onset, where it is large.

    Args:
        analysis: the result.
        texture_code: an expression of the texture; by default its ``repr`` if that is one.
    """
    surface = analysis.surface
    lines = ["import asperity as asp, numpy as np"]
    if "load_scene(" in texture_code:
        lines[0] += "; from asperity.scene import load_scene"
    texture = _texture_expression(surface, texture_code)
    lines.append(f"s = asp.Surface({texture}, {_surface_arguments(surface)})")
    evaluation = _evaluate_witness(analysis)
    if evaluation is None:
        q = interval_text(analysis.q)
        return [*lines, f"print(asp.characteristic_number(s))  # {q}, {analysis.q.method}"]
    point, value, remark = evaluation
    arguments = f"[{[float(v) for v in point]}]"
    if analysis.q.deflection is not None:
        deflection = list(analysis.q.deflection)
        arguments += f", [{deflection}], np.array([{analysis.q.sliding}])"
    call = f"np.linalg.norm(s.jacobian({arguments})[0], 2) / s.stiffness"
    return [*lines, f"print({call})  # {value:.12g}{remark}"]


def _evaluate_witness(analysis: Analysis) -> tuple[np.ndarray, float, str] | None:
    """Return the point of the evaluation, its value and a remark; ``None`` without a witness."""
    surface, q = analysis.surface, analysis.q
    if q.at is None:
        return None
    at, remark = np.array(q.at), ""
    if math.isinf(q.lower):
        closest = surface.texture.nearest(at[None])[0]
        at, remark = at + _ONSET_OFFSET * (closest - at), f": {_UNBOUNDED_TEXT}"
    state = () if q.deflection is None else (np.array([q.deflection]), np.array([q.sliding]))
    jacobian = surface.jacobian(at[None], *state)[0]
    return at, float(np.linalg.norm(jacobian, 2)) / surface.stiffness, remark


def _texture_expression(surface: Surface, texture_code: str) -> str:
    if texture_code:
        return texture_code
    written = repr(surface.texture)
    return "texture" if written.startswith("<") else f"asp.{written}"


def _surface_arguments(surface: Surface) -> str:
    law = surface.law
    shipped = LAWS.get(law.letter) is law
    parts = [repr(law.letter) if shipped else "law"]
    parts += [f"stiffness={surface.stiffness!r}", f"max_depth={surface.max_depth!r}"]
    own = {name: v for name, v in surface.law_parameters.items() if v != law.parameters[name]}
    parts += [f"{name}={v!r}" for name, v in own.items() if name in SHIPPED_LAW_ARGUMENTS]
    rest = {name: v for name, v in own.items() if name not in SHIPPED_LAW_ARGUMENTS}
    if rest:
        parts.append(f"law_parameters={rest!r}")
    if surface.clamp != NONE.name:
        parts.append(f"clamp={surface.clamp!r}")
    return ", ".join(parts)
