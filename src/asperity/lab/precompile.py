"""Compile in advance what commands load for shipped laws, into the cache or for the package."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np

from asperity.core import cache, packed_code
from asperity.core.processes import precompute
from asperity.laws import Law, find_law
from asperity.laws.clamps import BACKED
from asperity.textures import Fourier, HeightMap, Profile, Sinusoid, Texture

_STIFFNESS = 100.0  # [N/m]
_DURATION = 0.01  # [s]
_CONTINUITY = 1.0
_MARGIN = 1e-5  # [m]
_START = (0.0, 0.0, 1e-3)  # [m]


def sample_textures() -> dict[str, Texture]:
    """Return a small texture for each kind of height function, by name."""
    bumps = [0.0, 1.0e-5, 0.0, 2.0e-5]
    return {
        "sinusoids": Sinusoid(1.0e-5, 1.0e-3),
        "sums of waves": Fourier([1.0e-5, 1.0e-5], [[2.0e3, 0.0], [0.0, 3.0e3]]),
        "sums of parallel waves": Fourier([1.0e-5, 1.0e-5], [[2.0e3, 0.0], [3.0e3, 0.0]]),
        "profiles": Profile(bumps, 1.0e-3),
        "maps": HeightMap([bumps] * 4, 1.0e-3),
    }


def precompile(
    laws: Sequence[Law], textures: Mapping[str, Texture], step: Callable[[str], None]
) -> None:
    """Compare laws on textures to compile all functions of a comparison.

    Args:
        laws: the laws.
        textures: textures by name.
        step: called with a description of each step.
    """
    from asperity.analysis.results.compare import compare

    for name, texture in textures.items():

        def report(letter: str, name: str = name) -> None:
            step(f"law {letter} on {name}")

        with cache.bypass_results():
            compare(texture, laws=laws, progress=report)


def precompile_loops(
    laws: Sequence[Law], textures: Mapping[str, Texture], step: Callable[[str], None]
) -> None:
    """Compile the loops of a simulation, of ``run`` and of the lab, and what they recommend by.

    Those of the default device and hand.

    Args:
        laws: the laws.
        textures: textures by name.
        step: called with a description of each step.
    """
    from asperity.analysis.results.compare import compare
    from asperity.textures.fields.node_potentials import split_columns

    for texture in textures.values():
        with cache.bypass_results():
            compare(texture, laws=laws, clamp=BACKED.name)
        # A field of a larger map has nodes whose closest points a lattice does not give.
        columns = split_columns(texture, _CONTINUITY)
        columns(np.zeros((1, 2)), np.zeros(1), _MARGIN, np.empty((1, 1)))
    tasks = [(texture, law.letter) for texture in textures.values() for law in laws]
    names = [f"loops of law {law} on {name}" for name in textures for law in laws]
    with precompute(_compile_loops, tasks) as done:
        for task, name, is_done in zip(tasks, names, done, strict=True):
            if not is_done:
                _compile_loops(task)
            step(name)


def _compile_loops(task: tuple[Texture, str]) -> bool:
    """Compile the loops of a texture and a law."""
    from asperity.core.platform import lateness
    from asperity.core.platform.clocks import clock_module, system_clock
    from asperity.kernels.fuse import fuse_module
    from asperity.lab.scene_state import make_scene_state
    from asperity.scene.device_run import simulated_process
    from asperity.scene.scene_file import Scene
    from asperity.scene.setup import make_setup
    from asperity.servo.drivers.pointer import PointerHand, pointer_driver

    texture, letter = task
    values: dict[str, Any] = {"law": find_law(letter), "stiffness": _STIFFNESS}
    values["clamp"] = BACKED.name
    scene = Scene(texture)
    setup = make_setup(scene, surface=values, duration=_DURATION, use_defaults=True)
    setup.simulate()
    _compile_driver(setup, simulated_process(setup).driver)
    fuse_module(lateness, clock_module()).measure_lateness(system_clock(), 1000, 1)
    setup = make_scene_state(scene, surface=values).setup
    with PointerHand(_START) as hand:
        _compile_driver(setup, pointer_driver(setup.plant, setup.hand, setup.servo, hand))
    return True


def _compile_driver(setup: Any, driver: Any) -> None:
    from asperity.core.platform.clocks import system_clock
    from asperity.servo.driver_loop import DriverLoop, build_program
    from asperity.servo.loop_memory import LoopMemory

    block = LoopMemory().block()
    reach = setup.safety.reach_limit(setup.device)
    loop = DriverLoop(driver, setup.servo, setup.safety, reach, block, system_clock())
    loop.compile(build_program(setup.rendered, driver))


@contextmanager
def packing(folder: str | None) -> Iterator[None]:
    """Compile for a level of processors within a block, and write the code into a package.

    Args:
        folder: the folder ``machine_code`` of the package; ``None``: compile for this machine.
    """
    if folder is None:
        yield
        return
    packed_code.compile_for_level()
    with cache.bypass():
        yield
        from asperity.kernels.numba_internals import code_target

        packed_code.store_packed_code(Path(folder), code_target())
