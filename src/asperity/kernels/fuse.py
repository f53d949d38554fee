"""Compiled modules: law, texture sampler and loops fused into one source file, then cached.

A fused file lies in the user's cache directory (``ASPERITY_CACHE_DIR`` overrides it), named after
its content, and Numba keeps the machine code beside it: a second process compiles nothing.
"""

from __future__ import annotations

import ast
import hashlib
import importlib.util
import inspect
import os
import sys
import tempfile
from functools import lru_cache
from pathlib import Path
from types import ModuleType

from asperity.derive.shipped import generated_path
from asperity.errors import ParameterError
from asperity.files import write_text
from asperity.kernels.driver import ClampName, DriverPlan, contact_source, driver_source
from asperity.laws import LAWS, Law

_HEADER = '''"""{title}

Fused by asperity; may be deleted at any time.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

# Nothing allocates, so nothing is counted: counting references to the arrays of a texture at every
# call costs more than the arithmetic. Only the loops are called from Python; the others need no
# wrapper, a fifth of the compile time.
plain = dict(error_model="numpy", _nrt=False)
internal = dict(**plain, no_cpython_wrapper=True, no_cfunc_wrapper=True)
scalar = njit(**internal)
inlined = njit(**internal, forceinline=True)
loop = njit(**plain, cache=True, nogil=True)


'''


# Law H iterates on small arrays; on the stack they cost no allocation.
_SPLIT_HEADER = """from asperity.kernels.stack_memory import local_array

merged = njit(error_model="numpy", inline="always")


"""


@lru_cache(maxsize=256)
def kernel_source(law: Law) -> str:
    """Return the kernels of a law: the shipped file, or derived now for a user's own law."""
    if LAWS.get(law.letter) is law:
        return _functions(generated_path(law).read_text(encoding="utf-8"))
    from asperity.derive.python_source import law_source

    return law_source(law)


@lru_cache(maxsize=256)
def fuse_surface(
    law: Law, sampler: tuple[ModuleType, ...], clamp: ClampName, further: str = ""
) -> ModuleType:
    """Return the compiled loops of a law on a texture kind.

    Args:
        law: the law.
        sampler: the modules whose functions make up the sampler.
        clamp: the depth clamp.
        further: source of more functions, which may call those of the law.

    Returns:
        A module with ``force_batch``, ``jacobian_batch``, ``trace_batch`` if the law has state.
    """
    plan = DriverPlan(law, kernel_source(law), clamp)
    title = f"Law {law.letter} on {sampler[0].__name__.rpartition('.')[2]}, clamp {clamp}."
    driver = driver_source(plan)
    _require(law, sampler_source(sampler), driver)
    source = "\n\n".join([sampler_source(sampler), plan.source, driver, further])
    iterative = any(module.__name__.endswith(".solver") for module in sampler)
    header = _HEADER.format(title=title) + (_SPLIT_HEADER if iterative else "")
    return load_fused(header + decorate(source, inline=not iterative))


_OFFERED = {
    "height": "heights",
    "slope": "slopes",
    "curvature": "second derivatives",
    "nearest": "nearest points",
}


def _require(law: Law, sampler: str, driver: str) -> None:
    """Refuse a texture that lacks what a law looks at."""
    for name, words in _OFFERED.items():
        if f" {name}(" in driver and f"def {name}(" not in sampler:
            need = f"must offer {words} (a sampler function {name!r}), which law {law} needs"
            raise ParameterError("texture", need)


@lru_cache(maxsize=256)
def fuse_contact(law: Law) -> ModuleType:
    """Return the compiled loop of a law over given contacts: ``contact_batch``."""
    plan = DriverPlan(law, kernel_source(law), "none")
    source = "\n\n".join([plan.source, contact_source(plan)])
    return load_fused(_HEADER.format(title=f"Law {law.letter} at contacts.") + decorate(source))


@lru_cache(maxsize=16)
def fuse_module(*modules: ModuleType, inline: bool = True) -> ModuleType:
    """Return modules of plain functions compiled; those named ``..._batch`` are for Python."""
    title = f"{modules[0].__name__.rpartition('.')[2]}."
    source = sampler_source(modules)
    return load_fused(_HEADER.format(title=title) + decorate(source, inline=inline))


@lru_cache(maxsize=64)
def fuse_sampler(sampler: tuple[ModuleType, ...]) -> ModuleType:
    """Return the compiled loops of a texture kind.

    Functions ``height_batch``, ``slope_batch``, ``curvature_batch`` (points (n, 2), result array)
    and ``nearest_batch`` (points (n, 3), result (n, 2)).
    """
    title = f"Texture {sampler[0].__name__.rpartition('.')[2]}."
    source = "\n\n".join([sampler_source(sampler), _SAMPLER_LOOPS])
    return load_fused(_HEADER.format(title=title) + decorate(source))


