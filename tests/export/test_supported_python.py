"""The supported subset of Python has the same meaning in C; other constructs are refused."""

from __future__ import annotations

import ctypes
import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.helpers.c_programs import STRICT, run_command, tool

from asperity.export.c_language import FLOAT, INT, NotExportableError, ValueType
from asperity.export.program import LinkedSource, Program

SOURCE = '''
def whole(a, b):
    """Integers."""
    bits = (a >> 2) + ((a & 6) ^ (b | 1))
    return a // b * 1000 + a % b * 10 + bits + abs(a) + min(a, b) - max(b, 3)


def real(x, y):
    """Real numbers."""
    total = x // y + 2.0 * (x % y) + x**2 - y**-1 + x**5
    low, high = x, y
    low, high = high, low
    return total + max(low, high, 0.25) * min(x, 1) - -(-x) + math.copysign(low, -y)


def rounding(x, y):
    return float(math.floor(x) + 3 * math.ceil(y) + 7 * round(x) + 11 * int(y)) + float(x + y) * 2.0


def choice(x, y):
    inside = 0.0 <= x <= y
    if not inside and (x > y or y < -1.0 and x != y):
        value = 2
    elif inside or x == y:
        value = 3 if x > 0.5 else -1
    else:
        value = 5
    return value + (x < y) + inside


def pair(i, x):
    return (x, i * x, x - i), i


def loops(n, x):
    (a, b, c), last = pair(n, x)
    total = 0.0
    for i in range(n, -2, -1):
        if i == 3:
            continue
        for j in range(i):
            total += a * i - b * j
            if total > 1e6:
                break
    count = n
    while count > 0:
        count -= 2
        total -= c
    for n in range(n):
        total += n
    values = (x, a, b)
    for k in range(3):
        total += values[k] * (k + 1)
    return total + count + n + last + i


def arrays(n, x):
    work = local_array((3, 4))
    for i in range(3):
        for j in range(4):
            work[i, j] = x * i - j
    fill(work, n)
    half = 0.5 * x
    work[1, 0], work[2, 1] = shifted(half)
    total = 0.0
    for i in range(work.shape[0]):
        for j in range(work.size // 3):
            total = total * 1.25 + work[i, j]
    return total + work[-1, 0] + work.ndim


def fill(work, n):
    for i in range(3):
        work[i, n % 4] *= SCALE


def shifted(x):
    return x - 1.0, x + 3.0


SCALE = 2.5
'''
ARGUMENT_TYPES: dict[str, tuple[ValueType, ...]] = {
    "whole": (INT, INT),
    "real": (FLOAT, FLOAT),
    "rounding": (FLOAT, FLOAT),
    "choice": (FLOAT, FLOAT),
    "loops": (INT, FLOAT),
    "arrays": (INT, FLOAT),
}
HEAD = "#include <math.h>\n#include <stdint.h>\n#define T_INLINE static inline\n"


def to_c(source: str, **argument_types: tuple[ValueType, ...]) -> str:
    """Return functions as C code, each with a public wrapper."""
    program = Program(LinkedSource(source), "t", single=False)
    wrappers = []
    for name, types in argument_types.items():
        inner = program.function_name(name, types)
        result = program.c_type(program.infer_types(name, types).result_type)
        c_types = [program.c_type(kind) for kind in types]
        head = f"{result} show_{name}({c_types[0]} a, {c_types[1]} b)"
        wrappers.append(f"{head};\n{head}\n{{\n    return {inner}(a, b);\n}}\n")
    return "\n".join([HEAD, *program.types, *program.helpers, *program.functions, *wrappers])


