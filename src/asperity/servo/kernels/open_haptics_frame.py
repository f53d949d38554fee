"""A frame of OpenHaptics, by the C functions of libHD, in the thread of its scheduler.

libHD allows one frame per tick of its scheduler, in the scheduler's thread. The scheduler calls
this
function, and the loop exchanges with it through a ring buffer.
"""

from asperity.core.compiled import (
    FloatArray,
    IntArray,
    Kernels,
    call_address,
    local_array,
    store_release,
)
from asperity.servo.kernels.ring_buffer import (
    DRIVER_WORDS,
    FAILURE_CODE,
    FORCE_TIMEOUT,
    FORCES,
    LOOP_SILENT,
    POSITIONS,
    latest_row,
    push_row,
    set_failure,
)

KERNELS = Kernels(loops=("haptic_frame",), native=("call_address", "store_release"))

# Words of the driver: number of frames, addresses of functions, handle of the device, address of
# the ring buffer, and the time as the system writes it.
FRAMES, BEGIN_FRAME, END_FRAME, GET_DOUBLE, SET_DOUBLE = range(DRIVER_WORDS, DRIVER_WORDS + 5)
GET_ERROR, GETTIME, HANDLE, BUFFER_ADDRESS = range(DRIVER_WORDS + 5, DRIVER_WORDS + 9)
TIME = BUFFER_ADDRESS + 1
# Constants of hdDefines.h and hdScheduler.h.
CURRENT_POSITION = 0x2050
CURRENT_FORCE = 0x2700
CALLBACK_CONTINUE = 1
_MONOTONIC = 1
_NANOSECONDS = 1_000_000_000


def haptic_frame(words: IntArray, numbers: FloatArray) -> int:
    """Push the position of the handle, and apply the force of the loop.

    The force is zero after any failure, and if the loop does not renew it.
    ``hdGetError`` returns a record, whose first number is the error, in a register.

    Args:
        words: words of the ring buffer.
        numbers: numbers of the ring buffer.

    Returns:
        The code for the scheduler to call again.
    """
    place = local_array((3,))
    force = local_array((3,))
    call_address(words[GETTIME], _MONOTONIC, words[BUFFER_ADDRESS] + 8 * TIME)
    now = words[TIME] * _NANOSECONDS + words[TIME + 1]
    wanted = latest_row(words, numbers, FORCES)
    is_nonzero = wanted.x != 0.0 or wanted.y != 0.0 or wanted.z != 0.0
    if is_nonzero and now - wanted.time > words[FORCE_TIMEOUT]:
        set_failure(words, LOOP_SILENT)
    held = words[FAILURE_CODE] == 0 and wanted.time != 0
    force[0] = wanted.x if held else 0.0
    force[1] = wanted.y if held else 0.0
    force[2] = wanted.z if held else 0.0
    call_address(words[BEGIN_FRAME], words[HANDLE])
    call_address(words[GET_DOUBLE], CURRENT_POSITION, place)
    call_address(words[SET_DOUBLE], CURRENT_FORCE, force)
    call_address(words[END_FRAME], words[HANDLE])
    wrong = call_address(words[GET_ERROR])
    if wrong != 0:
        set_failure(words, wrong)
    else:
        push_row(words, numbers, POSITIONS, place[0], place[1], place[2], now)
    store_release(words, FRAMES, words[FRAMES] + 1)
    return CALLBACK_CONTINUE
