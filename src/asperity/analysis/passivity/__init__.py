"""Passivity of a surface on a device: criteria, verdict and recommended stiffness."""
