"""Compiled modules define functions with the signatures that their interfaces declare."""

from __future__ import annotations

import ast
import inspect
from types import ModuleType

import pytest

from asperity.contacts import closest_search
from asperity.contacts import sampler_interface as sampler
from asperity.kernels import probe_functions as law_functions
from asperity.kernels.fuse import energy_kernel_source, kernel_source
from asperity.kernels.link import unit_from_module
from asperity.kernels.probe_functions import LawCode, contact_source, probe_source
from asperity.laws import LAWS
from asperity.laws.clamps import CLAMPS, Clamp
from asperity.loop import body_interface as body_functions
from asperity.loop.bodies import axis_body as axes
from asperity.loop.bodies import coupled_body as dense
from asperity.loop.bodies import elastic_band as banded
from asperity.loop.bodies import pantograph_dynamics as five_bar
from asperity.loop.bodies import prescribed_motion as prescribed
from asperity.textures.kinds import fourier_sampler as fourier
from asperity.textures.kinds import sinusoid_sampler as sinusoid
from asperity.textures.spline import heightmap_sampler as heightmap
from asperity.textures.spline import profile_sampler as profile
from asperity.textures.spline import spline_pruning, spline_search

SAMPLERS = (sinusoid, fourier, profile, heightmap, closest_search, spline_search)
SEARCHES = (fourier, spline_search, spline_pruning)
BODIES = (axes, banded, dense, five_bar, prescribed)
PAIRS = [(sampler, one) for one in SAMPLERS] + [(body_functions, one) for one in BODIES]
PAIRS += [(closest_search, one) for one in SEARCHES]


def argument_counts(module: ModuleType) -> dict[str, int]:
    """Return the number of arguments of each function of a module."""
    functions = inspect.getmembers(module, inspect.isfunction)
    return {name: len(inspect.signature(function).parameters) for name, function in functions}


def declared_arguments() -> dict[str, int]:
    """Return the number of arguments of each function of a probe; no loop calls the last one."""
    declared = argument_counts(law_functions)
    return declared | {"probe_force_warm": declared["probe_force"] + 1}


@pytest.mark.parametrize(("interface", "module"), PAIRS)
def test_module_matches_its_interface(interface: ModuleType, module: ModuleType) -> None:
    declared, defined = argument_counts(interface), argument_counts(module)
    shared = declared.keys() & set(unit_from_module(module).kernels.provides)
    assert shared
    assert {name: defined[name] for name in shared} == {name: declared[name] for name in shared}


@pytest.mark.parametrize("letter", LAWS)
@pytest.mark.parametrize("clamp", CLAMPS.values(), ids=str)
def test_generated_law_code_matches_its_interface(letter: str, clamp: Clamp) -> None:
    law = LAWS[letter]
    if clamp.changes_force and not law.clampable:
        return
    plan = LawCode(law, kernel_source(law), clamp)
    text = probe_source(plan) + (contact_source(plan) if law.contact.is_determined_by_depth else "")
    defined = {
        n.name: len(n.args.args) for n in ast.parse(text).body if isinstance(n, ast.FunctionDef)
    }
    declared = declared_arguments()
    assert defined == {name: declared[name] for name in defined}
    assert set(defined) >= {"probe_force", "probe_jacobian", "probe_in_contact", "probe_tick"}


@pytest.mark.parametrize("letter", "WCDH")
def test_generated_friction_matches_its_interface(letter: str) -> None:
    law = LAWS[letter]
    source = f"{kernel_source(law)}\n\n{energy_kernel_source(law)}"
    clamp = CLAMPS["backed" if law.clampable else "none"]
    text = probe_source(LawCode(law, source, clamp, has_friction=True))
    declared = declared_arguments()
    functions = [n for n in ast.parse(text).body if isinstance(n, ast.FunctionDef)]
    assert "probe_slip" in [function.name for function in functions]
    assert all(len(one.args.args) == declared[one.name] for one in functions)
