"""A frame of OpenHaptics, by the C functions of libHD, in the thread of its scheduler.

libHD allows one frame in each tick of its scheduler, from the scheduler's thread: so this function
is what the scheduler calls, and the loop exchanges with it through a slot.
"""

import numpy as np
from numpy.typing import NDArray

from asperity.checks import FloatArray
from asperity.compiled import Kernels, local_array
from asperity.kernels.native import call_address, store_release
from asperity.servo.kernels.slot import (
    CODE,
    FORCES,
    FREE,
    PATIENCE,
    PLACES,
    SILENT,
    fail,
    newest_row,
    put_row,
)

KERNELS = Kernels(
    requires=("fail", "newest_row", "put_row"),
    loops=("haptic_frame",),
    native=("call_address", "store_release"),
)

# Words of the slot: frames that were done, addresses of functions, the device's handle, the address
# of the slot itself, and where the system writes the time.
FRAMES, BEGIN, END, GET, SET, ERROR, GETTIME, HANDLE, SELF = range(FREE, FREE + 9)
TIME = SELF + 1
# Of hdDefines.h and hdScheduler.h.
CURRENT_POSITION, CURRENT_FORCE = 0x2050, 0x2700
CONTINUE = 1
_MONOTONIC = 1
_SECOND = 1_000_000_000


def haptic_frame(words: NDArray[np.int64], numbers: FloatArray) -> int:
    """Put the place of the handle into the slot, and hold the force that is in it.

    The force is zero once anything was found wrong, and if the loop has held it for too long.
    ``hdGetError`` returns a record, whose first number is the error, in a register.

    Args:
        words: of the slot.
        numbers: of the slot.

    Returns:
        That the scheduler shall call again.
    """
    place = local_array((3,))
    force = local_array((3,))
    call_address(words[GETTIME], _MONOTONIC, words[SELF] + 8 * TIME)
    now = words[TIME] * _SECOND + words[TIME + 1]
    wanted = newest_row(words, numbers, FORCES)
    some = wanted.x != 0.0 or wanted.y != 0.0 or wanted.z != 0.0
    if some and now - wanted.time > words[PATIENCE]:
        fail(words, SILENT)
    held = words[CODE] == 0 and wanted.time != 0
    force[0] = wanted.x if held else 0.0
    force[1] = wanted.y if held else 0.0
    force[2] = wanted.z if held else 0.0
    call_address(words[BEGIN], words[HANDLE])
    call_address(words[GET], CURRENT_POSITION, place)
    call_address(words[SET], CURRENT_FORCE, force)
    call_address(words[END], words[HANDLE])
    wrong = call_address(words[ERROR])
    if wrong != 0:
        fail(words, wrong)
    else:
        put_row(words, numbers, PLACES, place[0], place[1], place[2], now)
    store_release(words, FRAMES, words[FRAMES] + 1)
    return CONTINUE
