"""What no data sheet gives: a device is pushed, and raised against a wall, until it tells."""
