"""Detection of limit cycles, and the stiffness at which they begin."""
