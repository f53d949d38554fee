"""The loop that renders a surface on a device, in a process of its own, and the drivers.

:class:`asperity.servo.process.ServoProcess` is the way in.
"""
