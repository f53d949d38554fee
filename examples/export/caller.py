"""The exported library called from Python, by ctypes.

asperity export sinusoid:amplitude=0.1mm,period=2mm --law C --shared -o texture.h
cmake -B build . && cmake --build build
python caller.py build/libtexture.so

With the names of two more files, it reads positions from one and writes the forces to the other:
doubles, three for each tick.
"""

import ctypes
import sys
from pathlib import Path

ABI = 1
Vector = ctypes.c_double * 3


class Facts(ctypes.Structure):
    """What the library holds: ``texture_facts``."""

    _fields_ = (
        *((name, ctypes.c_uint32) for name in ("size", "abi", "real_size", "state_size")),
        *((name, ctypes.c_double) for name in ("stiffness", "max_depth", "q", "q_plus")),
        *((name, ctypes.c_double) for name in ("max_force", "max_press", "friction")),
        *((name, ctypes.c_double) for name in ("presliding_stiffness", "friction_modulation")),
        ("max_deflection", ctypes.c_double),
        ("holds_deeper", ctypes.c_int32),
        ("precision", ctypes.c_char * 12),
        ("content", ctypes.c_char * 24),
        ("law", ctypes.c_char * 64),
    )


def load(path: str) -> tuple[ctypes.CDLL, Facts]:
    """Return a library, and what it holds; ask before anything else is called."""
    try:
        texture = ctypes.CDLL(path)
    except OSError as error:  # not there, or of another word size or processor
        sys.exit(f"the library cannot be loaded: {error}")
    abi = 0  # a library of before there was a number
    if hasattr(texture, "texture_abi_version"):
        abi = texture.texture_abi_version()
    if abi != ABI:
        sys.exit(f"the library has ABI {abi}, this program ABI {ABI}")
    facts = Facts(ctypes.sizeof(Facts))
    texture.texture_info(ctypes.byref(facts))
    if facts.real_size != ctypes.sizeof(ctypes.c_double):
        sys.exit(f"the library takes {facts.precision.decode()}, this program double")
    return texture, facts


texture, facts = load(sys.argv[1])
state = ctypes.create_string_buffer(facts.state_size)
force = Vector()
texture.texture_reset(state)
if len(sys.argv) == 4:
    data = bytearray(Path(sys.argv[2]).read_bytes())
    for at in range(0, len(data), 24):
        texture.texture_force(state, Vector.from_buffer(data, at), force)
        data[at : at + 24] = force
    Path(sys.argv[3]).write_bytes(data)
    sys.exit()
for tick in range(5):
    texture.texture_force(state, Vector(0.25e-3 * tick, 0.1e-3, -0.05e-3), force)
    print(*[component.hex() for component in force])
