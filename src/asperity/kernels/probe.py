"""The functions of one probe point on a texture, written for a law: contact, formula, clamp.

They join what the contact says of itself with the law's own functions; ``law_functions`` lists
them. Loops over points are plain modules beside this one.
"""

from __future__ import annotations

import ast
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import Literal, get_args

from asperity.kernels.parsing import tree_of
from asperity.laws.law import Law

ClampName = Literal["none", "whole", "lateral", "backed"]
CLAMPS: tuple[str, ...] = get_args(ClampName)

# What every kernel receives of a law, before the law's own parameters.
SHARED_PARAMETERS = ("k", "h_mid", "h_half", "clamp_depth", "floor")

_FORCE = ("fx", "fy", "fz")
_JACOBIAN = tuple(f"j{row}{column}" for row in range(3) for column in range(3))
_STATE = ("dx", "dy", "sxx", "sxy", "syy")


@dataclass(frozen=True)
class ProbePlan:
    """What must be known of a law to write its functions.

    Attributes:
        law: the law.
        source: its kernels, see :func:`asperity.derive.python_source.law_source`.
        clamp: the depth clamp.
    """

    law: Law
    source: str
    clamp: ClampName

    @cached_property
    def arguments(self) -> dict[str, tuple[str, ...]]:
        """The names of the arguments of each of the law's functions."""
        return {
            node.name: tuple(argument.arg for argument in node.args.args)
            for node in tree_of(self.source).body
            if isinstance(node, ast.FunctionDef)
        }

    def call(self, function: str) -> str:
        """Return the call of one of the law's functions with the arguments that it takes."""
        return f"{function}({', '.join(self.arguments[function])})"

    def wanted(self, *functions: str) -> frozenset[str]:
        """Return the names of all arguments of some of the law's functions."""
        return frozenset(name for function in functions for name in self.arguments[function])

    @property
    def unpack(self) -> str:
        """The line that names the parameters."""
        return f"{', '.join((*SHARED_PARAMETERS, *self.law.parameters))} = law"


def probe_source(plan: ProbePlan) -> str:
    """Return the functions of a probe point, as source."""
    parts = (_probe_force, _probe_jacobian, _probe_inside, _probe_depth, _probe_held)
    texts = [part(plan) for part in parts]
    if plan.law.contact.remembers:
        texts.append(_probe_force(plan, again=True))
    texts.append(_probe_held(plan, again=True))
    return "\n\n\n".join(texts)


def _function(head: str, lines: Sequence[str]) -> str:
    return f"def {head}:\n{textwrap.indent(chr(10).join(lines), ' ' * 4)}\n"


def _in_contact(
    plan: ProbePlan, wanted: frozenset[str], results: Sequence[str], again: bool = False
) -> list[str]:
    """Return the lines that leave a function out of contact, and find what is wanted in it."""
    contact = plan.law.contact
    lines, condition = contact.begin_code(wanted)
    leave = [f"if not {condition}:", f"    return {', '.join(['0.0'] * len(results))}"]
    sample = contact.again_code(wanted) if again else contact.sample_code(wanted)
    return [plan.unpack, *lines, *leave, *sample]


def _probe_force(plan: ProbePlan, again: bool = False) -> str:
    lines = _in_contact(plan, plan.wanted("law_force"), _FORCE, again)
    call = plan.call("law_force")
    if plan.clamp in {"whole", "backed"}:
        lines += ["depth = min(depth, clamp_depth)"]
    lines.append(f"fx, fy, fz = {call}")
    if plan.clamp == "lateral":
        lines += ["if depth > clamp_depth:", "    depth = clamp_depth"]
        lines += [f"    fx, fy, _unclamped = {call}"]
    if plan.clamp == "backed":
        lines += ["if z < floor:", "    fz += k * (floor - z)"]
    lines.append(f"return {', '.join(_FORCE)}")
    if again:
        return _function("probe_again(x, y, z, dx, dy, memory, texture, law)", lines)
    return _function("probe_force(x, y, z, dx, dy, texture, law)", lines)


