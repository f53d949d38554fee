"""Perception studies: methods, sessions with participants, and their statistics."""
