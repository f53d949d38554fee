"""Compiled code: functions of texture, contact and law, linked into one module."""
