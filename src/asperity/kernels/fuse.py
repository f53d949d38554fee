"""Compiled modules: law, texture sampler and loops fused into one source, then compiled.

A fused module is made in memory and named after its content; the machine code of its loops is kept
in the cache, :mod:`asperity.kernels.code_store`: a second process compiles nothing. So is the code
of large functions that many loops call, such as the search for a nearest point: each is a module of
its own, compiled once for all laws on a kind of texture.
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

from asperity.contacts.sampler import OFFERED
from asperity.derive.facts import law_facts
from asperity.derive.shipped import generated_path
from asperity.errors import ParameterError
from asperity.kernels.link import (
    COMMON,
    MissingFunctionError,
    Unit,
    link,
    link_parts,
    loops_of,
    module_unit,
    written_unit,
)
from asperity.kernels.probe import ClampName, ProbePlan, contact_source, probe_source
from asperity.laws import LAWS, Law

_HEADER = '''"""{title}

Fused by asperity.
"""

from __future__ import annotations

import math

import numpy as np
from numba import njit

from asperity.kernels.code_store import keep_code
from asperity.kernels.ingredients import IngredientCompiler, LoopCompiler

# Nothing allocates, so nothing is counted: counting references to the arrays of a texture at every
# call costs more than the arithmetic. Only the loops are called from Python; the others need no
# wrapper, a fifth of the compile time.
plain = dict(error_model="numpy", _nrt=False)
internal = dict(**plain, no_cpython_wrapper=True, no_cfunc_wrapper=True)
scalar = njit(**internal, pipeline_class=IngredientCompiler)
inlined = njit(**internal, forceinline=True, pipeline_class=IngredientCompiler)
merged = njit(error_model="numpy", inline="always")
loop = keep_code(njit(**plain, nogil=True, pipeline_class=LoopCompiler))
shared = keep_code(njit(**internal, pipeline_class=LoopCompiler))


'''


@lru_cache(maxsize=256)
def kernel_source(law: Law) -> str:
    """Return the kernels of a law: the shipped file, or derived now for a user's own law."""
    if LAWS.get(law.letter) is law:
        text = generated_path(law).read_text(encoding="utf-8")
        return text[text.index("def ") :]
    from asperity.derive.python_source import law_source

    return law_source(law)


@lru_cache(maxsize=256)
def law_units(law: Law, clamp: ClampName) -> tuple[Unit, ...]:
    """Return the functions of a law, those of a probe point, and those that its loops may call."""
    from asperity.kernels import anchor, storing

    plan = ProbePlan(law, kernel_source(law), clamp)
    return (
        written_unit(f"law {law}", plan.source, merged=("law_force", "law_jacobian")),
        written_unit(
            f"law {law} at a probe", probe_source(plan), merged=("probe_force", "probe_jacobian")
        ),
        module_unit(anchor),
        module_unit(storing),
    )


@lru_cache(maxsize=256)
def fuse_surface(law: Law, sampler: tuple[ModuleType, ...], clamp: ClampName) -> ModuleType:
    """Return the compiled loops of a law on a texture kind.

    Args:
        law: the law.
        sampler: the modules whose functions make up the sampler.
        clamp: the depth clamp.

    Returns:
        A module with ``force_batch``, ``jacobian_batch``, ``trace_batch`` if the law has state, and
        the loops that its contact brings.

    Raises:
        ParameterError: for a texture that lacks what the law looks at.
    """
    from asperity.kernels import anchored_loops, batch_sine, block_loops, probe_loops

    blocks = tuple(m for m in sampler if module_unit(m).kernels.in_blocks)
    if blocks and _samples_at_probe(law):
        return fuse_on_texture(law, sampler, clamp, (block_loops,), instead=(batch_sine, *blocks))
    loops = anchored_loops if law.stateful else probe_loops
    asking = (loops, *law.contact.kernels())
    return fuse_on_texture(law, sampler, clamp, asking, instead=(batch_sine,))


def _samples_at_probe(law: Law) -> bool:
    """Return whether a law asks the texture for what it is above or below the probe, and no more.

    Then points can be sampled before the law is asked.
    """
    contact = law.contact
    asks = contact.begins_on_texture or law_facts(law).looks_at_surface
    return asks and contact.above_probe and not (law.stateful or contact.kernels())


