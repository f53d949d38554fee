"""Law H beyond its force: its state, and its baked potential field."""
