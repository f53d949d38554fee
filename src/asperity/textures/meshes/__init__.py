"""Closed bodies from meshes: reading, faults, closest points, and law H baked as a field."""
