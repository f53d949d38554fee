"""The lateness of waits, measured by the system's clock as a loop waits."""

from asperity.core.compiled import Kernels
from asperity.core.platform.clock_interface import Clock, clock_now, clock_wait_until

KERNELS = Kernels(loops=("measure_lateness",))


def measure_lateness(clock: Clock, period: int, count: int) -> int:
    """Return by how much the worst of a number of waits for a period [ns] ended late [ns]."""
    worst = 0
    due = clock_now(0, clock)
    for _ in range(count):
        due += period
        worst = max(worst, clock_wait_until(due, clock) - due)
    return worst
