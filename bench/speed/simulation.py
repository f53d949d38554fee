"""A servo step with its energy ledger against hand-written C, and real time."""

from __future__ import annotations

import ctypes
import math
import shutil
import subprocess
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import Any

import numpy as np
from rich.console import Console
from rich.table import Table

from asperity.core.checks import FloatArray
from asperity.simulation import Cartesian, Pantograph, Servo, SpringHand, Strokes, simulate
from asperity.simulation.plants import Plant, sampled_plant
from asperity.simulation.simulate import Simulation
from asperity.surface import Surface
from asperity.textures import Sinusoid
from bench.speed.reference import FLAGS, DisagreementError
from bench.speed.timing import median_ratio, number_table, seconds, take_turns

GOALS = {"Cartesian": 1.5, "Pantograph": 2.0}
GOAL_REAL_TIME = 100.0
SAMPLES = 20_000
ROUNDS = 151
PERIOD = 1e-4
TOLERANCE = 1e-9  # of the ledger's exchanged energy and of the state's size

_SOURCE = Path(__file__).parent / "c" / "servo.c"
_SERVO = Servo(
    PERIOD,
    delay=1,
    position_resolution=15e-6,
    force_resolution=1e-3,
    max_force=8.0,
    virtual_damping=0.1,
    velocity_share=0.2,
)
_HAND = SpringHand(stiffness=300.0, damping=3.0, mass=0.05, force=(0.0, 0.0, -1.0))
_TEXTURE = Sinusoid(amplitude=0.8e-3, period=2e-3)
_STROKES = Strokes((-0.01, 0.0, 0.0), (0.01, 0.0, 0.0), speed=0.1, count=10_000)
_PLANTS: dict[str, Plant] = {"Cartesian": Cartesian(0.02, 1.0), "Pantograph": Pantograph()}


class _Loop(ctypes.Structure):
    _fields_ = [
        *(
            (name, ctypes.c_double * count)
            for name, count in (
                ("x", 6),
                ("measured", 3),
                ("filtered", 3),
                ("commanded", 3),
                ("sums", 11),
            )
        ),
        *((name, ctypes.c_long) for name in ("begun", "head", "done")),
    ]


@dataclass
class _AsperityLoop:
    """The compiled loop of asperity, going on from call to call."""

    law: str
    plant: Plant
    anchor: FloatArray
    simulation: Simulation = field(init=False)

    def __post_init__(self) -> None:
        surface = Surface(_TEXTURE, self.law, 1000.0)
        body = sampled_plant(self.plant, _HAND, _SERVO)
        self.simulation = Simulation(surface, body, _SERVO, self.anchor[0])

    def run(self) -> None:
        """Run the anchor's way once."""
        if self.simulation.run(self.anchor):
            raise DisagreementError("asperity's loop stopped")

    @property
    def values(self) -> FloatArray:
        """State and sums."""
        return np.concatenate([self.simulation.state, self.simulation.ledger_sums])


@dataclass
class _CLoop:
    """The same in C."""

    library: ctypes.CDLL
    law: str
    plant: Plant
    anchor: FloatArray
    loop: _Loop = field(default_factory=_Loop)

    def __post_init__(self) -> None:
        self.loop.x[:3] = self.anchor[0].tolist()
        self._queue = np.zeros((_SERVO.delay + 1, 3))
        self._set = (ctypes.c_double * 6)(*_SERVO.settings)
        self._texture = (ctypes.c_double * 4)(*_TEXTURE.arguments)
        numbers = sampled_plant(self.plant, _HAND, _SERVO).record
        if isinstance(self.plant, Pantograph):
            bar, hand, _friction, rate, fewest, period, share, inside, least = numbers
            held = [hand.is_band, *hand.stiffness, *hand.damping, *hand.force]
            tail = [hand.length, hand.rest_length, rate, period, share, least, 0.0, 0.0]
            self._numbers: Any = np.array([*bar, *held, *tail], dtype=np.float64)
            self._numbers[-2:].view(np.int64)[:] = fewest, inside
        else:
            self._numbers = numbers[0]
        kind = "bar" if isinstance(self.plant, Pantograph) else "servo"
        self._function = self.library[f"{kind}_{self.law.lower()}"]
        self._function.restype = ctypes.c_long

    def run(self) -> None:
        """Run the anchor's way once."""
        count = len(self.anchor) - 1
        done = self._function(
            ctypes.byref(self.loop),
            ctypes.c_void_p(self._queue.ctypes.data),
            ctypes.c_long(len(self._queue)),
            ctypes.c_void_p(self.anchor.ctypes.data),
            ctypes.c_long(count),
            self._set,
            self._texture,
            ctypes.c_double(1000.0),
            ctypes.c_void_p(self._numbers.ctypes.data),
        )
        if done != count:
            raise DisagreementError("the loop in C stopped")

    @property
    def values(self) -> FloatArray:
        """State and sums."""
        return np.array([*self.loop.x, *self.loop.sums])


