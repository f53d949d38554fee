"""The anchor of a simulated hand that somebody moves while the loop runs.

What is asked for comes through memory that is shared, at any time and in any steps. The anchor
follows it as a hand does: smoothly, critically damped, and never faster than a hand is.
"""

import math

from asperity.compiled import Kernels
from asperity.servo.kernels.simulated import SimulatedDevice

KERNELS = Kernels(provides=("anchor_step",))

# Rows of the memory (ROWS + KEPT * PARTS, 3): whoever steers writes the first four, the loop the
# for is the point TARGET + COSINE cos(angle) + SINE sin(angle) [m].
TARGET, COSINE, SINE, ASKED, ANCHOR, VELOCITY, HEARD = range(7)
ROWS = 7
# After these, of each of the newest samples: anchor [m], velocity [m/s] and position [m].
KEPT, PARTS = 40_000, 3
# In the row ASKED: speed of the angle [rad/s], and the number of the newest wish; in the row
# HEARD: the angle [rad], and the number of the newest wish that the anchor follows.
TURN, WISH = 0, 1

EAGERNESS = 250.0
"""[rad/s] with which the anchor follows; it lags by 2/EAGERNESS, 8 ms."""
FASTEST = 0.4
"""Speed of the anchor at most [m/s]."""


def anchor_step(device: SimulatedDevice) -> tuple[float, float, float, float, float, float]:
    """Return where the hand's anchor is in this sample, and in the next [m].

    v' = ω² (target - a) - 2 ω v, with |v| held below FASTEST.
    """
    at = device.anchor
    step = 1.0 / device.rate
    number = at[ASKED, WISH]
    angle = (at[HEARD, TURN] + at[ASKED, TURN] * step) % (2.0 * math.pi)
    cosine = math.cos(angle)
    sine = math.sin(angle)
    speed = 0.0
    for i in range(3):
        target = at[TARGET, i] + at[COSINE, i] * cosine + at[SINE, i] * sine
        pull = EAGERNESS * EAGERNESS * (target - at[ANCHOR, i])
        at[VELOCITY, i] += step * (pull - 2.0 * EAGERNESS * at[VELOCITY, i])
        speed += at[VELOCITY, i] * at[VELOCITY, i]
    speed = math.sqrt(speed)
    share = FASTEST / speed if speed > FASTEST else 1.0
    ax = at[ANCHOR, 0]
    ay = at[ANCHOR, 1]
    az = at[ANCHOR, 2]
    kept = ROWS + PARTS * (device.done[1] % KEPT)
    for i in range(3):
        at[kept, i] = at[ANCHOR, i]
        at[kept + 1, i] = device.x[3 + i]
        at[kept + 2, i] = device.x[i]
        at[VELOCITY, i] *= share
        at[ANCHOR, i] += step * at[VELOCITY, i]
    at[HEARD, TURN] = angle
    at[HEARD, WISH] = number
    return ax, ay, az, at[ANCHOR, 0], at[ANCHOR, 1], at[ANCHOR, 2]
