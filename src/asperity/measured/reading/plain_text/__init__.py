"""Readers of text matrices, profiles and point lists."""