def _probe_jacobian(plan: ProbePlan) -> str:
    every = (*_FORCE, *_JACOBIAN)
    saturated = () if plan.clamp == "none" else ("law_force", "law_jacobian_saturated")
    lines = _in_contact(plan, plan.wanted("law_jacobian", *saturated), every)
    lines.append(f"{', '.join(every)} = {plan.call('law_jacobian')}")
    if saturated:
        lines += ["if depth > clamp_depth:", "    depth = clamp_depth"]
        force, jacobian = (plan.call(name) for name in saturated)
        if plan.clamp == "lateral":
            lines.append(f"    fx, fy, _unclamped = {force}")
            lines.append(f"    j00, j01, j02, j10, j11, j12, _a, _b, _c = {jacobian}")
        else:
            lines.append(f"    fx, fy, fz = {force}")
            lines.append(f"    {', '.join(_JACOBIAN)} = {jacobian}")
    if plan.clamp == "backed":
        lines += ["if z < floor:", "    fz += k * (floor - z)", "    j22 -= k"]
    head = f"probe_jacobian(x, y, z, {', '.join(_STATE)}, texture, law)"
    return _function(head, [*lines, f"return {', '.join(every)}"])


def _probe_inside(plan: ProbePlan) -> str:
    lines, condition = plan.law.contact.begin_code(frozenset())
    return _function("probe_inside(x, y, z, texture)", [*lines, f"return {condition}"])


def _probe_depth(plan: ProbePlan) -> str:
    return _function("probe_depth(x, y, z, texture)", plan.law.contact.depth_code())


def _probe_held(plan: ProbePlan, again: bool = False) -> str:
    lines = [plan.unpack, *_HELD.splitlines()] if plan.law.stateful else ["dx = dy = 0.0"]
    if again and plan.law.contact.remembers:
        lines.append("fx, fy, fz = probe_again(x, y, z, dx, dy, memory, texture, law)")
    else:
        lines.append("fx, fy, fz = probe_force(x, y, z, dx, dy, texture, law)")
    lines.append("return fx, fy, fz, ax, ay, held")
    if again:
        return _function("probe_tick(x, y, z, ax, ay, held, memory, texture, law)", lines)
    return _function("probe_held(x, y, z, ax, ay, held, texture, law)", lines)


_HELD = """dx = 0.0
dy = 0.0
if probe_inside(x, y, z, texture):
    ax, ay, dx, dy = drag_anchor(x, y, held, ax, ay, max_deflection)
    held = True
else:
    held = False
"""


def energy_source(plan: ProbePlan) -> str:
    """Return ``probe_energy``, the potential energy [J] of a conservative law.

    The plan's source is ``law_energy``, which returns the energy and its derivative by the depth:
    where a clamp holds the depth the force is constant along it.
    """
    lines = _in_contact(plan, plan.wanted("law_energy"), ("energy",))
    clamped = plan.clamp in {"whole", "backed"}
    if clamped:
        lines += ["beyond = max(depth - clamp_depth, 0.0)", "depth = min(depth, clamp_depth)"]
    lines.append(f"energy, rate = {plan.call('law_energy')}")
    if clamped:
        lines.append("energy += rate * beyond")
    if plan.clamp == "backed":
        lines += ["if z < floor:", "    energy += 0.5 * k * (floor - z) * (floor - z)"]
    return _function("probe_energy(x, y, z, texture, law)", [*lines, "return energy"])


def contact_source(plan: ProbePlan) -> str:
    """Return ``contact_jacobian``, which is given the contact and the height derivatives there."""
    given = ("x", "y", "z", "depth", "h", "hx", "hy", "hxx", "hxy", "hyy", *_STATE)
    lines = [plan.unpack, f"return {plan.call('law_jacobian')}"]
    return _function(f"contact_jacobian({', '.join(given)}, law)", lines)
