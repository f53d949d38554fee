"""The nearest surface point, tick after tick: the search starts where the last one ended.

A start near the foot is all that is carried on. It saves the way there, and the search looks only
at what is nearer than the foot downhill from it.
"""

from asperity.checks import FloatArray
from asperity.compiled import Kernels
from asperity.contacts.memory import BUDGET, FIRST, GAP, POINTS, SHORT, TAKEN, WORST
from asperity.contacts.sampler import foot_within, height

KERNELS = Kernels(
    provides=("foot_again", "note_gap"), requires=("foot_within", "height"), called=("foot_again",)
)


def note_gap(memory: FloatArray, gap: float, looks: float) -> None:
    """Write down what a tick took, and how far from certain its answer is [m]."""
    memory[TAKEN] = looks
    memory[GAP] = gap
    if gap > 0.0:
        memory[SHORT] += 1.0
        memory[WORST] = max(memory[WORST], gap)


def foot_again(
    x: float, y: float, z: float, memory: FloatArray, texture: object
) -> tuple[float, float, float, float, float]:
    """Return X, Y, h, h_x, h_y of the foot of a probe; no other is nearer by more than the gap."""
    start_x = x
    start_y = y
    if memory[POINTS] > 0.0:
        dx = memory[FIRST] - x
        dy = memory[FIRST + 1] - y
        dz = memory[FIRST + 2] - z
        straight = height(x, y, texture) - z
        if dx * dx + dy * dy + dz * dz < straight * straight:
            start_x = memory[FIRST]
            start_y = memory[FIRST + 1]
    fx, fy, h, hx, hy, gap, looks = foot_within(x, y, z, start_x, start_y, memory[BUDGET], texture)
    memory[POINTS] = 1.0
    memory[FIRST] = fx
    memory[FIRST + 1] = fy
    memory[FIRST + 2] = h
    note_gap(memory, gap, looks)
    return fx, fy, h, hx, hy
