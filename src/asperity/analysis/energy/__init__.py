"""Energy gained by the hand: leaks, loop integrals, continuity and merit."""
