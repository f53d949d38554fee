"""Textures cut into cells, with rigorous enclosures of their height derivatives on each.

The cells of waves, of splines, and those that proved bounds give of any texture. They know no
texture kind: a kind hands them what they need.
"""