@lru_cache(maxsize=256)
def fuse_path(law: Law, sampler: tuple[ModuleType, ...], clamp: ClampName) -> ModuleType:
    """Return the compiled loop of a law along a path, ``path_batch``; as :func:`fuse_surface`."""
    from asperity.kernels import path_loops

    return fuse_on_texture(law, sampler, clamp, (path_loops,))


def fuse_on_texture(
    law: Law,
    sampler: tuple[ModuleType, ...],
    clamp: ClampName,
    asking: tuple[ModuleType, ...],
    further: tuple[ModuleType, ...] = (),
    instead: tuple[ModuleType, ...] = (),
) -> ModuleType:
    """Return the module that :func:`source_on_texture` writes, compiled.

    Raises:
        ParameterError: for a texture that lacks what is asked of it.
    """
    return load_fused(source_on_texture(law, sampler, clamp, asking, further, instead))


def source_on_texture(
    law: Law,
    sampler: tuple[ModuleType, ...],
    clamp: ClampName,
    asking: tuple[ModuleType, ...],
    further: tuple[ModuleType, ...] = (),
    instead: tuple[ModuleType, ...] = (),
) -> str:
    """Return the text of a module of loops that ask a sampler, a law and further modules.

    Another process can load it, see :func:`load_fused`.

    Args:
        law: the law.
        sampler: the modules whose functions make up the sampler.
        clamp: the depth clamp.
        asking: the modules with the loops.
        further: what they ask besides.
        instead: modules whose functions are taken instead of those of that name elsewhere.

    Raises:
        ParameterError: for a texture that lacks what is asked of it.
    """
    units = tuple(map(module_unit, asking))
    brought = (*units, *map(module_unit, (*law.contact.kernels(), *further)))
    first = tuple(map(module_unit, instead))
    at_hand = _at_hand(law, sampler, clamp, brought, first)
    title = f"Law {law} on {sampler[0].__name__}."
    with _naming(law, sampler):
        return _assembled(title, loops_of(*units), at_hand)


def link_on_texture(
    law: Law,
    sampler: tuple[ModuleType, ...],
    clamp: ClampName,
    roots: Sequence[tuple[str, Unit]],
    further: Sequence[Unit],
    instead: Sequence[Unit] = (),
) -> str:
    """Return the text of functions, each named with its unit, and of all that they call.

    They may ask a sampler, a law and further units; ``instead`` come before all of them.

    Raises:
        ParameterError: for a texture that lacks what is asked of it.
    """
    with _naming(law, sampler):
        return link(roots, _at_hand(law, sampler, clamp, further, instead))


def _at_hand(
    law: Law,
    sampler: tuple[ModuleType, ...],
    clamp: ClampName,
    further: Sequence[Unit],
    instead: Sequence[Unit],
) -> tuple[Unit, ...]:
    modules = map(module_unit, sampler)
    return tuple(dict.fromkeys((*instead, *modules, *law_units(law, clamp), *further)))


@contextmanager
def _naming(law: Law, sampler: tuple[ModuleType, ...]) -> Iterator[None]:
    """Say of a texture that lacks a function which it is and who needs it."""
    try:
        yield
    except MissingFunctionError as missing:
        who = f"which law {law} on the {law.contact} contact needs"
        raise _lacking(missing, tuple(map(module_unit, sampler)), who) from None


def _lacking(missing: MissingFunctionError, modules: Sequence[Unit], who: str) -> ParameterError:
    """Return the error of a texture that lacks a function; it says which, and who needs it."""
    offered = sorted({name for unit in modules for name in unit.kernels.provides} & OFFERED.keys())
    what = f"must offer {OFFERED.get(missing.name, 'more')} (a sampler function {missing.name!r})"
    there = f"{modules[0].name} offers {', '.join(offered) or 'nothing'}"
    return ParameterError("texture", f"{what}, {who}; {there}")


@lru_cache(maxsize=256)
def fuse_contact(law: Law) -> ModuleType:
    """Return the compiled loop of a law over given contacts: ``contact_batch``."""
    from asperity.kernels import contact_loop

    plan = ProbePlan(law, kernel_source(law), "none")
    loop = module_unit(contact_loop)
    given = written_unit(f"law {law} at a contact", contact_source(plan))
    at_hand = (loop, given, *law_units(law, "none"))
    return load_fused(_assembled(f"Law {law} at contacts.", loops_of(loop), at_hand))


