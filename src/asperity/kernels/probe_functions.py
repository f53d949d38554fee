"""The functions of a probe that loops call: their interface, and their generation for a law.

The linker binds the calls of the loops to the generated functions, which combine the code of the
contact with the functions of the law and its clamp. ``texture`` is the record of a texture kind,
``law`` the tuple :attr:`asperity.surface.Surface.law_arguments`, or
:attr:`~asperity.surface.Surface.loop_arguments` for a surface with friction.
"""

from __future__ import annotations

import ast
import textwrap
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property

from asperity.contacts.contact import parameter_name
from asperity.core.checks import FloatArray
from asperity.kernels.link import parse_source
from asperity.laws.clamps import Clamp
from asperity.laws.law import Law

Vector3 = tuple[float, float, float]
Matrix3Rows = tuple[float, float, float, float, float, float, float, float, float]


def probe_force(
    x: float, y: float, z: float, dx: float, dy: float, texture: object, law: object
) -> Vector3:
    """Return the force [N]; (dx, dy) is the deflection of the anchor [m] for a law with state."""
    raise NotImplementedError  # the linker binds calls to the generated function


def probe_jacobian(
    x: float,
    y: float,
    z: float,
    dx: float,
    dy: float,
    sxx: float,
    sxy: float,
    syy: float,
    texture: object,
    law: object,
) -> tuple[*Vector3, *Matrix3Rows]:
    """Return force [N] and Jacobian [N/m], row by row; s.. is the derivative of the deflection."""
    raise NotImplementedError  # the linker binds calls to the generated function


def probe_in_contact(x: float, y: float, z: float, texture: object) -> bool:
    """Return whether there is contact."""
    raise NotImplementedError  # the linker binds calls to the generated function


def probe_depth(x: float, y: float, z: float, texture: object) -> float:
    """Return the depth [m]; 0 out of contact."""
    raise NotImplementedError  # the linker binds calls to the generated function


def probe_tick(
    x: float,
    y: float,
    z: float,
    ax: float,
    ay: float,
    az: float,
    held: bool,
    warm_start: FloatArray,
    texture: object,
    law: object,
) -> tuple[float, float, float, float, float, float, bool]:
    """Return the force [N], the new anchor position [m] and whether the anchor is held.

    A law with state holds its anchor during contact, friction from its first tick on; other laws
    leave it unchanged. Friction on a closed body alone changes ``az``. A search stays within the
    budget of ``warm_start`` and updates it; see :mod:`asperity.contacts.warm_start`.
    """
    raise NotImplementedError  # the linker binds calls to the generated function


def probe_slip(
    x: float, y: float, z: float, warm_start: FloatArray, texture: object, law: object
) -> tuple[float, float, float, float]:
    """Return the force [N] of the law of a surface with friction, and the slip limit [N]."""
    raise NotImplementedError  # the linker binds calls to the generated function


def contact_jacobian(
    x: float,
    y: float,
    z: float,
    depth: float,
    h: float,
    hx: float,
    hy: float,
    hxx: float,
    hxy: float,
    hyy: float,
    dx: float,
    dy: float,
    sxx: float,
    sxy: float,
    syy: float,
    law: object,
) -> tuple[*Vector3, *Matrix3Rows]:
    """Return force [N] and Jacobian [N/m], row by row, at a given contact of a probe."""
    raise NotImplementedError  # the linker binds calls to the generated function


# Parameters that every kernel receives, before those of the law.
SHARED_PARAMETERS = ("k", "h_mid", "h_half", "clamp_depth", "floor")
# Parameters of friction, after those of the law: see :attr:`asperity.laws.friction.Friction`.
FRICTION_PARAMETERS = (
    "friction_coefficient",
    "friction_modulation",
    "presliding_share",
    "presliding_fixed",
    "in_space",
)

_FORCE = ("fx", "fy", "fz")
_JACOBIAN = tuple(f"j{row}{column}" for row in range(3) for column in range(3))
_STATE = ("dx", "dy", "sxx", "sxy", "syy")


