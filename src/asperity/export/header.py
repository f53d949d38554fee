"""One C header: comment, constants, data, functions."""

from __future__ import annotations

import hashlib
import math
import re
from collections.abc import Mapping

from asperity.export.expressions import real_literal
from asperity.export.functions import Functions, surface_functions
from asperity.surface import Surface

FARTHEST = 1000.0
"""Positions farther from the origin get no force [m]: an integer could not count the cells."""

_CONTRACT = """#if defined(__FAST_MATH__)
#error "compile without -ffast-math: the force would not be the one that was analysed"
#endif
/* One rounding for a product and a sum (FMA) would change the last bits. */
#if defined(__clang__)
#pragma STDC FP_CONTRACT OFF
#elif defined(__GNUC__)
#pragma GCC push_options
#pragma GCC optimize ("fp-contract=off")
#elif defined(_MSC_VER)
#pragma fp_contract (off)
#endif
"""

_INLINE = """/* Small functions: a call would cost more than they do. */
#if defined(__GNUC__) && defined(__OPTIMIZE__) && !defined(__OPTIMIZE_SIZE__)
#define @_INLINE static inline __attribute__((always_inline))
#else
#define @_INLINE static inline
#endif
"""

_CONTRACT_END = """#if defined(__clang__)
#pragma STDC FP_CONTRACT DEFAULT
#elif defined(__GNUC__)
#pragma GCC pop_options
#endif
"""

_STATE = """/* Carried from call to call: the anchor of friction. Other laws leave it alone. */
typedef struct @_state {
    real anchor[2]; /* [m] */
    int held;
} @_state;
"""

_PUBLIC = """/* Forget the anchor: before the first call, and when the loop was interrupted. */
LINK void @_reset(@_state *state)
{
    state->anchor[0] = 0;
    state->anchor[1] = 0;
    state->held = 0;
}

/* Write the force on the probe [N] at its position [m]; once in each tick of the loop. */
LINK void @_force(@_state *state, const real position[3], real force[3])
{
    const real x = position[0];
    const real y = position[1];
    const real z = position[2];
    HELD_TYPE now;
    if (!(ABS(x) <= FAR && ABS(y) <= FAR && ABS(z) <= FAR)) {
        force[0] = force[1] = force[2] = 0;
        @_reset(state);
        return;
    }
    now = HELD(x, y, z, state->anchor[0], state->anchor[1], state->held);
    force[0] = now.f0;
    force[1] = now.f1;
    force[2] = now.f2;
    state->anchor[0] = now.f3;
    state->anchor[1] = now.f4;
    state->held = now.f5;
}
"""


def header_text(
    surface: Surface, name: str, *, single: bool, said: str = "", q_upper: float = math.inf
) -> str:
    """Return the whole header of a surface.

    Args:
        surface: the surface.
        name: the prefix of all names.
        single: whether real numbers are of single precision.
        said: comment on top, plain text.
        q_upper: upper bound of the characteristic number.
    """
    functions = surface_functions(surface, name, single=single)
    return assembled(surface, name, functions, said, q_upper)


def filled(template: str, name: str, words: Mapping[str, str]) -> str:
    """Return a template with a name for ``@`` and texts for whole words."""
    for word, text in words.items():
        template = re.sub(rf"\b{word}\b", text, template)
    return template.replace("@", name)


def assembled(surface: Surface, name: str, functions: Functions, said: str, q_upper: float) -> str:
    """Return the header from its parts."""
    store = functions.store
    arrays, records = store.used(functions.code)
    data = [f"static {store.array(place)}" for place in arrays]
    words = {
        "LINK": "static inline",
        "HELD_TYPE": functions.held_type,
        "HELD": functions.held,
        "ABS": "fabsf" if store.single else "fabs",
        "FAR": real_literal(FARTHEST, store.single),
        "real": "float" if store.single else "double",
    }
    state, public = filled(_STATE, name, words), filled(_PUBLIC, name, words)
    body = "\n".join([state, *data, *records, functions.code, public])
    content = hashlib.sha256(re.sub(rf"\b{name}_", "@_", body).encode()).hexdigest()
    guard = f"{name.upper()}_H"
    constants = {
        "STIFFNESS": repr(surface.stiffness),
        "MAX_DEPTH": repr(surface.max_depth),
        "Q_UPPER": repr(q_upper) if math.isfinite(q_upper) else "HUGE_VAL",
        "CONTENT": f'"{content}"',
    }
    lines = [f"#define {name.upper()}_{key} {value}" for key, value in constants.items()]
    return "\n".join(
        [
            said + f"#ifndef {guard}\n#define {guard}\n\n#include <math.h>\n#include <stdint.h>\n",
            _CONTRACT,
            "\n".join(lines) + "\n",
            _INLINE.replace("@", name.upper()),
            body,
            _CONTRACT_END,
            f"#endif /* {guard} */\n",
        ]
    )
