"""Gain, leak and jumps of any renderer, as a black box: found by search, with witnesses."""