@lru_cache(maxsize=256)
def reads_position(law: Law) -> bool:
    """Return whether the Jacobian of a law looks at the position of the probe."""
    wanted = ProbePlan(law, kernel_source(law), "none").wanted("law_jacobian")
    return not wanted.isdisjoint(("x", "y", "z"))


@lru_cache(maxsize=16)
def fuse_module(module: ModuleType, *helpers: ModuleType) -> ModuleType:
    """Return a module whose loops are compiled, with what they call in it and in others."""
    return load_fused(source_of_module(module, *helpers))


def source_of_module(module: ModuleType, *helpers: ModuleType) -> str:
    """Return the text of such a module, which another process can load."""
    unit = module_unit(module)
    at_hand = (unit, *map(module_unit, helpers))
    return _assembled(f"{module.__name__}.", loops_of(unit), at_hand)


@lru_cache(maxsize=64)
def fuse_sampler(sampler: tuple[ModuleType, ...], *further: ModuleType) -> ModuleType:
    """Return the compiled loops of a texture kind.

    Functions ``height_batch``, ``slope_batch``, ``curvature_batch`` (points (n, 2), result array)
    and ``nearest_batch`` (points (n, 3), result (n, 2)), and the loops of further modules. A loop
    that asks what the sampler does not offer raises a ParameterError when it is called.
    """
    from asperity.kernels import batch_sine, sampler_loops

    modules = tuple(map(module_unit, sampler))
    asking = tuple(map(module_unit, (sampler_loops, *further)))
    at_hand = (module_unit(batch_sine), *modules, *asking)
    served, refused = [], {}
    for loop in loops_of(*asking):
        try:
            link([loop], at_hand)
            served.append(loop)
        except MissingFunctionError as missing:
            refused[loop[0]] = _lacking(missing, modules, "which is asked of it")
    module = load_fused(_assembled(f"Texture {sampler[0].__name__}.", served, at_hand))
    vars(module).update({name: partial(_refuse, error) for name, error in refused.items()})
    return module


def _refuse(error: ParameterError, *_arguments: object) -> None:
    raise error


_NEXT = "\n# --- the next module ---\n"


def _assembled(title: str, loops: Sequence[tuple[str, Unit]], at_hand: Sequence[Unit]) -> str:
    """Return the texts of modules: those of shared functions, and after them the one of loops."""
    texts: list[str] = []
    homes: dict[str, str] = {}
    for part in link_parts(loops, at_hand):
        taken = "".join(f"from {homes[name]} import {name}\n" for name in part.borrows)
        texts.append(_head(part.title or title, part.source) + taken + part.source)
        homes[part.name] = _module_name(texts[-1])
    return _NEXT.join(texts)


def _head(title: str, source: str) -> str:
    used = [f"from {home} import {name}\n" for name, home in COMMON.items() if f"{name}(" in source]
    return _HEADER.format(title=title) + "".join([*used, "\n"] if used else [])


def _module_name(text: str) -> str:
    """Return the name of a module after its content, and so after that of what it borrows."""
    return f"asperity_fused_{hashlib.sha256(text.encode()).hexdigest()[:32]}"


_LOADING = Lock()


def load_fused(source: str) -> ModuleType:
    """Return a fused module, one and the same whichever thread asks.

    The machine code of its loops, and of what they borrow, is kept between runs.
    """
    with _LOADING:
        return [_loaded(text) for text in source.split(_NEXT)][-1]


@cache
def _loaded(text: str) -> ModuleType:
    from asperity.kernels.ingredients import share_ingredients  # it imports Numba

    module = ModuleType(_module_name(text))
    module.__file__ = f"<{module.__name__}>"
    # For tracebacks, and for whoever wants to read what was compiled.
    linecache.cache[module.__file__] = (len(text), None, text.splitlines(True), module.__file__)
    sys.modules[module.__name__] = module  # kept code names the module that it belongs to
    exec(compile(text, module.__file__, "exec"), vars(module))
    share_ingredients(module)
    return module
