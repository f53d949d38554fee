"""Kernels of the shipped laws, derived by `make kernels`: do not edit."""