@dataclass(frozen=True)
class LawCode:
    """A law, its kernels and a clamp, from which its functions are generated.

    Attributes:
        law: the law.
        source: its kernels; see :func:`asperity.derive.generate.law_source`. With friction also
            the energy of the law.
        clamp: the depth clamp.
        has_friction: whether the surface has friction.
    """

    law: Law
    source: str
    clamp: Clamp
    has_friction: bool = False

    @cached_property
    def signatures(self) -> dict[str, tuple[str, ...]]:
        """The argument names of each of the law's functions."""
        return {
            node.name: tuple([argument.arg for argument in node.args.args])
            for node in parse_source(self.source).body
            if isinstance(node, ast.FunctionDef)
        }

    def call(self, function: str) -> str:
        """Return the call of one of the law's functions with its arguments."""
        return f"{function}({', '.join(self.signatures[function])})"

    def argument_names(self, *functions: str) -> frozenset[str]:
        """Return the names of all arguments of some of the law's functions."""
        return frozenset().union(*[self.signatures[function] for function in functions])

    @property
    def unpack_line(self) -> str:
        """The line that unpacks the parameters."""
        return f"{', '.join(parameter_names(self.law, self.has_friction))} = law"


def parameter_names(law: Law, has_friction: bool) -> tuple[str, ...]:
    """Return the names of the parameters in the functions of a probe."""
    friction = FRICTION_PARAMETERS if has_friction else ()
    return (*SHARED_PARAMETERS, *map(parameter_name, law.parameters), *friction)


def probe_source(code: LawCode) -> str:
    """Return the source of the functions of a probe."""
    parts = (_probe_force, _probe_jacobian, _probe_in_contact, _probe_depth, _probe_tick)
    texts = [part(code) for part in parts]
    if code.law.contact.has_warm_start:
        texts.append(_probe_force(code, warm=True))
    return "\n\n\n".join(texts)


def _function_source(signature: str, lines: Sequence[str]) -> str:
    return f"def {signature}:\n{textwrap.indent(chr(10).join(lines), ' ' * 4)}\n"


def _contact_prologue(
    code: LawCode, needed: frozenset[str], results: Sequence[str], warm: bool = False
) -> list[str]:
    """Return the lines that return zeros out of contact and sample the texture in contact."""
    contact = code.law.contact
    lines, condition = contact.detection_code(needed)
    exit_lines = [f"if not {condition}:", f"    return {', '.join(['0.0'] * len(results))}"]
    sample = contact.warm_start_code(needed) if warm else contact.sampling_code(needed)
    return [code.unpack_line, *lines, *exit_lines, *sample]


def _probe_force(code: LawCode, warm: bool = False) -> str:
    lines = _contact_prologue(code, code.argument_names("law_force"), _FORCE, warm)
    lines += [*code.clamp.force_code(code.call("law_force")), f"return {', '.join(_FORCE)}"]
    head = "probe_force_warm(x, y, z, dx, dy, warm_start" if warm else "probe_force(x, y, z, dx, dy"
    return _function_source(f"{head}, texture, law)", lines)


def _probe_jacobian(code: LawCode) -> str:
    every = (*_FORCE, *_JACOBIAN)
    called = ["law_jacobian"]
    if code.clamp.changes_force:
        called += ["law_force", "law_jacobian_saturated"]
    lines = _contact_prologue(code, code.argument_names(*called), every)
    lines += code.clamp.jacobian_code(*map(code.call, called))
    head = f"probe_jacobian(x, y, z, {', '.join(_STATE)}, texture, law)"
    return _function_source(head, [*lines, f"return {', '.join(every)}"])


def _probe_in_contact(code: LawCode) -> str:
    lines, condition = code.law.contact.detection_code(frozenset())
    return _function_source("probe_in_contact(x, y, z, texture)", [*lines, f"return {condition}"])


