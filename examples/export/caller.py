"""The exported library called from Python, by ctypes.

asperity export sinusoid:amplitude=0.1mm,period=2mm --law C --shared -o texture.h
cmake -B build . && cmake --build build
python caller.py build/libtexture.so
"""

import ctypes
import sys

Vector = ctypes.c_double * 3
# As large as texture_state; what is in it concerns the library alone.
State = ctypes.c_double * 26

texture = ctypes.CDLL(sys.argv[1])
state, force = State(), Vector()
texture.texture_reset(ctypes.byref(state))
for tick in range(5):
    position = Vector(0.25e-3 * tick, 0.1e-3, -0.05e-3)
    texture.texture_force(ctypes.byref(state), position, force)
    print(*[component.hex() for component in force])
