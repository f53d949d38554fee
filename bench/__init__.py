"""The benchmark: ``python -m bench [kernels] [cache] [nearest] [waiting]``, all by default.

Speed is stated as a ratio against the same computation in C on the same machine, measured in turns.
"""
