"""What a calibration renders in the place of a surface: rest, pushes to and fro, a smooth wall.

It takes a law's place in the loop of a device, so that every guard of the loop stands behind it.
The wall is a spring from both sides, as a wall is felt that is pressed: nobody has to press.
Across the axis that is tried a soft spring holds the handle.
"""

# ruff: noqa: ARG001 - the signatures of a law on a texture

import math
from typing import NamedTuple

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.contacts.memory import FIRST, POINTS

KERNELS = Kernels(provides=("probe_depth", "probe_inside", "probe_tick"))

# What is done.
REST, PUSHES, WALL = 0.0, 1.0, 2.0

# Places in the memory of a contact, which there is none of here; POINTS is 0 at the beginning.
CENTRE = FIRST
COUNT, SEED, SIGN, REMAINING, TRIPPED = range(FIRST + 3, FIRST + 8)
PLACE, SPEED = FIRST + 8, FIRST + 11


class Excitation(NamedTuple):
    """What is done, in numbers.

    Attributes:
        number: by which its rows are known.
        kind: REST, PUSHES or WALL.
        axis: along which, 0 to 2.
        hold: stiffness of the soft spring towards the centre [N/m].
        brake: damping beside it, on the filtered velocity [N s/m].
        share: of the newest difference in that velocity [1].
        rate: 1/T [1/s].
        x: of the centre [m]; not a number for where the handle is at first.
        y: likewise.
        z: likewise.
        stiffness: of the wall [N/m].
        step: by which the wall is moved, once [m].
        wait: samples until then.
        push: force of the pushes [N].
        span: samples that a push lasts, on average.
        trip: distance from where the handle belongs, along the axis, that ends the force [m].
        samples: after which there is no force.
    """

    number: float
    kind: float
    axis: float
    hold: float
    brake: float
    share: float
    rate: float
    x: float
    y: float
    z: float
    stiffness: float
    step: float
    wait: float
    push: float
    span: float
    trip: float
    samples: float


def begin(x: float, y: float, z: float, memory: FloatArray, law: Excitation) -> None:
    """Note where the handle is at first, and begin to count."""
    given = not math.isnan(law.x)
    memory[CENTRE] = law.x if given else x
    memory[CENTRE + 1] = law.y if given else y
    memory[CENTRE + 2] = law.z if given else z
    memory[PLACE] = x
    memory[PLACE + 1] = y
    memory[PLACE + 2] = z
    for i in range(3):
        memory[SPEED + i] = 0.0
    memory[COUNT] = 0.0
    memory[SEED] = 1.0 + law.number
    memory[SIGN] = 1.0
    memory[REMAINING] = 0.0
    memory[TRIPPED] = 0.0
    memory[POINTS] = 1.0


def pushed(memory: FloatArray, law: Excitation) -> float:
    """Return the push of this sample [N]: to and fro, each for half to three halves of the span."""
    if memory[REMAINING] <= 0.0:
        memory[SIGN] = -memory[SIGN]
        # The least random numbers of Park and Miller: exact in double precision.
        memory[SEED] = (16807.0 * memory[SEED]) % 2147483647.0
        memory[REMAINING] = law.span * (0.5 + memory[SEED] / 2147483647.0)
    memory[REMAINING] -= 1.0
    force: float = law.push * memory[SIGN]
    return force


def braked(x: float, i: int, memory: FloatArray, law: Excitation) -> float:
    """Return the force of the brake along an axis [N]."""
    speed = (x - memory[PLACE + i]) * law.rate
    memory[PLACE + i] = x
    memory[SPEED + i] += law.share * (speed - memory[SPEED + i])
    force: float = -law.brake * memory[SPEED + i]
    return force


def probe_tick(
    x: float, y: float, z: float, ax: float, ay: float, held: bool, memory: FloatArray,
    texture: object, law: Excitation,
) -> tuple[float, float, float, float, float, bool]:  # fmt: skip
    """Return the force [N], the number, how many samples were done, and whether it tripped."""
    if memory[POINTS] == 0.0:
        begin(x, y, z, memory, law)
    count = memory[COUNT]
    memory[COUNT] = count + 1.0
    ex = x - memory[CENTRE]
    ey = y - memory[CENTRE + 1]
    ez = z - memory[CENTRE + 2]
    if law.kind == WALL and count >= law.wait:
        ex -= law.step if law.axis == 0.0 else 0.0
        ey -= law.step if law.axis == 1.0 else 0.0
        ez -= law.step if law.axis == 2.0 else 0.0
    along = ex if law.axis == 0.0 else ey if law.axis == 1.0 else ez
    # Up to the step the wall is only there: the handle may be pulled to it from further away.
    if law.kind != REST and count >= law.wait and abs(along) > law.trip:
        memory[TRIPPED] = 1.0
    over = memory[TRIPPED] != 0.0
    if over or count >= law.samples:
        return 0.0, 0.0, 0.0, law.number, count, over
    push = pushed(memory, law) if law.kind == PUSHES else 0.0
    bx = braked(x, 0, memory, law)
    by = braked(y, 1, memory, law)
    bz = braked(z, 2, memory, law)
    stiff = law.stiffness if law.kind == WALL else law.hold
    along_it = push - stiff * along
    fx = along_it if law.axis == 0.0 else -law.hold * ex
    fy = along_it if law.axis == 1.0 else -law.hold * ey
    fz = along_it if law.axis == 2.0 else -law.hold * ez
    return fx + bx, fy + by, fz + bz, law.number, count, over


def probe_inside(x: float, y: float, z: float, texture: object) -> bool:
    """Return that there is contact: brakes act as they do in a body."""
    return True


def probe_depth(x: float, y: float, z: float, texture: object) -> float:
    """Return no depth: nothing is too deep."""
    return 0.0
