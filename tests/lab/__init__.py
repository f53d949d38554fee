"""Tests of the lab: a package, so that its lab and its browser end with its last test."""
