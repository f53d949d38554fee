"""Examination of a machine: what a report of a fault has to say about it."""

from __future__ import annotations

import time
from dataclasses import dataclass
from importlib.metadata import entry_points, version
from platform import python_version

from asperity.core import cache
from asperity.core.errors import AsperityError, ParameterError
from asperity.core.files import Serializable
from asperity.core.platform.system import describe_system
from asperity.core.processes import available_cores
from asperity.core.version import PLUGIN_GROUP, __version__
from asperity.servo.driver import IDENTITY_FRAME, DriverKind
from asperity.servo.drivers import library
from asperity.servo.drivers.driver_registry import DRIVER_KINDS
from asperity.servo.drivers.simulated import simulated_driver
from asperity.servo.loop_memory import EndReason, LoopStatistics
from asperity.servo.process import ServoProcess
from asperity.servo.safety import Safety
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary
from asperity.surface import Surface
from asperity.textures import Sinusoid

LOOP_TIME = 2.0
"""Time for which a simulated loop runs [s]."""
LOOP_PERIOD = 1e-3
"""Period of its samples [s]."""
_PACKAGES = ("numpy", "scipy", "numba", "llvmlite", "sympy", "click", "filelock", "websockets")


@dataclass(frozen=True)
class VendorDriver(Serializable):
    """The driver of a vendor's devices.

    Attributes:
        name: name on the command line.
        failure: why its library or service cannot be used; empty if it can.
    """

    name: str
    failure: str


@dataclass(frozen=True)
class MachineReport(Serializable):
    """A machine, as far as faults depend on it.

    Attributes:
        system: operating system and processor.
        cores: number of processors that may be used.
        versions: versions of asperity, Python and packages.
        plugins: entry points of installed plugins.
        notes: what the system did not permit to the loop, in sentences.
        statistics: counts of a simulated loop; ``None`` if it did not run.
        failure: why it did not run.
        drivers: drivers of vendors.
        cache_folder: folder of the cache.
        cache_size: its size [bytes].
        cache_limit: its limit [bytes].
    """

    system: str
    cores: int
    versions: dict[str, str]
    plugins: tuple[str, ...]
    notes: tuple[str, ...]
    statistics: LoopStatistics | None
    failure: str
    drivers: tuple[VendorDriver, ...]
    cache_folder: str
    cache_size: int
    cache_limit: int


def examine_machine(duration: float = LOOP_TIME) -> MachineReport:
    """Return what is known of this machine, with a simulated loop of a duration [s]."""
    versions = {"asperity": __version__, "Python": python_version()}
    versions |= {name: version(name) for name in _PACKAGES}
    notes, statistics, failure = _run_loop(duration)
    # A library of the user's own has no name to look for.
    kinds = [kind for kind in DRIVER_KINDS.values() if kind is not library.KIND]
    return MachineReport(
        describe_system(),
        available_cores(),
        versions,
        tuple([entry.value for entry in entry_points(group=PLUGIN_GROUP)]),
        notes,
        statistics,
        failure,
        tuple([_check_driver(kind) for kind in kinds]),
        str(cache.cache_folder()),
        sum([entry.size for entry in cache.list_entries()]),
        cache.size_limit(),
    )


def _run_loop(duration: float) -> tuple[tuple[str, ...], LoopStatistics | None, str]:
    """Return notes and counts of a loop that renders a surface for a simulated hand."""
    servo = Servo(LOOP_PERIOD)
    plant = Cartesian(0.1)
    driver = simulated_driver(plant, SpringHand(100.0), servo, Stationary((0.0,) * 3), duration)
    surface = Surface(Sinusoid(1e-4, 2e-3), "C", stiffness=100.0)
    # Lateness is to be measured, and ends nothing.
    patient = Safety(lateness=60.0, silence=60.0)
    try:
        with ServoProcess(surface, driver, servo, patient, duration=duration) as loop:
            while loop.poll() is EndReason.RUNNING:
                time.sleep(0.05)
            return loop.notes, loop.statistics, ""
    except AsperityError as error:
        return (), None, str(error)


def _check_driver(kind: DriverKind) -> VendorDriver:
    try:
        kind.create("", IDENTITY_FRAME).check_library()
    except ParameterError as error:
        return VendorDriver(kind.name, error.requirement)
    return VendorDriver(kind.name, "")
