"""From the force of the motors to the motion of a held tool, and what a hand notices of it."""
