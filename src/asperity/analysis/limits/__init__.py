"""Limits of a device on textures: the six limits, spectra and perceptibility."""
