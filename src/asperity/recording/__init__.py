"""Recordings of loops on disk: see :mod:`asperity.recording.writer`."""
