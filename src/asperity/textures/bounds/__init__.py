"""Certified bounds of height derivatives over cells, for waves, splines and any bounded texture.

Its classes know no texture kind: a kind passes them what they need.
"""
