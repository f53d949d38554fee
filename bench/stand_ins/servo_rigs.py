"""Devices that fail as they are ordered, for each driver: simulated, replayed, or a stand-in."""

from __future__ import annotations

import ctypes
import os
import tempfile
from abc import ABC, abstractmethod
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, ExitStack, contextmanager
from pathlib import Path
from typing import Any, Self
from unittest.mock import patch

import numpy as np

from asperity.servo.driver import Driver
from asperity.servo.drivers import force_dimension, haply, open_haptics
from asperity.servo.drivers.force_dimension import ForceDimensionDriver
from asperity.servo.drivers.haply import HaplyDriver
from asperity.servo.drivers.library import LibraryDriver
from asperity.servo.drivers.open_haptics import OpenHapticsDriver
from asperity.servo.drivers.simulated import ReplayDriver, simulated_driver
from asperity.simulation import Cartesian, Servo, SpringHand, Stationary
from bench.stand_ins.fake_haply import FAULTS, FakeHaply
from bench.stand_ins.fakes import compile_library

HERE = Path(__file__).parent / "c"
_PLACE = (0.7e-3, 0.4e-3, -1e-3)
_WRONG = {"not a number": np.nan, "infinite": np.inf, "far": 1e4}
_NO_NUMBER = [*_WRONG]
Force = tuple[float, ...]


class DriverRig(ABC):
    """A driver with a device that fails; use it in a ``with``.

    Attributes:
        faults: that it can have.
        deaf: those with which the device hears nobody any more, until it is closed.
    """

    faults: tuple[str, ...]
    deaf: tuple[str, ...] = ()

    def __init__(self) -> None:
        self.kept = ExitStack()

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_error: object) -> None:
        self.kept.close()

    @abstractmethod
    def failing_driver(self, fault: str, at: int) -> AbstractContextManager[Driver]:
        """Return a driver whose device has a fault at a sample; none if it is empty."""

    def held_force(self, _record: Any) -> Force | None:
        """Return the force that the device holds; ``None`` for no device, or none that listens.

        Args:
            _record: of the open device.
        """
        return None


class SimulatedRig(DriverRig):
    """A simulated device whose hand is led astray."""

    faults = (*_NO_NUMBER,)

    @contextmanager
    def failing_driver(self, fault: str, at: int) -> Iterator[Driver]:
        """Return the driver of a hand that from a sample on is where no hand is."""
        hand = SpringHand(stiffness=300.0, damping=3.0, mass=0.05)
        driver = simulated_driver(Cartesian(0.05, 1.0), hand, Servo(1e-3), Stationary(_PLACE), 1.0)
        if fault:
            driver.device.anchor[at:, 1] = _WRONG[fault]
        yield driver

    def held_force(self, _record: Any) -> Force | None:
        """Return the force that waits, without delay the last one."""
        return tuple(map(float, _record.queue[0]))


class ReplayedRig(DriverRig):
    """A recording with rows that are wrong."""

    faults = (*_NO_NUMBER,)

    @contextmanager
    def failing_driver(self, fault: str, at: int) -> Iterator[Driver]:
        """Return the driver of a recording that is wrong from a sample on."""
        points = np.tile(_PLACE, (1000, 1))
        if fault:
            points[at:, 2] = _WRONG[fault]
        yield ReplayDriver(points)


class LibraryRig(DriverRig):
    """A device behind a shared library that is compiled here.

    Args:
        source: file of C.
        kinds: its faults in the order in which it numbers them, from 1 on.
        driver: returns the driver, from the path of the library and the fault.
        variable: of the environment that names the library; empty for none.
    """

    def __init__(
        self,
        source: str,
        kinds: tuple[str, ...],
        driver: Callable[[str, str], Driver],
        variable: str,
        deaf: tuple[str, ...] = (),
    ) -> None:
        super().__init__()
        self.faults, self.deaf = kinds, deaf
        folder = Path(self.kept.enter_context(tempfile.TemporaryDirectory()))
        self._path, self._driver = str(compile_library(HERE / source, folder)), driver
        if variable:
            self.kept.enter_context(patch.dict(os.environ, {variable: self._path}))
        self._library = ctypes.CDLL(self._path)
        self._library.fake_force.restype = ctypes.c_double

    @contextmanager
    def failing_driver(self, fault: str, at: int) -> Iterator[Driver]:
        """Return the driver of a library that fails at a sample."""
        self._library.fake_reset(self.faults.index(fault) + 1 if fault else 0, at)
        yield self._driver(self._path, fault)

    def held_force(self, _record: Any) -> Force | None:
        """Return what the library was told last."""
        return tuple(self._library.fake_force(axis) for axis in range(3))


class HaplyRig(DriverRig):
    """A service on a port of its own."""

    faults = FAULTS

    @contextmanager
    def failing_driver(self, fault: str, at: int) -> Iterator[Driver]:
        """Return the driver of a service that fails at a message."""
        with FakeHaply(fault=fault, at=at) as self._service:
            silent = fault in {"mute", "half a frame"}
            with patch.dict(os.environ, {haply.SERVICE: self._service.address}):
                yield HaplyDriver(max_reading_age=0.02 if silent else 60.0, force_timeout=60.0)

    def held_force(self, _record: Any) -> Force | None:
        """Return the last force that came."""
        lost = self._service.fault == "closed"
        return None if lost else self._service.forces[-1][1]


_C_FAULTS = ("error once", "errors", "error of writing", "not a number", "far", "slow")


def _user_device_rig() -> DriverRig:
    return LibraryRig("fake_own.c", _C_FAULTS, lambda path, _fault: LibraryDriver(path), "")


def _force_dimension_rig() -> DriverRig:
    variable = force_dimension.LIBRARY
    return LibraryRig(
        "fake_dhd.c", _C_FAULTS, lambda _path, _fault: ForceDimensionDriver(), variable
    )


def _open_haptics_rig() -> DriverRig:
    def driver(_path: str, fault: str) -> Driver:
        return OpenHapticsDriver(
            max_reading_age=0.02 if fault == "hangs" else 60.0, force_timeout=60.0
        )

    kinds = ("errors", "hangs", "not a number", "far")
    return LibraryRig("fake_hd.c", kinds, driver, open_haptics.LIBRARY, deaf=("hangs",))


RIGS: dict[str, Callable[[], DriverRig]] = {
    "simulated": SimulatedRig,
    "replay": ReplayedRig,
    "haply": HaplyRig,
    "forcedimension": _force_dimension_rig,
    "openhaptics": _open_haptics_rig,
    "own": _user_device_rig,
}
"""A rig of each driver."""
