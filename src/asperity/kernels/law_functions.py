"""What loops ask of a law: the functions that are written for it on its contact.

These are the interface alone; :mod:`asperity.kernels.probe` writes the functions and the linker
binds the calls of the loops to them. ``texture`` is the record of a texture kind, ``law`` what
:attr:`asperity.surface.Surface.law_arguments` says.
"""

from asperity.checks import FloatArray

Triple = tuple[float, float, float]
Nine = tuple[float, float, float, float, float, float, float, float, float]


def probe_force(
    x: float, y: float, z: float, dx: float, dy: float, texture: object, law: object
) -> Triple:
    """Return the force [N]; (dx, dy) is the deflection of the anchor [m] of a law with state."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def probe_again(
    x: float, y: float, z: float, dx: float, dy: float, memory: FloatArray, texture: object,
    law: object,
) -> Triple:  # fmt: skip
    """Return the same of a law whose contact remembers, from what the last tick left."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def probe_jacobian(
    x: float, y: float, z: float, dx: float, dy: float, sxx: float, sxy: float, syy: float,
    texture: object, law: object,
) -> tuple[*Triple, *Nine]:  # fmt: skip
    """Return force [N] and Jacobian [N/m], row by row; s is the derivative of the deflection."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def probe_inside(x: float, y: float, z: float, texture: object) -> bool:
    """Return whether there is contact."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def probe_depth(x: float, y: float, z: float, texture: object) -> float:
    """Return the depth [m]; 0 out of contact."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def probe_held(
    x: float, y: float, z: float, ax: float, ay: float, held: bool, texture: object, law: object
) -> tuple[float, float, float, float, float, bool]:
    """Return the force [N] with the law's anchor carried on: where it is [m], whether held.

    A law with state holds its anchor while there is contact; others leave it as it is.
    """
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def probe_tick(
    x: float, y: float, z: float, ax: float, ay: float, held: bool, memory: FloatArray,
    texture: object, law: object,
) -> tuple[float, float, float, float, float, bool]:  # fmt: skip
    """Return the same within the budget of ``memory``, what the contact remembers.

    See :mod:`asperity.contacts.memory`; out of contact it stays as it is.
    """
    raise NotImplementedError  # the interface alone; the linker binds calls of it


def contact_jacobian(
    x: float, y: float, z: float, depth: float,
    h: float, hx: float, hy: float, hxx: float, hxy: float, hyy: float,
    dx: float, dy: float, sxx: float, sxy: float, syy: float, law: object,
) -> tuple[*Triple, *Nine]:  # fmt: skip
    """Return force [N] and Jacobian [N/m], row by row, at a given contact of a probe."""
    raise NotImplementedError  # the interface alone; the linker binds calls of it
