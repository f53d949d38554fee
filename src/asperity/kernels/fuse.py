"""Compiled modules: law, texture sampler and loops fused into one source, then compiled.

A fused module is built in memory and named after its content. The machine code of its loops is
cached (see :mod:`asperity.kernels.numba_internals`), so a second process compiles nothing. Large
functions that many loops call, such as the search for a closest point, are modules of their own,
compiled once for all laws on a texture kind.
"""

from __future__ import annotations

import hashlib
import linecache
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cache, lru_cache, partial
from threading import Lock
from types import ModuleType

from asperity.contacts.sampler_interface import SAMPLER_FUNCTIONS
from asperity.core.errors import ParameterError
from asperity.core.processes import defer_interrupt
from asperity.derive.facts import generated_kernel_path, law_facts
from asperity.kernels.link import (
    INTRINSIC_MODULES,
    MissingFunctionError,
    SourceUnit,
    generated_unit,
    link,
    link_modules,
    loops_of,
    unit_from_module,
)
from asperity.kernels.probe_functions import LawCode, contact_source, probe_source
from asperity.laws import LAWS, Law
from asperity.laws.clamps import NONE, Clamp

Modules = tuple[ModuleType, ...]
# Functions to link, each with the unit that defines it.
Roots = Sequence[tuple[str, SourceUnit]]

_HEADER = '''"""{title}

Fused by asperity.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from asperity.kernels.numba_internals import cache_machine_code
from asperity.kernels.numba_internals import LinkOnlyCompiler, LoopCompiler, SharedCompiler

# Nothing allocates, so reference counting is off: counting references to the arrays of a texture at
# every call costs more than the arithmetic. Only the loops are called from Python; the others need
# no wrapper, which saves a fifth of the compile time.
plain = dict(error_model="numpy", _nrt=False)
internal = dict(**plain, no_cpython_wrapper=True, no_cfunc_wrapper=True)
scalar = njit(**internal, pipeline_class=LinkOnlyCompiler)
inlined = njit(**internal, forceinline=True, pipeline_class=LinkOnlyCompiler)
loop = cache_machine_code(njit(**plain, nogil=True, pipeline_class=LoopCompiler))
shared = cache_machine_code(njit(**internal, pipeline_class=SharedCompiler))


'''


@lru_cache(maxsize=256)
def kernel_source(law: Law) -> str:
    """Return the kernels of a law: the shipped file, or derived now for a user-defined law."""
    if LAWS.get(law.letter) is law:
        return _shipped_source(law)[0]
    from asperity.derive.generate import law_source

    return law_source(law)


@lru_cache(maxsize=256)
def energy_kernel_source(law: Law) -> str:
    """Return ``law_energy`` of a law: U [J], and its derivative by the depth [N].

    Empty for a law without a potential in closed form.
    """
    if LAWS.get(law.letter) is law:
        return _shipped_source(law)[1]
    from asperity.derive.generate import law_energy_source

    return law_energy_source(law)


def _shipped_source(law: Law) -> tuple[str, str]:
    """Return the kernels of a shipped law, and its energy."""
    text = generated_kernel_path(law).read_text(encoding="utf-8")
    kernels, mark, energy = text[text.index("def ") :].partition("\n\ndef law_energy")
    return kernels, mark.strip() + energy


@lru_cache(maxsize=256)
def law_units(law: Law, clamp: Clamp, has_friction: bool = False) -> tuple[SourceUnit, ...]:
    """Return the functions of a law, those of a probe on it, and those that its loops may call."""
    from asperity.kernels import loop_functions

    source = kernel_source(law)
    if has_friction:
        source = f"{source}\n\n{energy_kernel_source(law)}"
    code = LawCode(law, source, clamp, has_friction)
    title = f"law {law}"
    probe = f"law {law} at a probe"
    return (
        generated_unit(title, code.source),
        generated_unit(probe, probe_source(code)),
        unit_from_module(loop_functions),
    )


@lru_cache(maxsize=256)
def fuse_surface(law: Law, sampler: Modules, clamp: Clamp) -> ModuleType:
    """Return the compiled loops over points of a law on a texture kind.

    Args:
        law: the law.
        sampler: the modules of the sampler.
        clamp: the depth clamp.

    Returns:
        A module with ``force_batch``, ``jacobian_batch`` and the loops of the law's contact.

    Raises:
        ParameterError: for a texture that lacks a function that the law requires.
    """
    from asperity.kernels import batch_sine, block_loops, point_loops, stateful_loops

    blocks = [module for module in sampler if unit_from_module(module).kernels.for_blocks]
    if blocks and _samples_only_at_probe(law):
        return fuse_on_texture(law, sampler, clamp, (block_loops,), (batch_sine, *blocks))
    loops: ModuleType = point_loops
    if law.stateful:
        loops = stateful_loops
    modules = (loops, *law.contact.kernels())
    return fuse_on_texture(law, sampler, clamp, modules, (batch_sine,))