def _probe_depth(code: LawCode) -> str:
    return _function_source("probe_depth(x, y, z, texture)", code.law.contact.depth_code())


def _probe_tick(code: LawCode) -> str:
    if code.has_friction:
        return f"{_probe_slip(code)}\n\n{_FRICTION_TICK.format(unpack=code.unpack_line)}"
    lines = ["dx = dy = 0.0"]
    if code.law.stateful:
        lines = [code.unpack_line, *_STICK_SLIP.splitlines()]
    call = "probe_force(x, y, z, dx, dy, texture, law)"
    if code.law.contact.has_warm_start:
        call = "probe_force_warm(x, y, z, dx, dy, warm_start, texture, law)"
    lines += [f"fx, fy, fz = {call}", "return fx, fy, fz, ax, ay, az, held"]
    head = "probe_tick(x, y, z, ax, ay, az, held, warm_start, texture, law)"
    return _function_source(head, lines)


_STICK_SLIP = """dx = 0.0
dy = 0.0
if probe_in_contact(x, y, z, texture):
    ax, ay, dx, dy = drag_anchor(x, y, held, ax, ay, param_max_deflection)
    held = True
else:
    held = False
"""


def _probe_slip(code: LawCode) -> str:
    """Return ``probe_slip``: the force of the law [N], and the slip limit μ N (1 - m) [N].

    N = √(2 k U) follows from the contact that gives the force, without another search.
    """
    contact = code.law.contact
    needed = code.argument_names("law_force", "law_energy") | contact.height_names
    lines = _contact_prologue(code, needed, (*_FORCE, "limit"), warm=contact.has_warm_start)
    lines += code.clamp.energy_code(code.call("law_energy"))
    lines += code.clamp.force_code(code.call("law_force"))
    lines += _SLIP_LIMIT.format(height=contact.height_expression).splitlines()
    head = "probe_slip(x, y, z, warm_start, texture, law)"
    return _function_source(head, [*lines, f"return {', '.join(_FORCE)}, limit"])


_SLIP_LIMIT = """limit = friction_coefficient * math.sqrt(2.0 * k * energy)
if friction_modulation > 0.0:
    relative = min(max(({height} - h_mid) / h_half, -1.0), 1.0)
    limit *= 1.0 - 0.5 * friction_modulation * (1.0 + relative)
"""

_FRICTION_TICK = """def probe_tick(x, y, z, ax, ay, az, held, warm_start, texture, law):
    {unpack}
    presliding = presliding_share * k + presliding_fixed
    compliance = 1.0 / presliding  # a constant of the loop, which saves a division per tick
    fx, fy, fz, limit = probe_slip(x, y, z, warm_start, texture, law)
    dz = 0.0
    if in_space > 0.0:
        ax, ay, az, dx, dy, dz = drag_anchor_in_space(
            x, y, z, held, ax, ay, az, fx, fy, fz, limit * compliance
        )
    else:
        ax, ay, dx, dy = drag_anchor(x, y, held, ax, ay, limit * compliance)
    return fx - presliding * dx, fy - presliding * dy, fz - presliding * dz, ax, ay, az, True
"""


def energy_source(code: LawCode) -> str:
    """Return ``probe_energy``, the potential energy [J] of a conservative law.

    The source of the code is ``law_energy``, which returns the energy and its derivative by the
    depth.
    """
    lines = _contact_prologue(code, code.argument_names("law_energy"), ("energy",))
    lines += code.clamp.energy_code(code.call("law_energy"))
    return _function_source("probe_energy(x, y, z, texture, law)", [*lines, "return energy"])


def contact_source(code: LawCode) -> str:
    """Return ``contact_jacobian``, whose arguments are contact and height derivatives there."""
    arguments = ("x", "y", "z", "depth", "h", "hx", "hy", "hxx", "hxy", "hyy", *_STATE)
    lines = [code.unpack_line, f"return {code.call('law_jacobian')}"]
    return _function_source(f"contact_jacobian({', '.join(arguments)}, law)", lines)
