"""What is compiled: functions of texture, contact and law, linked into one module."""
