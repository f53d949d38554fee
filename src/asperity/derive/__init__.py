"""What follows from a law: Jacobian, curl, definition in many digits, kernels."""
