"""Suprema between proved bounds: branch and bound, and sampling where nothing is proved."""
