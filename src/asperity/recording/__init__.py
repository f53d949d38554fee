"""What a loop did, on disk, whatever happens: see :mod:`asperity.recording.writer`."""
