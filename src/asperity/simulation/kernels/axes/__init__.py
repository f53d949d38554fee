"""Kernels of bodies that move along each axis independently."""
