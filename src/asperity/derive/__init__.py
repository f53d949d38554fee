"""Derivations from a law: Jacobian, curl, facts and kernels."""
