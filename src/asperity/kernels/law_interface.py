"""Interface between loops and a law: the functions that are generated for it on its contact.

:mod:`asperity.kernels.law_codegen` generates the functions and the linker binds the calls of the
loops to them. ``texture`` is the record of a texture kind, ``law`` the tuple
:attr:`asperity.surface.Surface.law_arguments`.
"""

from asperity.core.checks import FloatArray

Vector3 = tuple[float, float, float]
Matrix3Rows = tuple[float, float, float, float, float, float, float, float, float]


def probe_force(
    x: float, y: float, z: float, dx: float, dy: float, texture: object, law: object
) -> Vector3:
    """Return the force [N]; (dx, dy) is the deflection of the anchor [m] for a law with state."""
    raise NotImplementedError  # the linker binds calls to the generated function


def probe_force_warm(
    x: float, y: float, z: float, dx: float, dy: float, warm_start: FloatArray, texture: object,
    law: object,
) -> Vector3:  # fmt: skip
    """Return the force [N] of a law whose contact has a warm-started search."""
    raise NotImplementedError  # the linker binds calls to the generated function


def probe_jacobian(
    x: float, y: float, z: float, dx: float, dy: float, sxx: float, sxy: float, syy: float,
    texture: object, law: object,
) -> tuple[*Vector3, *Matrix3Rows]:  # fmt: skip
    """Return force [N] and Jacobian [N/m], row by row; s.. is the derivative of the deflection."""
    raise NotImplementedError  # the linker binds calls to the generated function


def probe_in_contact(x: float, y: float, z: float, texture: object) -> bool:
    """Return whether there is contact."""
    raise NotImplementedError  # the linker binds calls to the generated function


def probe_depth(x: float, y: float, z: float, texture: object) -> float:
    """Return the depth [m]; 0 out of contact."""
    raise NotImplementedError  # the linker binds calls to the generated function


def probe_tick(
    x: float, y: float, z: float, ax: float, ay: float, held: bool, warm_start: FloatArray,
    texture: object, law: object,
) -> tuple[float, float, float, float, float, bool]:  # fmt: skip
    """Return the force [N], the new anchor position [m] and whether the anchor is held.

    A law with state holds its anchor during contact; others leave it unchanged. A search stays
    within the budget of ``warm_start`` and updates it; see :mod:`asperity.contacts.warm_start`.
    """
    raise NotImplementedError  # the linker binds calls to the generated function


def contact_jacobian(
    x: float, y: float, z: float, depth: float,
    h: float, hx: float, hy: float, hxx: float, hxy: float, hyy: float,
    dx: float, dy: float, sxx: float, sxy: float, syy: float, law: object,
) -> tuple[*Vector3, *Matrix3Rows]:  # fmt: skip
    """Return force [N] and Jacobian [N/m], row by row, at a given contact of a probe."""
    raise NotImplementedError  # the linker binds calls to the generated function
