"""The god-object: the globally nearest point of the surface."""
