"""Results: comparisons, analyses and the six limits, from a surface and a device."""
