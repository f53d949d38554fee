"""The loops around a law: contact, clamp, state; written out as source for one law.

``force_batch``, ``jacobian_batch`` and, for a law with state, ``trace_batch`` run over probe
points on a texture. ``contact_batch`` runs over given contacts, without a texture.
"""

from __future__ import annotations

import ast
import textwrap
from dataclasses import dataclass
from typing import Literal, get_args

from asperity.laws.law import Law

ClampName = Literal["none", "whole", "lateral", "backed"]
CLAMPS: tuple[str, ...] = get_args(ClampName)

# What every kernel receives of a law, before the law's own parameters.
SHARED_PARAMETERS = ("k", "h_mid", "h_half", "clamp_depth", "floor")

_JACOBIAN_NAMES = (
    "fx",
    "fy",
    "fz",
    *(f"j{row}{column}" for row in range(3) for column in range(3)),
)


@dataclass(frozen=True)
class DriverPlan:
    """What the driver must know about a law.

    Attributes:
        law: the law.
        source: its kernels, see :func:`asperity.derive.python_source.law_source`.
        clamp: the depth clamp.
    """

    law: Law
    source: str
    clamp: ClampName

    def arguments(self, function: str) -> list[str]:
        """Return the names of the arguments of one of the law's functions."""
        for node in ast.parse(self.source).body:
            if isinstance(node, ast.FunctionDef) and node.name == function:
                return [argument.arg for argument in node.args.args]
        raise KeyError(function)

    def call(self, function: str) -> str:
        """Return the call of one of the law's functions with the arguments that it takes."""
        return f"{function}({', '.join(self.arguments(function))})"

    @property
    def needs_slope(self) -> bool:
        """Whether the force itself needs more than the height."""
        return not {"hx", "hy"}.isdisjoint(self.arguments("law_force"))

    @property
    def needs_curvature(self) -> bool:
        """Whether the Jacobian needs second derivatives of the height."""
        return not {"hxx", "hxy", "hyy"}.isdisjoint(self.arguments("law_jacobian"))

    @property
    def needs_texture(self) -> bool:
        """Whether the force looks at the texture once contact is known."""
        return self.needs_slope or "h" in self.arguments("law_force")


def driver_source(plan: DriverPlan) -> str:
    """Return the functions of a probe point on a texture and the loops over them, as source."""
    parts = [_probe(plan, "force"), _probe(plan, "jacobian")]
    parts += [_force_batch(plan), _jacobian_batch(plan)]
    if plan.law.stateful:
        parts += [_ANCHOR, _trace_batch(plan)]
    if plan.law.contact.name == "split":
        parts.append(_SPLIT_BATCH.format(unpack=_unpack(plan.law)))
    return "\n\n".join(parts)


def driver_loops(plan: DriverPlan) -> tuple[str, ...]:
    """Return the names of the loops in the source."""
    trace = ("trace_batch",) if plan.law.stateful else ()
    split = ("split_batch",) if plan.law.contact.name == "split" else ()
    return ("force_batch", "jacobian_batch", *trace, *split)


def _unpack(law: Law) -> str:
    return f"{', '.join((*SHARED_PARAMETERS, *law.parameters))} = law"


def _probe(plan: DriverPlan, what: Literal["force", "jacobian"]) -> str:
    """Return the function of one probe point."""
    law = plan.law
    state = ", dx, dy" if law.stateful else ""
    if law.stateful and what == "jacobian":
        state += ", sxx, sxy, syy"
    names = _JACOBIAN_NAMES[:3] if what == "force" else _JACOBIAN_NAMES
    zeros = ", ".join(["0.0"] * len(names))
    lines = [_unpack(law), *_enter_contact(plan, what), f"    return {zeros}"]
    lines += _clamped_force(plan) if what == "force" else _clamped_jacobian(plan)
    lines.append(f"return {', '.join(names)}")
    body = textwrap.indent("\n".join(lines), "    ")
    return f"def probe_{what}(x, y, z{state}, texture, law):\n{body}\n"