def run(console: Console) -> None:
    """Print the ratios to C, and the factors of real time."""
    _against_c(console)
    _real_time(console)


def _against_c(console: Console) -> None:
    compiler = shutil.which("cc")
    if compiler is None:
        console.print("not run: comparison with C (no cc)")
        return
    anchor = _STROKES.at(np.arange(SAMPLES + 1) * PERIOD)
    table = Table("plant", "law", "asperity ns", "C ns", "asp./C", "goal", box=None, pad_edge=False)
    missed = 0
    with tempfile.TemporaryDirectory() as directory:
        library = Path(directory) / "servo.so"
        command = [compiler, "-std=c11", *FLAGS, "-march=native", str(_SOURCE), "-o", str(library)]
        subprocess.run([*command, "-lm"], check=True)
        shared = ctypes.CDLL(str(library))
        for name, plant in _PLANTS.items():
            for law in "WA":
                own, other = _AsperityLoop(law, plant, anchor), _CLoop(shared, law, plant, anchor)
                _check(own, other, name, law)
                times = take_turns([own.run, other.run], ROUNDS)
                each = np.median(times, axis=0) / SAMPLES * 1e9
                ratio = median_ratio(times, 0, 1)
                missed += ratio > GOALS[name]
                cells = (f"{each[0]:.1f}", f"{each[1]:.1f}", f"{ratio:.2f}", f"{GOALS[name]}")
                table.add_row(name, law, *cells)
    console.print("one servo step, ledger and all, against cc -O3 -march=native")
    console.print(table)
    console.print("-> met" if not missed else f"-> MISSED by {missed}", style="bold")


def _check(own: _AsperityLoop, other: _CLoop, name: str, law: str) -> None:
    """Compare state and sums after one way; chaos has no time to grow in it.

    Raises:
        DisagreementError: if they differ: nothing is timed.
    """
    own.run()
    other.run()
    state = float(np.abs(own.values[:6] - other.values[:6]).max())
    sums = float(np.abs(own.values[6:] - other.values[6:]).max() / other.values[-1])
    if not (state < TOLERANCE and sums < TOLERANCE):
        raise DisagreementError(f"{name}, law {law}: C differs by {state:.1e}, {sums:.1e}")


def _real_time(console: Console) -> None:
    """Print how much faster than real time each law runs at 10 kHz, trace in memory."""
    table = number_table("law", *(f"{name}\nx real time" for name in _PLANTS))
    worst = math.inf
    for law in "WABCDEFGH":
        cells = []
        for plant in _PLANTS.values():
            factor = _factor(law, plant)
            worst = min(worst, factor)
            cells.append(f"{factor:.0f}")
        table.add_row(law, *cells)
    console.print(table)
    answer = "met" if worst >= GOAL_REAL_TIME else "MISSED"
    console.print(f"worst {worst:.0f} x (goal {GOAL_REAL_TIME:.0f}) -> {answer}", style="bold")


def _factor(law: str, plant: Plant, duration: float = 5.0) -> float:
    surface = Surface(_TEXTURE, law, 1000.0)

    def once(span: float = duration) -> None:
        simulate(surface, plant, _HAND, _SERVO, _STROKES, span)

    once(0.1)
    return duration / float(np.median([seconds(once) for _ in range(5)]))
