"""Baked potential fields of law H: grid, potentials at nodes, certificate, file, force kernels."""
