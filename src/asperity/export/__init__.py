"""The analysed law for other programs: C99, printed from the functions that Numba compiles."""