def _samples_only_at_probe(law: Law) -> bool:
    """Return whether a law samples the texture above or below the probe only.

    Then a block of points can be sampled before the law is evaluated.
    """
    contact = law.contact
    samples = contact.begins_on_texture or law_facts(law).depends_on_surface
    return samples and contact.is_above_probe and not (law.stateful or contact.kernels())


@lru_cache(maxsize=256)
def fuse_path(law: Law, sampler: Modules, clamp: Clamp, has_friction: bool = False) -> ModuleType:
    """Return the compiled loop of a law along a path, ``path_batch``; see :func:`fuse_surface`."""
    from asperity.kernels import batch_sine, path_loop

    overrides = () if law.contact.has_warm_start else (batch_sine,)
    return fuse_on_texture(law, sampler, clamp, (path_loop,), overrides, has_friction)


@lru_cache(maxsize=256)
def fuse_on_texture(
    law: Law,
    sampler: Modules,
    clamp: Clamp,
    modules: Modules,
    overrides: Modules = (),
    has_friction: bool = False,
) -> ModuleType:
    """Return the compiled module of :func:`source_on_texture`."""
    return load_fused(source_on_texture(law, sampler, clamp, modules, overrides, has_friction))


def source_on_texture(
    law: Law,
    sampler: Modules,
    clamp: Clamp,
    modules: Modules,
    overrides: Modules = (),
    has_friction: bool = False,
) -> str:
    """Return the source of a module of loops that call a sampler, a law and further modules.

    Another process can load it with :func:`load_fused`.

    Args:
        law: the law.
        sampler: the modules of the sampler.
        clamp: the depth clamp.
        modules: modules with the loops and with functions that these call.
        overrides: modules whose functions replace those of the same name elsewhere.
        has_friction: whether the surface has friction.

    Raises:
        ParameterError: for a texture that lacks a function that the law requires.
    """
    units = [unit_from_module(module) for module in modules]
    extra = [*units, *map(unit_from_module, law.contact.kernels())]
    first = [unit_from_module(module) for module in overrides]
    available = _available_units(law, sampler, clamp, extra, first, has_friction=has_friction)
    with _texture_error_context(law, sampler):
        return _assemble(f"Law {law} on {sampler[0].__name__}.", loops_of(*units), available)


def link_on_texture(
    law: Law,
    sampler: Modules,
    clamp: Clamp,
    roots: Roots,
    extra: Sequence[SourceUnit],
    has_friction: bool = False,
) -> str:
    """Return the source of functions, each given with its unit, and of all functions they call.

    They may call a sampler, a law and further units.

    Raises:
        ParameterError: for a texture that lacks a function that the law requires.
    """
    with _texture_error_context(law, sampler):
        units = _available_units(law, sampler, clamp, extra, has_friction=has_friction)
        return link(roots, units)


def _available_units(
    law: Law,
    sampler: Modules,
    clamp: Clamp,
    extra: Sequence[SourceUnit],
    overrides: Sequence[SourceUnit] = (),
    *,
    has_friction: bool,
) -> tuple[SourceUnit, ...]:
    modules = map(unit_from_module, sampler)
    units = law_units(law, clamp, has_friction)
    return tuple(dict.fromkeys((*overrides, *modules, *units, *extra)))


@contextmanager
def _texture_error_context(law: Law, sampler: Modules) -> Iterator[None]:
    """Turn the error of a missing sampler function into one that names texture and law."""
    try:
        yield
    except MissingFunctionError as missing:
        requirement = f"required by law {law} on the {law.contact} contact"
        raise _missing_function_error(missing, sampler, requirement) from None


def _missing_function_error(
    missing: MissingFunctionError, sampler: Modules, requirement: str
) -> ParameterError:
    provided = {name for m in sampler for name in unit_from_module(m).kernels.provides}
    names = ", ".join(sorted(provided & SAMPLER_FUNCTIONS.keys())) or "nothing"
    meaning = SAMPLER_FUNCTIONS.get(missing.name, "no standard function")
    lack = f"lacks the sampler function {missing.name!r} ({meaning}), {requirement}"
    return ParameterError("texture", f"{lack}; {sampler[0].__name__} provides {names}")


