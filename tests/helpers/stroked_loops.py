"""A servo with every option, a hand of three stiffnesses, and oblique strokes."""

from __future__ import annotations

from asperity.simulation import Servo, SpringHand, Strokes

FULL = Servo(
    1e-4,
    delay=1,
    position_resolution=5e-6,
    force_resolution=5e-3,
    max_force=3.0,
    virtual_damping=0.2,
    velocity_share=0.3,
)
HAND = SpringHand([300.0, 200.0, 250.0], 2.0, mass=0.02, force=(0.1, -0.2, -0.3))
STROKES = Strokes((0.0, 0.0, -1e-3), (7e-3, 3e-3, -1e-3), speed=0.05, count=9)