def _enter_contact(plan: DriverPlan, what: str) -> list[str]:
    """Return the lines that find the contact; the next line leaves if there is none."""
    sampled = {
        "force": "h, hx, hy = slope({}, texture)"
        if plan.needs_slope
        else "h = height({}, texture)",
        "jacobian": "h, hx, hy, hxx, hxy, hyy = curvature({}, texture)"
        if plan.needs_curvature
        else "h, hx, hy = slope({}, texture)",
    }[what]
    here = sampled.format("x, y")
    contact = plan.law.contact.name
    if contact == "nominal":
        # The texture is sampled after the early return: see _after_contact.
        return ["depth = -z", "if not depth > 0.0:"]
    if contact == "vertical":
        return [here, "depth = h - z", "if not depth > 0.0:"]
    return ["if not height(x, y, texture) - z > 0.0:"]  # nearest and split


def _after_contact(plan: DriverPlan, what: str) -> list[str]:
    """Return the lines that sample the texture once contact is known."""
    width = "slope" if plan.needs_slope else "height"
    names = "h, hx, hy" if plan.needs_slope else "h"
    if what == "jacobian" and plan.needs_curvature:
        width, names = "curvature", "h, hx, hy, hxx, hxy, hyy"
    elif what == "jacobian":
        width, names = "slope", "h, hx, hy"
    if plan.law.contact.name == "split":
        if what == "force":
            return ["tx, ty, tz = split_contact(x, y, z, continuity, texture)"]
        derivative = "tx, ty, tz, mxx, mxy, mxz, myy, myz, mzz"
        return [f"{derivative} = split_derivative(x, y, z, continuity, texture)"]
    if plan.law.contact.name == "nearest":
        return [
            "foot_x, foot_y, h, hx, hy = foot(x, y, z, texture)",
            *([f"{names} = curvature(foot_x, foot_y, texture)"] if width == "curvature" else []),
            "depth = math.sqrt((x - foot_x)**2 + (y - foot_y)**2 + (z - h)**2)",
        ]
    if plan.law.contact.name == "nominal" and plan.needs_texture:
        return [f"{names} = {width}(x, y, texture)"]
    return []


def _clamped_force(plan: DriverPlan) -> list[str]:
    lines = _after_contact(plan, "force")
    call = plan.call("law_force")
    if plan.clamp in {"whole", "backed"}:
        lines += ["depth = min(depth, clamp_depth)"]
    lines.append(f"fx, fy, fz = {call}")
    if plan.clamp == "lateral":
        lines += ["if depth > clamp_depth:", "    depth = clamp_depth"]
        lines += [f"    fx, fy, _unclamped = {call}"]
    if plan.clamp == "backed":
        lines += ["if z < floor:", "    fz += k * (floor - z)"]
    return lines


def _clamped_jacobian(plan: DriverPlan) -> list[str]:
    lines = _after_contact(plan, "jacobian")
    every = ", ".join(_JACOBIAN_NAMES)
    lines.append(f"{every} = {plan.call('law_jacobian')}")
    if plan.clamp == "none":
        return lines
    lines += ["if depth > clamp_depth:", "    depth = clamp_depth"]
    saturated = plan.call("law_jacobian_saturated")
    if plan.clamp == "lateral":
        lines.append(f"    fx, fy, _unclamped = {plan.call('law_force')}")
        lines.append(f"    j00, j01, j02, j10, j11, j12, _a, _b, _c = {saturated}")
    else:
        lines.append(f"    fx, fy, fz = {plan.call('law_force')}")
        lines.append(f"    {', '.join(_JACOBIAN_NAMES[3:])} = {saturated}")
    if plan.clamp == "backed":
        lines += ["if z < floor:", "    fz += k * (floor - z)", "    j22 -= k"]
    return lines


def _force_batch(plan: DriverPlan) -> str:
    state, values = ("deflection, ", "deflection[i, 0], deflection[i, 1], ")
    if not plan.law.stateful:
        state = values = ""
    return f'''def force_batch(points, {state}out, texture, law):
    """Forces [N] at the points [m]."""
    for i in range(points.shape[0]):
        fx, fy, fz = probe_force(
            points[i, 0], points[i, 1], points[i, 2], {values}texture, law
        )
        out[i, 0] = fx
        out[i, 1] = fy
        out[i, 2] = fz
'''


_SLIDING = """dx = deflection[i, 0]
dy = deflection[i, 1]
sxx = 1.0
sxy = 0.0
syy = 1.0
square = dx*dx + dy*dy
if sliding[i] and square > 0.0:
    sxx -= dx*dx/square
    sxy -= dx*dy/square
    syy -= dy*dy/square
"""