@pytest.fixture(scope="module")
def evaluate(
    tmp_path_factory: pytest.TempPathFactory,
) -> Callable[[str, Any, Any], tuple[Any, Any]]:
    """Return a function: ``evaluate(name, a, b)`` gives the results of Python and C."""
    folder = tmp_path_factory.mktemp("subset")
    (folder / "m.c").write_text(to_c(SOURCE, **ARGUMENT_TYPES))
    run_command(
        tool("gcc"), *STRICT, "-O1", "-shared", "-fPIC", "m.c", "-o", "m.so", "-lm", cwd=folder
    )
    compiled_library = ctypes.CDLL(str(folder / "m.so"))
    from asperity.core.compiled import local_array

    python: dict[str, Any] = {"math": math, "local_array": local_array}
    exec(compile(SOURCE, "<meaning>", "exec"), python)

    def evaluate_both(name: str, a: Any, b: Any) -> tuple[Any, Any]:
        function = getattr(compiled_library, f"show_{name}")
        types = {INT: ctypes.c_int64, FLOAT: ctypes.c_double}
        function.argtypes = [types[kind] for kind in ARGUMENT_TYPES[name]]  # type: ignore[index]  # numbers
        real = name in {"real", "rounding", "loops", "arrays"}
        function.restype = ctypes.c_double if real else ctypes.c_int64
        return python[name](a, b), function(a, b)

    return evaluate_both


SMALL = st.integers(-40, 40)
REAL = st.floats(-9.0, 9.0).filter(lambda x: abs(x) > 1e-3)


@settings(max_examples=200, deadline=None)
@given(a=SMALL, b=SMALL.filter(bool), x=REAL, y=REAL)
def test_c_and_python_give_equal_results(
    evaluate: Callable[[str, Any, Any], tuple[Any, Any]], a: int, b: int, x: float, y: float
) -> None:
    for name, first, second in (("whole", a, b), ("choice", x, y), ("rounding", x, y)):
        python, c = evaluate(name, first, second)
        assert c == python, name
    for name, first, second in (("loops", abs(a) % 12, x), ("arrays", abs(a), x)):
        python, c = evaluate(name, first, second)
        assert c == python, name
    python, c = evaluate("real", x, y)  # Python computes powers with pow
    assert c == pytest.approx(python, rel=1e-13, abs=1e-11)


def test_halves_are_rounded_to_even(evaluate: Callable[[str, Any, Any], Any]) -> None:
    for x in (0.5, 1.5, 2.5, -0.5, -1.5, -2.0, 3.0):
        python, c = evaluate("rounding", x, x)
        assert c == python


REFUSED = {
    "uses Raise": "raise ValueError",
    "uses Try": "try:\n        x = 1.0\n    except ValueError:\n        x = 2.0",
    "uses List": "x = [1.0]",
    "uses JoinedStr": "x = f'{a}'",
    "uses a value that is not a number": "x = 'a'",
    "uses Lambda": "x = lambda: 1.0",
    "has a loop with 'else'": "for i in range(3):\n        x = 1.0\n    else:\n        x = 2.0",
    "loops over something other than range": "for i in (1, 2):\n        x = 1.0",
    "uses Slice": "w = local_array((3,))\n    x = w[0:2]",
    "takes a part of an array": "w = local_array((3, 3))\n    x = w[0]",
    "calls a function without an equivalent in C": "x = math.gamma(a)",
    "uses a name without an equivalent in C": "x = np.newaxis",
    "for values that are not booleans": "x = a or b",
    "for values of different types": "x = 1.0\n    x = (1.0, 2.0)",
    "before it has a value": "x = y",
    "has an index that is not an integer": "w = local_array((3,))\n    x = w[a]",
    "to a power that is not a literal": "x = 2 ** int(a)",
    "calls itself": "x = refused(a, b)",
    "without a constant shape": "w = local_array((int(a),))",
    "returns a work array": "w = local_array((3,))\n    return w",
    "unpacks 2 values into 3 names": "t = (1.0, 2.0)\n    x, y, z = t",
    "assigns a tuple to several targets": "(x, y) = z = (a, b)",
    "chains comparisons of": "x = 0.0 < math.sin(a) < 1.0",
    "on an evaluation order that C leaves open": "w = local_array((3,))\n    x = put(w, a) + w[0]",
    "has starred": "x = starred(1.0)",
    "compares by 'is' or 'in'": "x = a is b",
}


@pytest.mark.parametrize("words", REFUSED)
def test_unsupported_constructs_are_refused(words: str) -> None:
    source = f"def refused(a, b):\n    {REFUSED[words]}\n    return x\n"
    source += (
        "\n\ndef put(w, a):\n    w[0] = a\n    return a\n\n\ndef starred(*a):\n    return 1.0\n"
    )
    with pytest.raises(NotExportableError, match=words) as error:
        to_c(source, refused=(FLOAT, FLOAT))
    assert str(error.value).startswith("law cannot be exported: the function '")
