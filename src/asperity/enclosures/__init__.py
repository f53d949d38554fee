"""Rigorous enclosures: arithmetic on boxes, and the cells that a texture is cut into."""
