"""Texture, device and hand in one loop, with the energy accounted for exactly."""