_SAMPLER_LOOPS = '''def height_batch(points, out, texture):
    """Heights [m]."""
    for i in range(points.shape[0]):
        out[i, 0] = height(points[i, 0], points[i, 1], texture)


def slope_batch(points, out, texture):
    """Heights [m] and slopes."""
    for i in range(points.shape[0]):
        out[i, 0], out[i, 1], out[i, 2] = slope(points[i, 0], points[i, 1], texture)


def curvature_batch(points, out, texture):
    """Heights [m], slopes and second derivatives [1/m]."""
    for i in range(points.shape[0]):
        h, hx, hy, hxx, hxy, hyy = curvature(points[i, 0], points[i, 1], texture)
        out[i, 0] = h
        out[i, 1] = hx
        out[i, 2] = hy
        out[i, 3] = hxx
        out[i, 4] = hxy
        out[i, 5] = hyy


def nearest_batch(points, out, texture):
    """Nearest surface points [m]."""
    for i in range(points.shape[0]):
        out[i, 0], out[i, 1] = nearest(points[i, 0], points[i, 1], points[i, 2], texture)
'''


@lru_cache(maxsize=64)
def sampler_source(modules: tuple[ModuleType, ...]) -> str:
    """Return the functions of the modules as one text; of equal names the first one counts."""
    seen: set[str] = set()
    parts = []
    for module in modules:
        text = inspect.getsource(module)
        for node in ast.parse(text).body:
            if isinstance(node, ast.FunctionDef) and node.name not in seen:
                seen.add(node.name)
                parts.append(ast.get_source_segment(text, node) or "")
    return "\n\n\n".join(parts)


def _functions(text: str) -> str:
    """Return a generated file from its first function on."""
    return text[text.index("def ") :]


def decorate(source: str, *, inline: bool = True) -> str:
    """Return the source with every top-level function compiled by Numba.

    Args:
        source: plain functions.
        inline: whether small functions are copied into their callers. LLVM leaves calls of
            mid-sized ones, 20 to 40 ns each; long iterations would only compile more slowly.
    """
    lines = []
    for line in source.splitlines():
        if line.startswith("def "):
            name = line[4 : line.index("(")]
            lines.append(_decorator(name, inline))
        lines.append(line)
    return "\n".join(lines) + "\n"


# Too large to be copied to every place that calls them.
_CALLED = {
    "foot",
    "search_tile",
    "search_tree",
    "judge",
    "descend",
    "newton_step",
}


# LLVM optimises everything again at each level of calls: a chain of single calls is made one
# function before it compiles, which nearly halves the time.
_MERGED = {
    "probe_force",
    "probe_jacobian",
    "law_force",
    "law_jacobian",
    "split_contact",
    "split_derivative",
    "split_energy",
    "split_polish",
    "split_try_polish",
}


def _decorator(name: str, inline: bool) -> str:
    if name.endswith("_batch"):
        return "@loop"
    if name in _MERGED and not inline:
        return "@merged"
    return "@scalar" if name in _CALLED or not inline else "@inlined"


@lru_cache(maxsize=1)
def cache_directory() -> Path:
    """Return the directory of the fused modules, made if need be.

    ``ASPERITY_CACHE_DIR`` if set, else the user's cache directory; a temporary one for this
    process if neither can be written.
    """
    from platformdirs import user_cache_path

    chosen = os.environ.get("ASPERITY_CACHE_DIR")
    directory = Path(chosen) if chosen else user_cache_path("asperity")
    try:
        (directory / "kernels").mkdir(parents=True, exist_ok=True)
        if os.access(directory / "kernels", os.W_OK):
            return directory / "kernels"
    except OSError:
        pass
    return Path(tempfile.mkdtemp(prefix="asperity-kernels-"))


@lru_cache(maxsize=256)
def load_fused(source: str) -> ModuleType:
    """Write a fused module where it is missing, and import it."""
    digest = hashlib.sha256(source.encode()).hexdigest()[:20]
    name = f"asperity_fused_{digest}"
    path = cache_directory() / f"{name}.py"
    if not path.exists() or path.read_text(encoding="utf-8") != source:
        write_text(path, source)
    spec = importlib.util.spec_from_file_location(name, path)
    assert spec is not None
    assert spec.loader is not None
    module = importlib.util.module_from_spec(spec)
    sys.modules[name] = module
    spec.loader.exec_module(module)
    return module
