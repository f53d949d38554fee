"""The interfaces that compiled code is bound to are those of the functions that are bound."""

from __future__ import annotations

import ast
import inspect
from types import ModuleType

import pytest

from asperity.contacts import sampler
from asperity.kernels import law_functions
from asperity.kernels.fuse import kernel_source
from asperity.kernels.probe import CLAMPS, ProbePlan, contact_source, probe_source
from asperity.laws import LAWS
from asperity.simulation.kernels import (
    axes,
    banded,
    body_functions,
    dense,
    five_bar,
    prescribed,
    resonant,
    rigid,
)
from asperity.textures.samplers import fourier, fourier_line, heightmap, profile, sinusoid

SAMPLERS = (sinusoid, fourier, fourier_line, profile, heightmap)
BODIES = (axes, banded, dense, five_bar, prescribed, resonant, rigid)
PAIRS = [(sampler, one) for one in SAMPLERS] + [(body_functions, one) for one in BODIES]


def arguments(module: ModuleType) -> dict[str, int]:
    """How many arguments each function of a module takes."""
    functions = inspect.getmembers(module, inspect.isfunction)
    return {name: len(inspect.signature(function).parameters) for name, function in functions}


@pytest.mark.parametrize(("interface", "module"), PAIRS)
def test_a_module_defines_what_its_interface_says(
    interface: ModuleType, module: ModuleType
) -> None:
    said, found = arguments(interface), arguments(module)
    shared = said.keys() & set(module.KERNELS.provides)
    assert shared
    assert {name: found[name] for name in shared} == {name: said[name] for name in shared}


@pytest.mark.parametrize("letter", LAWS)
@pytest.mark.parametrize("clamp", CLAMPS)
def test_what_is_written_for_a_law_is_what_loops_call(letter: str, clamp: str) -> None:
    law = LAWS[letter]
    if clamp != "none" and not law.clampable:
        return
    plan = ProbePlan(law, kernel_source(law), clamp)
    text = probe_source(plan) + (contact_source(plan) if law.contact.given_by_depth else "")
    found = {
        n.name: len(n.args.args) for n in ast.parse(text).body if isinstance(n, ast.FunctionDef)
    }
    said = arguments(law_functions)
    assert found == {name: said[name] for name in found}
    assert set(found) >= {"probe_force", "probe_jacobian", "probe_inside", "probe_held"}
