"""Measurement of a device: noise, dynamics, delay and the stiffest stable wall."""