def _store_jacobian(indent: int) -> str:
    lines = [f"force[i, {n}] = {_JACOBIAN_NAMES[n]}" for n in range(3)]
    lines += [f"jacobian[i, {r}, {c}] = j{r}{c}" for r in range(3) for c in range(3)]
    return textwrap.indent("\n".join(lines), " " * indent)


def _jacobian_batch(plan: DriverPlan) -> str:
    state = "deflection, sliding, " if plan.law.stateful else ""
    values = "dx, dy, sxx, sxy, syy, " if plan.law.stateful else ""
    prepare = textwrap.indent(_SLIDING, " " * 8) if plan.law.stateful else ""
    return f'''def jacobian_batch(points, {state}force, jacobian, texture, law):
    """Forces [N] and Jacobians [N/m] at the points [m]."""
    for i in range(points.shape[0]):
{prepare}        {", ".join(_JACOBIAN_NAMES)} = probe_jacobian(
            points[i, 0], points[i, 1], points[i, 2], {values}texture, law
        )
{_store_jacobian(8)}
'''


_ANCHOR = '''def drag_anchor(x, y, held, ax, ay, max_deflection):
    """The time-free stick-slip map: anchor and deflection after the probe moved to (x, y)."""
    if not held:
        return x, y, 0.0, 0.0
    dx = x - ax
    dy = y - ay
    length = math.sqrt(dx*dx + dy*dy)
    if length > max_deflection:
        dx *= max_deflection / length
        dy *= max_deflection / length
        ax = x - dx
        ay = y - dy
    return ax, ay, dx, dy
'''


def _trace_batch(plan: DriverPlan) -> str:
    return f'''def trace_batch(points, out, texture, law):
    """Forces [N] along a path [m], the anchor carried, released at the start."""
    {_unpack(plan.law)}
    held = False
    ax = 0.0
    ay = 0.0
    for i in range(points.shape[0]):
        x = points[i, 0]
        y = points[i, 1]
        z = points[i, 2]
        dx = 0.0
        dy = 0.0
        if z < 0.0:
            ax, ay, dx, dy = drag_anchor(x, y, held, ax, ay, max_deflection)
            held = True
        else:
            held = False
        fx, fy, fz = probe_force(x, y, z, dx, dy, texture, law)
        out[i, 0] = fx
        out[i, 1] = fy
        out[i, 2] = fz
'''


_SPLIT_BATCH = '''def split_batch(points, out, texture, law):
    """Potential/k [m²], number of atoms and gap [m²] of the split god-object at the points [m]."""
    {unpack}
    for i in range(points.shape[0]):
        x = points[i, 0]
        y = points[i, 1]
        z = points[i, 2]
        value = 0.0
        count = 0
        gap = 0.0
        if height(x, y, texture) > z:
            value, count, gap = split_energy(x, y, z, continuity, texture)
        out[i, 0] = value
        out[i, 1] = count
        out[i, 2] = gap
'''


def contact_source(plan: DriverPlan) -> str:
    """Return the loop over given contacts, as source.

    ``contact_batch(xy, depth, derivatives, deflection, sliding, force, jacobian, law)``: the
    contact point, the depth and the height derivatives there are given, the probe follows from
    them. It needs no texture, so depth zero (the limit from inside) can be asked for.
    """
    place = {
        "nominal": "x, y, z = xy[i, 0], xy[i, 1], -depth",
        "vertical": "x, y, z = xy[i, 0], xy[i, 1], h - depth",
        "nearest": "below = depth / math.sqrt(1.0 + hx*hx + hy*hy)\n"
        "x, y, z = xy[i, 0] + below*hx, xy[i, 1] + below*hy, h - below",
    }[plan.law.contact.name]
    lines = ["depth = depths[i]"]
    lines += [f"{name} = derivatives[i, {n}]" for n, name in enumerate(_HEIGHT_NAMES)]
    lines += place.splitlines()
    lines += _SLIDING.splitlines() if plan.law.stateful else []
    lines.append(f"{', '.join(_JACOBIAN_NAMES)} = {plan.call('law_jacobian')}")
    body = textwrap.indent("\n".join(lines), " " * 8)
    return f'''def contact_batch(
    xy, depths, derivatives, deflection, sliding, force, jacobian, law
):
    """Forces [N] and Jacobians [N/m] at given contacts."""
    {_unpack(plan.law)}
    for i in range(depths.shape[0]):
{body}
{_store_jacobian(8)}
'''


_HEIGHT_NAMES = ("h", "hx", "hy", "hxx", "hxy", "hyy")
