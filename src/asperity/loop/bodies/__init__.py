"""Compiled bodies that a hand holds: their motion over one sample, and their stored energy."""
