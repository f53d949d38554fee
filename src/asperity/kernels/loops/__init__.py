"""Compiled loops over points, paths and samples."""