@lru_cache(maxsize=256)
def fuse_contact(law: Law) -> ModuleType:
    """Return the compiled loop of a law over given contacts, ``contact_batch``."""
    from asperity.kernels import contact_loop

    loop = unit_from_module(contact_loop)
    code = LawCode(law, kernel_source(law), NONE)
    contact = generated_unit(f"law {law} at a contact", contact_source(code))
    available = (loop, contact, *law_units(law, NONE))
    return load_fused(_assemble(f"Law {law} at contacts.", loops_of(loop), available))


@lru_cache(maxsize=256)
def uses_position(law: Law) -> bool:
    """Return whether the Jacobian of a law depends on the position of the probe."""
    arguments = LawCode(law, kernel_source(law), NONE).argument_names("law_jacobian")
    return not arguments.isdisjoint(("x", "y", "z"))


@lru_cache(maxsize=16)
def fuse_module(module: ModuleType, *helpers: ModuleType) -> ModuleType:
    """Return a module with its loops compiled, and the functions that they call in helpers."""
    return load_fused(module_source(module, *helpers))


def module_source(module: ModuleType, *helpers: ModuleType) -> str:
    """Return the source of such a module, which another process can load."""
    unit = unit_from_module(module)
    available = (unit, *map(unit_from_module, helpers))
    return _assemble(f"{module.__name__}.", loops_of(unit), available)


@lru_cache(maxsize=64)
def fuse_sampler(sampler: Modules, *further: ModuleType) -> ModuleType:
    """Return the compiled loops of a texture kind.

    Functions ``height_batch``, ``slope_batch``, ``curvature_batch`` (points (n, 2), result array)
    and ``nearest_batch`` (points (n, 3), result (n, 2)), and the loops of further modules. A loop
    that calls a function that the sampler lacks raises a ParameterError when it is called.
    """
    from asperity.kernels import batch_sine, sampler_loops

    units = tuple(map(unit_from_module, (sampler_loops, *further)))
    available = (unit_from_module(batch_sine), *map(unit_from_module, sampler), *units)
    complete = []
    errors = {}
    for loop in loops_of(*units):
        try:
            link([loop], available)
            complete.append(loop)
        except MissingFunctionError as missing:
            errors[loop[0]] = _missing_function_error(missing, sampler, "required by this call")
    module = load_fused(_assemble(f"Texture {sampler[0].__name__}.", complete, available))
    vars(module).update({name: partial(_raise_error, error) for name, error in errors.items()})
    return module


def _raise_error(error: ParameterError, *_arguments: object) -> None:
    raise error


_MODULE_SEPARATOR = "\n# --- the next module ---\n"


def _assemble(title: str, loops: Roots, available: Sequence[SourceUnit]) -> str:
    """Return the sources of modules: those of shared functions, then that of the loops."""
    texts: list[str] = []
    homes: dict[str, str] = {}
    for part in link_modules(loops, available):
        imports = "".join([f"from {homes[name]} import {name}\n" for name in part.imports])
        texts.append(_module_header(part.title or title, part.source) + imports + part.source)
        homes[part.name] = _module_name(texts[-1])
    return _MODULE_SEPARATOR.join(texts)


def _module_header(title: str, source: str) -> str:
    used = [
        f"from {home} import {name}\n"
        for name, home in INTRINSIC_MODULES.items()
        if f"{name}(" in source
    ]
    if used:
        used.append("\n")
    return _HEADER.format(title=title) + "".join(used)


def _module_name(text: str) -> str:
    """Return the name of a module, a hash of its source and so of the modules that it imports."""
    return f"asperity_fused_{hashlib.sha256(text.encode()).hexdigest()[:32]}"


_LOAD_LOCK = Lock()


def load_fused(source: str) -> ModuleType:
    """Return the fused module of a source; all threads get the same module.

    The machine code of its loops, and of the shared functions that they call, is cached.
    """
    with defer_interrupt(), _LOAD_LOCK:
        return [_load_module(text) for text in source.split(_MODULE_SEPARATOR)][-1]


@cache
def _load_module(text: str) -> ModuleType:
    from asperity.kernels.numba_internals import share_identical_functions  # it imports Numba

    module = ModuleType(_module_name(text))
    module.__file__ = f"<{module.__name__}>"
    # For tracebacks, and for reading what was compiled.
    linecache.cache[module.__file__] = (len(text), None, text.splitlines(True), module.__file__)
    sys.modules[module.__name__] = module  # cached code refers to its module by name
    exec(compile(text, module.__file__, "exec"), vars(module))
    share_identical_functions(module)
    return module
