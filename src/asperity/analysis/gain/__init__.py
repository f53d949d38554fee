"""Loop gain of a law: characteristic, one-sided and curl number."""
