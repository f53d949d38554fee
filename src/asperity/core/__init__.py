"""Plumbing that knows nothing of haptics: errors, units, checks, files, cache, processes."""
